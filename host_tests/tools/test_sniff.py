"""`ghst sniff` on a pseudo-terminal: what it shows, what it keeps, and ports that misbehave."""

from __future__ import annotations

import io
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from recordings import pack, uplink
from rich.console import Console
from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo
from terminal import Terminal, terminal

from ghst_tools.cli import ghst
from ghst_tools.errors import GhstError
from ghst_tools.frames.blocks import Block
from ghst_tools.frames.timeline import Reads
from ghst_tools.serial_port import open_wire
from ghst_tools.sniff.listen import Listener
from ghst_tools.sniff.log_file import LogFile
from ghst_tools.sniff.state import State
from ghst_tools.sniff.view import LiveView

COMMAND = [sys.executable, "-m", "ghst_tools.cli", "sniff"]
FRAMES = uplink(3)


@pytest.fixture
def wire() -> Iterator[Terminal]:
    with terminal() as made:
        yield made


def start(wire: Terminal, *args: str, log: Path | None = None) -> subprocess.Popen[bytes]:
    """Run the command; with a `log` it listens already when this returns."""
    kept = ["--log", str(log)] if log else []
    running = subprocess.Popen(
        [*COMMAND, "--port", wire.port, *kept, *args],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    while log and not log.exists():
        assert running.poll() is None
        time.sleep(0.01)
    return running


def hear(running: subprocess.Popen[bytes], wire: Terminal, data: bytes) -> bytes:
    """Send `data`, of which the command makes a line; returns the line."""
    assert running.stdout
    wire.send(data)
    return running.stdout.readline()


def logged(path: Path) -> bytes:
    """The bytes in a log."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    return b"".join(bytes.fromhex(line.split()[1]) for line in lines)


def test_frames_go_to_the_screen_and_to_the_log(wire: Terminal, tmp_path: Path) -> None:
    path = tmp_path / "new.log"
    running = start(wire, log=path)
    first = hear(running, wire, FRAMES[0])
    assert re.fullmatch(rb" +\d+\.\d{6} s  up    0x11  channels 9-12 .* us\n", first)
    assert b"down  0x23  pack status" in hear(running, wire, pack(7))
    assert b"0x13  link data" in hear(running, wire, FRAMES[1])
    running.send_signal(signal.SIGINT)
    out, err = running.communicate()
    assert (running.returncode, err) == (0, b"")
    lines = out.decode().splitlines()
    assert lines[:6] == [
        "",
        "3 valid frames in 42 bytes",
        "        1  up    0x11  channels 9-12",
        "        1  up    0x13  link data",
        "        1  down  0x23  pack status",
        "0 damaged frames, 0 bytes of garbage in 0 pieces",
    ]
    assert lines[-1] == f"log: {path}"
    assert path.read_text().startswith(f"# ghst log 1\n# 420000 baud, {wire.port}, 20")
    assert logged(path) == FRAMES[0] + pack(7) + FRAMES[1]
    decoded = CliRunner().invoke(ghst, ["decode", str(path)])
    assert decoded.stdout.splitlines()[4] == "3 valid frames in 42 bytes"


def test_it_ends_by_itself(wire: Terminal) -> None:
    running = start(wire, "--seconds", "0.05", "--baud", "400000")
    out, err = running.communicate()
    assert (running.returncode, err) == (0, b"")
    assert out.decode().splitlines()[1] == "0 valid frames in 0 bytes"


def test_the_speed_of_the_port_is_that_of_the_wire(wire: Terminal) -> None:
    line = open_wire(wire.port)
    settings = (line.baudrate, line.bytesize, line.parity, line.stopbits)
    line.close()
    assert settings == (420000, 8, "N", 1)


def test_a_log_is_never_overwritten(wire: Terminal, tmp_path: Path) -> None:
    path = tmp_path / "kept.log"
    path.write_text("mine")
    result = CliRunner().invoke(ghst, ["sniff", "--port", wire.port, "--log", str(path)])
    assert (result.exit_code, result.stderr) == (
        1,
        f"ghst: {path}: exists already: name a new file\n",
    )
    assert path.read_text() == "mine"


def test_an_adapter_that_is_unplugged(wire: Terminal, tmp_path: Path) -> None:
    path = tmp_path / "new.log"
    running = start(wire, log=path)
    hear(running, wire, FRAMES[0])
    wire.unplug()
    out, err = running.communicate()
    assert running.returncode == 1
    assert re.fullmatch(
        rf"ghst: {wire.port}: gone \(unplugged\?\): listened for \d+\.\d s; "
        rf"what came before is in {path}\n",
        err.decode(),
    )
    assert out.decode().splitlines()[1] == "1 valid frame in 14 bytes"
    assert logged(path) == FRAMES[0]


def test_a_port_that_is_busy(wire: Terminal) -> None:
    line = open_wire(wire.port)
    result = CliRunner().invoke(ghst, ["sniff", "--port", wire.port])
    line.close()
    assert (result.exit_code, result.stdout) == (1, "")
    assert result.stderr.startswith(f"ghst: {wire.port}: busy: close the program that has it open")


def test_a_port_that_is_not_there() -> None:
    result = CliRunner().invoke(ghst, ["sniff", "--port", "/dev/ttyNONE"])
    assert (result.exit_code, result.stdout, result.stderr) == (
        1,
        "",
        "ghst: /dev/ttyNONE: there is no such port\n",
    )


@pytest.mark.skipif(os.geteuid() == 0, reason="root may open every port")
def test_a_port_without_permission(wire: Terminal) -> None:
    os.chmod(wire.port, 0)
    result = CliRunner().invoke(ghst, ["sniff", "--port", wire.port])
    assert result.exit_code == 1
    assert result.stderr.startswith(f"ghst: {wire.port}: no permission: ")


def test_without_a_port_those_that_there_are_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    adapter = ListPortInfo("/dev/ttyUSB1")
    adapter.description = "CP2102 USB to UART"
    monkeypatch.setattr(list_ports, "comports", lambda: [adapter])
    result = CliRunner().invoke(ghst, ["sniff"])
    assert result.stderr == (
        "ghst: say which port with --port: /dev/ttyUSB1 (CP2102 USB to UART)\n"
    )
    monkeypatch.setattr(list_ports, "comports", list)
    result = CliRunner().invoke(ghst, ["sniff"])
    assert result.stderr == (
        "ghst: say which port with --port: there is none on this computer: plug in a USB-serial "
        "adapter\n"
    )


class Line:
    """A serial port that gives what it was given, and then fails."""

    port = "port"
    in_waiting = 13

    def __init__(self, data: bytes) -> None:
        self._data = io.BytesIO(data)

    def read(self, size: int) -> bytes:
        if data := self._data.read(size):
            return data
        raise OSError("gone")


def test_what_came_before_an_error_is_taken_first() -> None:
    with Listener(Line(FRAMES[0] + FRAMES[1])) as listener:
        found: list[bytes] = []
        with pytest.raises(OSError, match="gone"):
            while True:
                found += [data for _, data in listener.take()]
    assert b"".join(found) == FRAMES[0] + FRAMES[1]
    assert sys.getswitchinterval() == pytest.approx(0.005)


def test_a_log_on_a_full_disk_is_told(tmp_path: Path) -> None:
    log_file = LogFile(Path("/dev/full"))
    with pytest.raises(GhstError, match=r"^/dev/full: "), log_file.open("port", 420000):
        log_file.add(1.0, FRAMES[0])


def test_the_view() -> None:
    console = Console(width=100, height=40, file=io.StringIO(), force_terminal=True)
    view = LiveView(console, "ghst sniff port")
    state = State(420000)

    def shown() -> str:
        with console.capture() as capture:
            console.print(view.draw(state))
        return re.sub(r"\x1b\[[0-9;]*m", "", capture.get())

    assert "no control frames  no link data yet" in shown()
    times = [0.01, 0.0144, 0.0182, 0.021]
    for time_s, data in zip(times, [*FRAMES, pack(3)], strict=True):
        reads = Reads(np.array([len(data)]), np.array([time_s]))
        state.add(Block(data, reads), time_s)
    with view:
        view.show(state)
    text = shown()
    assert "control frames  LQ  98 %  RSSI  -70 dBm  Race250  +20 dBm" in text
    assert re.search(r"up +0x11 +channels 9-12 +1 +47\.6", text)
    assert re.search(r"down +0x23 +pack status +1 +47\.6", text)
    assert "control frame to control frame: 4100 us in the median, 3800 to 4400 us, 2 me" in text
    pulses = [pulse / 4 for pulse in state.receiver.pulses]
    assert re.search(rf"│ 1 +{pulses[0]:.2f} +2 +{pulses[1]:.2f}", text)
    assert re.search(rf"9 +{pulses[8]:.2f}", text) and re.search(r"13 +- ", text)
    # Nothing for more than half a second.
    state.add(Block(b""), 1.0)
    view.show(state)
    assert "no control frames" in shown()
