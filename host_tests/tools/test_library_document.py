"""docs/library.md: its programs run as they stand, with stand-ins for the hardware."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
import time
import tty
from pathlib import Path

import pytest

from ghst import encode
from ghst_tools import boards, micropython_image

LIBRARY = str(boards.checkout() / "lib")
DOCUMENT = (boards.checkout() / "docs" / "library.md").read_text(encoding="utf-8")
CHANNELS, PORT, UART = re.findall(r"```python\n(.*?)```", DOCUMENT, re.DOTALL)
(PRINTED,) = re.findall(r"```text\n(.*?)```", DOCUMENT, re.DOTALL)

FRAME = encode.link_data(0x13, (1984, 1984, 384, 3584), rf_mode=10)
QUIET_MODE = encode.link_data(0x13, (1984, 1984, 384, 3584), rf_mode=7)

# A clock that goes on when it is looked at, so that a busy machine changes nothing.
CLOCK = """
now_us = 0

def ticks_us():
    global now_us
    now_us += 20
    return now_us

def ticks_ms():
    return now_us // 1000

def ticks_diff(end, start):
    return end - start
"""
# What comes at which time, from `arrivals`; a frame that is written comes back.
MACHINE = """
import time
from arrivals import ARRIVALS

class Pin:
    def __init__(self, number):
        pass

class UART:
    def __init__(self, number, baudrate, *, tx, rx, rxbuf):
        assert baudrate == 420000
        self.arrivals = [(at, bytes(octets)) for at, octets in ARRIVALS]

    def any(self):
        if self.arrivals and time.now_us >= self.arrivals[0][0]:
            return len(self.arrivals[0][1])
        if time.now_us > 2_000_000:
            raise SystemExit
        return 0

    def readinto(self, buffer, size):
        _, octets = self.arrivals.pop(0)
        assert len(octets) == size
        buffer[:size] = octets
        return size

    def write(self, frame):
        print("sent", frame[:3].hex(), "at", time.now_us)
        self.arrivals.insert(0, (time.now_us + 300, bytes(frame)))
"""


def run(
    program: Path | str, code: str, folder: Path | None = None
) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([LIBRARY] if folder is None else [str(folder), LIBRARY])
    variables = {**os.environ, "PYTHONPATH": path, "MICROPYPATH": path}
    return subprocess.run(
        [program, "-c", code], capture_output=True, text=True, env=variables, check=False
    )


@pytest.mark.parametrize("interpreter", ["cpython", "unix"])
def test_channels(interpreter: str) -> None:
    program = sys.executable if interpreter == "cpython" else micropython_image.unix_micropython()
    done = run(program, CHANNELS)
    assert done.stdout == PRINTED, done.stderr


def test_a_serial_port_on_cpython(tmp_path: Path) -> None:
    wire, terminal = pty.openpty()
    tty.setraw(wire)
    code = PORT.replace("/dev/ttyUSB0", os.ttyname(terminal))
    assert code != PORT
    output = tmp_path / "output"
    with output.open("w") as file:
        child = subprocess.Popen(
            [sys.executable, "-u", "-c", code],
            stdout=file,
            env={**os.environ, "PYTHONPATH": LIBRARY},
        )
    deadline_s = time.monotonic() + 60
    try:
        # Frames until one was understood: the program takes its time to open the port.
        while "us\n" not in output.read_text() and time.monotonic() < deadline_s:
            os.write(wire, FRAME)
            time.sleep(0.05)
        while "link lost\n" not in output.read_text() and time.monotonic() < deadline_s:
            time.sleep(0.05)
    finally:
        child.kill()
        child.wait()
        os.close(wire)
        os.close(terminal)
    lines = output.read_text().splitlines()
    assert lines[:2] == ["linked", "1500.0 us"]
    assert lines[-1] == "link lost"


def fly(folder: Path, arrivals: list[tuple[int, bytes]]) -> list[str]:
    """What the program for MicroPython prints when these bytes come at these microseconds."""
    (folder / "time.py").write_text(CLOCK)
    (folder / "machine.py").write_text(MACHINE)
    (folder / "arrivals.py").write_text(f"ARRIVALS = {arrivals!r}\n")
    done = run(micropython_image.unix_micropython(), UART, folder)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


def test_a_uart_on_micropython(tmp_path: Path) -> None:
    arrivals = [(10_000, FRAME[:6]), (10_200, FRAME[6:]), (14_000, FRAME), (18_000, FRAME)]
    linked, sent, lost = fly(tmp_path, arrivals)
    assert (linked, lost) == ("linked", "link lost")
    # The battery is due once in 100 ms, so the other two frames have none behind them.
    found = re.fullmatch(r"sent 890c23 at (\d+)", sent)
    assert found and 11_200 <= int(found[1]) < 11_300


def test_nothing_is_sent_in_a_mode_without_telemetry(tmp_path: Path) -> None:
    assert fly(tmp_path, [(10_000, QUIET_MODE)]) == ["linked", "link lost"]


def test_nothing_is_sent_while_bytes_come(tmp_path: Path) -> None:
    assert fly(tmp_path, [(10_000, FRAME), (10_700, FRAME[:3])]) == ["linked", "link lost"]


def test_the_names_are_there() -> None:
    import ghst

    for name in ("pulses", "crc_errors", "skipped_bytes", "lq", "rssi_dbm", "rf_mode"):
        assert f"`{name}`" in DOCUMENT and hasattr(ghst.Receiver(), name)
    for target in re.findall(r"\]\(([^)#:]+)\)", DOCUMENT):
        assert (boards.checkout() / "docs" / target).exists(), target
