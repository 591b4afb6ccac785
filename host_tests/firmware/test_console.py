"""What a user types on the USB console, and the calibration of the magnetometer by it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from rig import NO_SENSORS, Pico

import ghst
from forked import forked
from ghst_tools import boards
from ghst_tools import filesystem as littlefs
from ghst_tools.emulator.i2c_magnetometers import Qmc5883l
from ghst_tools.emulator.i2c_sensors import field_at

IRON_NT = (9_000.0, -4_000.0, 0.0)
CENTRE = ghst.encode.channels(0x30, (2048,) * 4, (128,) * 4)


@pytest.fixture(scope="module")
def powered(micropython_image: Path, firmware_files: dict[str, bytes]) -> Pico:
    """A Pico with the firmware and a magnetometer that finds its chip later; for forked tests."""
    pico = Pico(micropython_image, firmware_files, boards.load("rpi_pico").filesystem_size)
    pico.boot(NO_SENSORS | {"magnetometer": {}})
    return pico


def type_line(pico: Pico, line: bytes, wait_ns: float = 150e6) -> str:
    """Type a line, return what is printed within `wait_ns`."""
    start = len(pico.board.console.output)
    pico.board.console.write(line + b"\r")
    pico.board.run_for(wait_ns)
    return pico.board.console.output[start:].decode().replace("\r", "")


class Turned:
    """A chip on the bus, and the model's own iron beside it."""

    def __init__(self, pico: Pico) -> None:
        self.heading_deg = 0.0
        self._pico = pico
        bus = pico.board.i2c(0)
        bus.attach(0x0D, Qmc5883l(pico.board, lambda t: self._field()))
        bus.connect(pico.board.pin(4), pico.board.pin(5))
        pico.board.run_until(lambda: "QMC5883L: " in self.shown(), 8e9)

    def _field(self) -> tuple[float, float, float]:
        x, y, z = field_at(self.heading_deg)
        return x + IRON_NT[0], y + IRON_NT[1], z + IRON_NT[2]

    def shown(self) -> str:
        """The line about the magnetometer."""
        self._pico.board.run_for(200e6)
        text = self._pico.reply_to_enter()
        return next(line for line in text.splitlines() if line.startswith("magnetometer: "))

    def turn(self, degrees: int) -> None:
        """Turn the model clockwise, a circle in 1.35 s."""
        for _ in range(0, degrees, 12):
            self.heading_deg = (self.heading_deg + 12) % 360
            self._pico.board.run_for(45e6)


@forked
def test_calibrating_the_magnetometer_and_keeping_it(powered: Pico) -> None:
    model = Turned(powered)
    assert "turn the model level" in type_line(powered, b"calibrate")
    assert ", calibrating" in model.shown()
    model.turn(120)
    assert "It goes on: turn further" in type_line(powered, b"calibrate")
    model.turn(480)
    text = type_line(powered, b"calibrate", 400e6)
    assert "nT; saved as soon as there is no link" in text
    offset_nt = [int(word) for word in text.partition("offset ")[2].split()[:3]]
    assert abs(offset_nt[0] - IRON_NT[0]) < 600
    assert abs(offset_nt[1] - IRON_NT[1]) < 600
    saved = json.loads(littlefs.read(powered.board.flash_filesystem())["/ghst.json"])
    assert saved == NO_SENSORS | {"magnetometer": {"offset_nt": offset_nt}}
    model.heading_deg = 90.0
    degrees = float(model.shown().partition("QMC5883L: ")[2].split()[0])
    assert abs(degrees - 90.0) < 2.0


@forked
def test_a_cancelled_calibration_changes_nothing(powered: Pico) -> None:
    model = Turned(powered)
    type_line(powered, b"calibrate")
    model.turn(60)
    assert "cancelled" in type_line(powered, b"calibrate cancel", 400e6)
    assert "calibrating" not in model.shown()
    saved = json.loads(littlefs.read(powered.board.flash_filesystem())["/ghst.json"])
    assert saved["magnetometer"] == {}


def test_the_offset_is_taken_from_the_file(pico: Pico) -> None:
    pico.boot(NO_SENSORS | {"magnetometer": {"offset_nt": [9000, -4000, 0]}})
    model = Turned(pico)
    model.heading_deg = 270.0
    degrees = float(model.shown().partition("QMC5883L: ")[2].split()[0])
    assert abs(degrees - 270.0) < 2.0


@forked
def test_help_and_what_is_no_command(powered: Pico) -> None:
    text = type_line(powered, b"help")
    assert "calibrate [cancel]: " in text and "(Enter): the state of everything" in text
    assert "no command 'fly': type help" in type_line(powered, b"fly me")
    assert "no command" in type_line(powered, b"\xff\x00\xc3")
    # Backspace, and a line that is too long: it is dropped as a whole.
    assert "(Enter)" in type_line(powered, b"hex\x08lp")
    assert type_line(powered, b"help" * 25) == ""


@forked
def test_a_flood_of_bytes_stops_neither_frames_nor_the_main_loop(powered: Pico) -> None:
    receiver = powered.fly(lambda index, t: CENTRE, 500)
    for _ in range(20):
        powered.board.console.write(b"\xffcalibrate" * 20)
        powered.board.run_for(10e6)
    receiver.stop()
    powered.board.console.write(b"\r")
    powered.board.run_for(200e6)
    text = powered.reply_to_enter()
    assert "stood still 0 times" in text
    assert f"frames {len(receiver.sent)}, CRC errors 0, bytes skipped 0" in text
