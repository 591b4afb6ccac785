"""`ghst decode` on the host: how long a long recording takes, in wall time."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path

from ghst_tools.bench.figures import Effort, Table
from ghst_tools.bench.rig import control_frames
from ghst_tools.errors import GhstError
from ghst_tools.frames import log

_DISTINCT = 10_000  # frames of random values, again and again
_INTERVAL_S = 0.002  # Race500
_TIMES_HOST_FRAMES = 50


def speed(effort: Effort) -> tuple[Table, ...]:
    """Seconds for a recording of 50 times `effort.host_frames`, as text and as JSON."""
    count = effort.host_frames * _TIMES_HOST_FRAMES
    frames = list(islice(control_frames(), min(count, _DISTINCT)))
    frames = (frames * -(-count // len(frames)))[:count]
    rows = []
    with tempfile.TemporaryDirectory() as name:
        raw, logged = Path(name, "raw"), Path(name, "log")
        raw.write_bytes(b"".join(frames))
        lines = [log.line(number * _INTERVAL_S, frame) for number, frame in enumerate(frames)]
        logged.write_text(log.header("", datetime.now(UTC)) + "".join(lines))
        for path in (raw, logged):
            for option in ((), ("--json",)):
                seconds = _run(path, option, count)
                what = f"{path.name}, {'JSON' if option else 'text'}"
                rows.append((what, f"{seconds:.1f}", f"{round(count / seconds, -3):.0f}"))
    table = Table(
        "ghst decode on the host",
        f"Host wall time, so the figures depend on the machine and change from run to run: "
        f"{count} control frames with random values, the whole command in one process, its output "
        "thrown away.",
        ("recording, output", "seconds", "frames per second"),
        tuple(rows),
        repeatable=False,
    )
    return (table,)


def _run(path: Path, option: tuple[str, ...], count: int) -> float:
    command = [sys.executable, "-m", "ghst_tools.cli", "decode", *option, str(path)]
    start = time.perf_counter()
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    seconds = time.perf_counter() - start
    if done.returncode:
        raise GhstError(f"ghst decode ended with {done.returncode}: {done.stderr.strip()}")
    if option and not done.stderr.startswith(f"{count} valid frames in {14 * count} bytes\n"):
        raise AssertionError(f"not all frames found: {done.stderr}")
    return seconds
