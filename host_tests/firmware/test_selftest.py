"""The self-test on the emulated board: all right as the picture shows, and each fault told."""

from __future__ import annotations

import io
import re
from itertools import islice
from pathlib import Path

import pytest
from rich.console import Console
from selftest_rig import BOARD, PLAYER, Rig, not_ok

from forked import forked
from ghst_tools import boards
from ghst_tools.campaign.pico import Pico
from ghst_tools.emulator import Edge, GhostReceiver, Jumper
from ghst_tools.emulator.i2c_bmp280 import Bmp280
from ghst_tools.selftest import before, link, loss, report, servos, slot
from ghst_tools.selftest.result import Verdict

WIDTH = 130
# How the samples, the tick or the main loop lie to what is measured.
MOMENTS = ("I2C: scan ", "telemetry slot: start ", "failsafe: time ", "watchdog ")
PICTURE = "see docs/img/selftest_rpi_pico.svg"
SKIPPED = ["no pulses, bad frames", "wire", "servos", "telemetry slot", "failsafe", "watchdog"]


def without_moments(table: str) -> list[str]:
    """The lines of a table; without the figures that depend on when something was done."""
    return [
        re.sub(r"[\d.]+", "#", line) if line[2:].startswith(MOMENTS) else line.rstrip()
        for line in table.splitlines()
    ]


@pytest.fixture(scope="module")
def rig(micropython_image: Path, firmware_files: dict[str, bytes]) -> Rig:
    """One board for all: each test has a copy of it."""
    pico = Pico(micropython_image, firmware_files, BOARD.filesystem_size)
    pico.boot()
    return Rig(pico)


@forked
def test_everything_is_all_right(rig: Rig) -> None:
    results = rig.all()
    assert not_ok(results) == []
    console = Console(width=WIDTH, file=io.StringIO(), record=True)
    console.print(report.table(BOARD, results))
    document = (boards.checkout() / "docs/selftest.md").read_text()
    told = document.partition("```text\n")[2].partition("\n```")[0]
    assert without_moments(console.export_text()) == without_moments(told)
    # Nobody has driven against anybody, and nothing is left on the board.
    assert rig.pico.wire.contention == []
    assert "selftest" not in rig.session.run(
        "import os\nprint(os.listdir('/'), os.listdir('/lib'))"
    )


@forked
def test_a_missing_jumper_is_told_and_the_rest_goes_on(rig: Rig) -> None:
    rig.jumper.remove()
    results = rig.all()
    assert not_ok(results) == ["jumper", *SKIPPED]
    assert (results[0].verdict, results[0].measured) == (Verdict.WIRING, "not tied")
    assert results[0].hint == f"GP2 and GP3 are not tied: {PICTURE}"
    assert {result.verdict for result in results[-len(SKIPPED) :]} == {Verdict.SKIPPED}


@forked
def test_what_is_wrong_with_the_wire_is_told(rig: Rig) -> None:
    context, board = rig.context, rig.board
    board.pin(PLAYER).short(False)
    result = before.jumper(context)
    assert result.measured == "GP2 and GP3 low"
    assert result.hint == (
        f"GP2 and GP3 are held low: take off what is connected there: {PICTURE}"
    )
    board.pin(PLAYER).short(True)
    result = before.jumper(context)
    assert result.measured == "GP3 stays high"
    assert result.hint == f"GP3 is held high: take off what is there: {PICTURE}"
    board.pin(PLAYER).short(None)
    rig.jumper.remove()
    board.pin(PLAYER).short(False)
    result = before.jumper(context)
    assert result.measured == "GP3 low"
    assert result.verdict is Verdict.WIRING
    board.pin(PLAYER).short(None)
    receiver = GhostReceiver(rig.pico.wire, lambda index, t_ns: b"\x82\x0c", rate_hz=19)
    receiver.start()
    result = before.jumper(context)
    assert (result.measured, result.hint) == (
        "somebody talks",
        f"take the receiver off GP2: {PICTURE}",
    )


