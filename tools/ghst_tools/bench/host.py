"""The library on the host: how many frames a second `ghst.Receiver` takes, in wall time."""

from __future__ import annotations

import platform
import subprocess
import time
from itertools import islice

from ghst import Receiver  # type: ignore[import-not-found]
from ghst_tools import boards, micropython_image
from ghst_tools.bench.figures import Effort, Table
from ghst_tools.bench.rig import control_frames
from ghst_tools.errors import GhstError

_RUNS = 5
_DISTINCT = 100  # frames; they are fed again and again

_UNIX_PROGRAM = """
import sys, time
from binascii import unhexlify
from ghst import Receiver
frames = [unhexlify(word) for word in sys.stdin.readline().split()]
for run in range({runs}):
    receiver = Receiver()
    start = time.ticks_us()
    for again in range({rounds}):
        for frame in frames:
            receiver.feed(frame)
    print(time.ticks_diff(time.ticks_us(), start), receiver.frames)
print(".".join(str(part) for part in sys.implementation.version[:3]))
"""


def on_cpython(frames: list[bytes], rounds: int) -> float:
    """Frames a second on the interpreter that runs this, the best of some runs."""
    seconds = []
    for _ in range(_RUNS):
        receiver = Receiver()
        start = time.perf_counter()
        for _ in range(rounds):
            for frame in frames:
                receiver.feed(frame)
        seconds.append(time.perf_counter() - start)
        if receiver.frames != rounds * len(frames):
            raise AssertionError(f"{receiver.frames} frames of {rounds * len(frames)} decoded")
    return rounds * len(frames) / min(seconds)


def on_unix(frames: list[bytes], rounds: int) -> tuple[float, str]:
    """The same on MicroPython's unix port; and its version."""
    done = subprocess.run(
        [
            micropython_image.unix_micropython(),
            "-c",
            _UNIX_PROGRAM.format(runs=_RUNS, rounds=rounds),
        ],
        env={"MICROPYPATH": f"{boards.checkout() / 'lib'}:.frozen"},
        input=" ".join(frame.hex() for frame in frames) + "\n",
        capture_output=True,
        text=True,
    )
    if done.returncode:
        lines = done.stderr.strip().splitlines() or ["no reason given"]
        raise GhstError(f"MicroPython's unix port ended: {lines[-1]}")
    *runs, version = done.stdout.split("\n")[: _RUNS + 1]
    count = rounds * len(frames)
    microseconds = []
    for run in runs:
        elapsed, decoded = map(int, run.split())
        if decoded != count:
            raise AssertionError(f"{decoded} frames of {count} decoded")
        microseconds.append(elapsed)
    return count * 1e6 / min(microseconds), version


def speed(effort: Effort) -> tuple[Table, ...]:
    """Frames a second on both interpreters."""
    frames = list(islice(control_frames(), _DISTINCT))
    rounds = effort.host_frames // _DISTINCT
    unix, version = on_unix(frames, rounds)
    rows = (
        (f"CPython {platform.python_version()}", on_cpython(frames, rounds)),
        (f"MicroPython {version}, unix port", unix),
    )
    table = Table(
        "ghst.Receiver on the host",
        f"Host wall time, so the figures depend on the machine and change from run to run: "
        f"{rounds * _DISTINCT} frames, one call of feed() each, the best of {_RUNS} runs.",
        ("interpreter", "frames per second"),
        tuple((name, f"{round(rate, -2):.0f}") for name, rate in rows),
        repeatable=False,
    )
    return (table,)
