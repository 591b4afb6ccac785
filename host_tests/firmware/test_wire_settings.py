"""Baud rate and inversion of the Ghost wire, from `ghst.json` to the bits on it."""

from __future__ import annotations

from pathlib import Path

import pytest
from rig import NO_SENSORS, PERIOD_NS, SERVOS, Pico
from uart_rig import UartPico

import ghst
from ghst_tools import boards
from ghst_tools.campaign.pico import TALKING, TALKING_SETUP
from ghst_tools.emulator import GhostReceiver, Wire
from ghst_tools.uart_bits import decode

# Link data of Race asks for telemetry.
STICKS = (48, 4048, 1048, 3048)
FRAMES = (
    ghst.encode.link_data(0x33, STICKS, rf_mode=6),
    ghst.encode.channels(0x30, STICKS, (3, 253, 64, 192)),
)
WIDTHS_US = [1000, 2000, 1250, 1750, 1000, 2000, 1244, 1756]


class InvertedPico(Pico):
    """A Pico behind an inverter."""

    def _connect_wire(self) -> Wire:
        return Wire(self.board, self.wire_pin, inverted=True)


def follow(pico: Pico, baud: float, wait_ns: float = 80e6) -> GhostReceiver:
    """Fly at 500 Hz until the pulses have come, and look at them."""
    receiver = GhostReceiver(pico.wire, lambda index, t_ns: FRAMES[index & 1], 500, baud)
    receiver.start(pico.at(1e6))
    pico.board.run_for(wait_ns)
    found = [round(pico.meter.last(pin).width_ns / 1000) for pin in SERVOS]
    assert found == WIDTHS_US
    assert receiver.noise == []
    assert pico.wire.contention == []
    return receiver


@pytest.mark.parametrize("baud", [350_000, 500_000])
def test_the_baud_rate_is_that_of_both_directions(pico: Pico, baud: int) -> None:
    pico.run(TALKING, options=f"baud_rate={baud}", setup=TALKING_SETUP)
    receiver = follow(pico, baud)
    assert pico.word(ghst.decoder.SKIPPED_BYTES) == 0
    assert len(receiver.downlink) == pico.control("TELEMETRY_FRAMES") >= 20
    assert pico.control("COLLISIONS") == 0
    assert all(frame.ok for frame in receiver.downlink)
    slots = [frame.after_ns or 0 for frame in receiver.downlink]
    assert 990e3 <= min(slots) <= max(slots) <= 1010e3
    # Its rate, by the edges: the last byte of a frame begins 130 bits behind the first.
    frame = receiver.downlink[-1]
    edges = [
        (edge.t_ns, edge.level)
        for edge in pico.wire.edges
        if edge.who == "device" and frame.t_ns <= edge.t_ns < frame.t_ns + 140e9 / baud
    ]
    times = [byte.t_ns for byte in decode(edges, baud, pico.board.now_ns)]
    assert times[13] - times[0] == pytest.approx(130e9 / baud, rel=1e-3)
    # Frames that come at either end of what is received.
    receiver.stop()
    for factor in (0.955, 1.02):
        before = pico.word(ghst.decoder.FRAMES)
        late = GhostReceiver(pico.wire, lambda index, t_ns: FRAMES[1], 250, baud * factor)
        late.start(pico.at(2e6))
        pico.board.run_for(22e6 - 1e5)
        late.stop()
        pico.board.run_for(2e6)
        assert pico.word(ghst.decoder.FRAMES) - before == len(late.sent) == 5


def test_an_inverted_line(micropython_image: Path, firmware_files: dict[str, bytes]) -> None:
    size = boards.load("rpi_pico").filesystem_size
    pico = InvertedPico(micropython_image, firmware_files, size)
    battery = {"battery": {"enabled": True}}
    pico.boot(NO_SENSORS | battery | {"wire": {"inverted": True}})
    assert pico.wire.level
    # A battery that gives no voltage is not there.
    pico.board.adc(0).set_volts(1.5)
    receiver = follow(pico, 420_000, 400e6)
    packs = receiver.downlink
    assert len(packs) >= 2
    assert {frame.frame[:3] for frame in packs} == {bytes([0x89, 12, 0x23])}
    assert all(frame.ok and ghst.crc8(frame.frame, 2, 14) == 0 for frame in packs)
    assert all(990e3 <= (frame.after_ns or 0) <= 1010e3 for frame in packs)
    assert "0 collisions" in pico.reply_to_enter()
    receiver.stop()
    pico.board.run_for(700e6)
    assert pico.no_pulses_since(pico.at(-PERIOD_NS))
    # Ctrl-C gives the pin back: nobody drives the line, and it is idle.
    pico.board.console.write(b"\x03")
    pico.board.run_until(lambda: pico.board.console.output.endswith(b">>> "))
    assert pico.wire.pin.device is None
    assert pico.wire.level


def test_a_uart_at_another_baud_rate(
    micropython_image: Path, firmware_files: dict[str, bytes]
) -> None:
    pico = UartPico(micropython_image, firmware_files, boards.load("rpi_pico").filesystem_size)
    pico.run(TALKING, options='wire="uart", baud_rate=350_000', setup=TALKING_SETUP)
    receiver = follow(pico, 350_000)
    assert len(receiver.downlink) == pico.control("TELEMETRY_FRAMES") >= 20
    assert pico.control("COLLISIONS") == 0
    assert all(frame.ok for frame in receiver.downlink)