@forked
def test_servo_pins_that_are_held_or_tied_are_told(rig: Rig) -> None:
    rig.board.pin(9).short(False)
    rig.board.pin(11).short(True)
    Jumper(rig.board, 12, 13)
    rig.start()
    found = rig.of(servos.pulses)
    wrong = {
        name.split()[1].rstrip(","): (result.measured, result.hint)
        for name, result in found.items()
        if result.verdict is Verdict.FAILED
    }
    assert wrong == {
        "GP9": (
            "no pulse / no pulse / no pulse us",
            "GP9 stays low: something holds it, or it is shorted",
        ),
        "GP11": (
            "no pulse / no pulse / no pulse us",
            "GP11 stays high: something holds it, or it is shorted",
        ),
        "GP13": ("1400.00 / 1520.00 / 880.00 us", "GP13 moves with GP12: are they shorted?"),
        "GP12": ("1400.00 / 1520.00 / 880.00 us", "GP12 moves with GP13: are they shorted?"),
    }


@forked
def test_a_servo_pin_that_moves_without_a_frame_is_told(rig: Rig) -> None:
    clock, pin = rig.board.clock, rig.board.pin(9)
    rig.start()
    clock.create_alarm(lambda: pin.short(True)).schedule(40e6)
    result = next(iter(link.before_frames(rig.context)))
    assert (result.verdict, result.measured) == (Verdict.FAILED, "edges at GP9")


@forked
def test_frames_that_are_damaged_on_the_way_are_told(rig: Rig) -> None:
    wire = rig.pico.wire
    last_ns = 0.0

    def damage(edge: Edge) -> None:
        # One bit low, 60 us into each frame: within its type or its channels.
        nonlocal last_ns
        if not edge.level and edge.t_ns - last_ns > 1e6:
            wire.hold(False, edge.t_ns + 60e3, edge.t_ns + 64e3)
        last_ns = edge.t_ns

    wire.watch(damage)
    rig.start()
    found = list(link.types(rig.context))
    assert not_ok(found) == ["legacy frames", "12-bit frames", "VTX and MSP frames"]
    assert found[0].hint.startswith("bits are lost on the way: look at the jumper GP2 - GP3")
    assert [result.measured.partition(", different")[0] for result in found] == [
        "0 decoded, 16 CRC errors",
        "0 decoded, 16 CRC errors",
        "0 decoded, 3 CRC errors",
    ]


@forked
def test_a_slot_that_is_late_is_told(rig: Rig) -> None:
    rig.start()
    # Two cycles of 149 ns for each loop more.
    rig.board.pio.by_index[1].machines[0].input_shift_reg += 336
    start, frames = islice(slot.slots(rig.context), 2)
    assert start.verdict is Verdict.FAILED
    low, high = re.fullmatch(r"([\d.]+)\.\.([\d.]+) us, 8 of 8", start.measured).groups()
    # A sample lasts 0.256 us.
    assert 1099.7 <= float(low) <= float(high) <= 1100.3
    assert frames.verdict is Verdict.OK


@forked
def test_adc_and_i2c_tell_what_is_connected(rig: Rig) -> None:
    board, context = rig.board, rig.context
    bus = board.i2c(0)
    bus.attach(0x76, Bmp280(board, lambda t_ns: 100_000.0, lambda t_ns: 20.0))
    bus.connect(board.pin(4), board.pin(5))
    lines, scan = before.i2c(context)
    assert lines.measured == "so"
    assert scan.measured.partition(";")[0] == "0x76 (BMP280, BME280 or DPS310)"
    # A divider of 10 kOhm and 1 kOhm with a battery of 3.3 V.
    board.adc(0).set_volts(0.3)
    board.adc(4).set_volts(0.0)
    temperature, battery = before.analog(context)
    assert (temperature.verdict, temperature.measured) == (Verdict.FAILED, "437 °C")
    assert (battery.verdict, battery.measured) == (Verdict.WIRING, "0.30 V, 0.30 V")
    board.pin(4).short(False)
    lines, scan = before.i2c(context)
    assert (lines.measured, scan.verdict) == ("GP4 low", Verdict.SKIPPED)
    assert (
        lines.hint == "GP4 held low: take the sensors off; with nothing there the pin is shorted"
    )
    board.pin(4).short(None)
    Jumper(board, 4, 5)
    lines, scan = before.i2c(context)
    assert scan.verdict is Verdict.SKIPPED
    assert lines.measured == "SDA low: 0/0, SCL low: 0/0"
    assert lines.hint == "GP4 and GP5 are shorted to each other or to 3.3 V"


@forked
def test_a_watchdog_that_does_not_bite_is_told(rig: Rig) -> None:
    rig.start()
    first, *rest = loss.watchdog(rig.context)
    assert (first.verdict, first.measured) == (Verdict.FAILED, "no reset within 1.5 s")
    assert [result.verdict for result in rest] == [Verdict.SKIPPED] * 2
