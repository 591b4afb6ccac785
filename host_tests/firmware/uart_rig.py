"""A Pico with the Ghost wire on a UART: GP20 and GP21, TX and RX of UART 1, tied together."""

from __future__ import annotations

from pathlib import Path

from rig import Pico

import ghst
from ghst import decoder
from ghst_tools import boards
from ghst_tools.emulator import GhostReceiver, Wire

BYTE_NS = 10e9 / 420_000
OUR_FRAME_US = 140e6 / 414_687  # 48 MHz / 16 / (7 + 15/64)
STICKS = ghst.encode.channels(0x30, (48, 4048, 1048, 3048), (3, 253, 64, 192))
PULSES = [4000, 8000, 5000, 7000, 4000, 8000, 4976, 7024]
MSP_REQUEST = bytes.fromhex("820c213000010100000000000078")
# From the last stop bit to the last compare register: 75 us of idle line, the UART's interrupt and
# MicroPython's, the frame interrupt.
LATENCY_US = 175.0
UART1, WATCHDOG, NVIC_DISABLE = 0x40038000, 0x40058000, 0xE000E180

# A telemetry frame waits as soon as the last one is gone; no two are the same. What the main loop
# does beside is chosen from outside.
SETUP = """
import array, gc, machine
from ghst import telemetry
frame = bytearray(14)
number = 0
chosen = array.array("I", [0])
def refill():
    global number
    if adapter.control.slot_free:
        telemetry.pack_status(frame, number * 10, 0, 0, True)
        number = (number + 1) & 0xFFFF
        adapter.control.send(frame)
def idle():
    time.sleep_ms(1)
def printing():
    print("x" * 400)
def masked():
    state = machine.disable_irq()
    start = time.ticks_us()
    while time.ticks_diff(time.ticks_us(), start) < 100:
        pass
    machine.enable_irq(state)
loads = (idle, gc.collect, printing, masked)
print("chosen", uctypes.addressof(chosen))
"""
LOOP = "adapter.poll(); refill(); loads[chosen[0]]()"


class UartPico(Pico):
    """A Pico with the Ghost wire on RX of UART 1."""

    wire_pin = 21

    def _connect_wire(self) -> Wire:
        self.pins = self.board.uart(1).connect(self.board.pin(20), self.board.pin(21))
        return super()._connect_wire()

    def load(self, number: int) -> None:
        """Give the main loop something else to do."""
        words = self.board.console.output.split()
        self.board.write32(int(words[words.index(b"chosen") + 1]), number)


def new_pico(image: Path, files: dict[str, bytes]) -> UartPico:
    return UartPico(image, files, boards.load("rpi_pico").filesystem_size)


def link_data(rf_mode: int, telemetry: bool = False) -> bytes:
    """A frame that names the RF mode."""
    return bytes(ghst.encode.link_data(0x13, (1984,) * 4, rf_mode=rf_mode, telemetry=telemetry))


RACE = link_data(6)


def fly(
    pico: UartPico, rate_hz: float, count: int, link: bytes = RACE, baud: float = 420_000
) -> GhostReceiver:
    """Send `count` frames, each fourth of them `link`, and wait for the last slot."""
    receiver = GhostReceiver(
        pico.wire,
        lambda index, t: None if index >= count else STICKS if index % 4 else link,
        rate_hz,
        baud,
    )
    receiver.start(pico.at(1e6))
    pico.board.run_for(1e6 + count * 1e9 / rate_hz + 2e6)
    receiver.stop()
    return receiver


def slots_us(receiver: GhostReceiver) -> list[float]:
    """When each telemetry frame began, from the last stop bit before it."""
    assert all(frame.after_ns is not None for frame in receiver.downlink)
    return [(frame.after_ns or 0.0) / 1e3 for frame in receiver.downlink]


def check_flight(pico: UartPico, receiver: GhostReceiver, count: int) -> None:
    """Every frame decoded and soon, no collision, at most one telemetry frame a slot, on time."""
    assert len(receiver.sent) == pico.word(decoder.FRAMES) == count
    counters = (decoder.FOREIGN_FRAMES, decoder.SKIPPED_BYTES, decoder.CRC_ERRORS)
    assert [pico.word(counter) for counter in counters] == [0, 0, 0]
    assert pico.wire.contention == []
    assert receiver.noise == []
    assert pico.control("TELEMETRY_FRAMES") == len(receiver.downlink)
    assert pico.control("COLLISIONS") == 0
    times = slots_us(receiver)
    assert min(times) >= 1000.0 and max(times) <= 1300.0
    assert all(frame.ok for frame in receiver.downlink)
    ends = [end for end, _ in receiver.sent]
    slots = [max(end for end in ends if end < frame.t_ns) for frame in receiver.downlink]
    assert len(set(slots)) == len(slots)
    # Each frame once, in order, none made up.
    numbers = [ghst.downlink.decode(frame.frame).voltage_mv // 10 for frame in receiver.downlink]
    assert numbers == list(range(len(numbers)))
