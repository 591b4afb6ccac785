"""The GPS on the emulated board: the real UART, control frames at 500 Hz, the time it takes."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest
from rig import Pico, steps

import ghst
from forked import forked
from ghst_tools import boards
from ghst_tools.emulator.gps import NmeaGps, UbloxGps
from ghst_tools.emulator.gps_messages import Place, nmea_epoch

LIMIT_US = 5000
LOAD_US = 150_000  # once, when the first byte comes, out of the file system
STEADY_US = 2000  # without a change of the baud rate and messages to a u-blox
LATENCY_US = 35.0
FRAME = ghst.encode.channels(0x11, (344, 3624, 1984, 2784), (22, 124, 226, 174))

SETUP = """
import machine, micropython, sys
from array import array
from firmware.sensors.gps import Gps
gps = Gps(machine.UART(0, tx=0, rx=1))
seen = array("i", bytes(48))
def step():
    if seen[1]:
        micropython.heap_lock()
    now_ms = time.ticks_ms()
    modules = len(sys.modules)
    start_us = time.ticks_us()
    gps.update(now_ms)
    took_us = time.ticks_diff(time.ticks_us(), start_us)
    if seen[1]:
        micropython.heap_unlock()
    seen[0] += 1
    place = 2 if len(sys.modules) == modules else 10
    seen[place] = max(seen[place], took_us)
    seen[3] = gps.baudrate or 0
    seen[4] = 0 if gps.protocol is None else 2 if gps.protocol == "UBX" else 1
    seen[5] = gps.updates
    seen[6] = gps.faults
    seen[7] = gps.fix
    seen[8] = gps.lat_e7 or 0
    seen[9] = gps.home_distance_m or 0
print("seen", uctypes.addressof(seen))
"""
LOOP = "step(); adapter.poll(); time.sleep_ms(4)"
NMEA, UBX = 1, 2
ROUND_MS = 4


class Seen(NamedTuple):
    """What the main loop on the board has found out."""

    rounds: int
    locked: int
    longest_us: int
    baudrate: int
    protocol: int
    updates: int
    faults: int
    fix: int
    lat_e7: int
    home_distance_m: int
    load_us: int


class Flight:
    """A booted board whose main loop reads a GPS on its UART 0."""

    def __init__(self, pico: Pico) -> None:
        self.pico = pico
        pico.run(LOOP, setup=SETUP)
        words = pico.board.console.output.split()
        self._address = int(words[words.index(b"seen") + 1])
        self.start_lat_deg = 47.0

    def path(self, t_ns: float) -> Place:
        """To the north, 11 m a second."""
        return Place(self.start_lat_deg + t_ns / 1e9 * 1e-4, 137.0, 430.0, 11.1, 0.0)

    @property
    def seen(self) -> Seen:
        return Seen(*(self.pico.board.read32(self._address + 4 * n) for n in range(11)))

    def lock_the_heap(self) -> None:
        """From now on an allocation in `update` ends the main loop."""
        self.pico.board.write32(self._address + 4, 1)

    def pass_the_time(self, ms: int) -> None:
        """Move the board's clock on, without anything in between."""
        board = self.pico.board
        board.advance_timer(ms * 1000)
        board.run_for(5e6)
        self.forget_the_longest()  # it was the one that this fell into

    def forget_the_longest(self) -> None:
        """Let `longest_us` begin anew."""
        self.pico.board.write32(self._address + 8, 0)

    def until(self, condition: Callable[[Seen], bool], limit_ns: float) -> None:
        self.pico.board.run_until(lambda: condition(self.seen), limit_ns, poll_ns=20e6)

    def nmea(self, baud: int, period_ms: int) -> NmeaGps:
        board = self.pico.board
        receiver = NmeaGps(board.uart(0), board.clock, self.path, baud=baud, period_ms=period_ms)
        receiver.start()
        return receiver

    def ublox(self, generation: int, baud: int, period_ms: int = 1000) -> UbloxGps:
        board = self.pico.board
        receiver = UbloxGps(
            board.uart(0),
            board.clock,
            self.path,
            generation=generation,
            baud=baud,
            period_ms=period_ms,
        )
        receiver.start()
        return receiver


@pytest.fixture(scope="module")
def flight(micropython_image: Path, firmware_files: dict[str, bytes]) -> Flight:
    """Booted once: each test runs in a fork of it."""
    size = boards.load("rpi_pico").filesystem_size
    return Flight(Pico(micropython_image, firmware_files, size))


@pytest.mark.parametrize(
    ("baud", "period_ms"), [(9600, 400), (38400, 200), (57600, 200), (115200, 100)]
)
@forked
def test_the_baud_rate_is_found(flight: Flight, baud: int, period_ms: int) -> None:
    flight.nmea(baud, period_ms)
    flight.until(lambda seen: seen.updates >= 2, 2.5e9)
    seen = flight.seen
    assert (seen.baudrate, seen.protocol, seen.fix, seen.faults) == (baud, NMEA, 1, 0)
    assert abs(seen.lat_e7 - 470_000_000 - flight.pico.board.now_ns / 1e9 * 1000) < 500
    assert seen.longest_us < LIMIT_US < seen.load_us < LOAD_US


@forked
def test_a_ublox_sends_ten_solutions_a_second(flight: Flight) -> None:
    receiver = flight.ublox(8, 9600, period_ms=500)
    flight.until(lambda seen: receiver.period_ms == 100 and receiver.outputs == 1, 6e9)
    flight.pico.board.run_for(550e6)  # the old period has to end
    assert (receiver.baud, flight.seen.baudrate, flight.seen.protocol) == (115200, 115200, UBX)
    flight.lock_the_heap()
    updates = flight.seen.updates
    flight.until(lambda seen: seen.updates > updates, 200e6)
    before = flight.seen
    flight.pico.board.run_for(300e6)
    seen = flight.seen
    assert seen.updates - before.updates == 3
    assert seen.rounds - before.rounds > 60
    assert (seen.fix, seen.faults) == (1, before.faults)
    assert seen.longest_us < LIMIT_US


@pytest.fixture(scope="module")
def set_up(flight: Flight) -> tuple[Flight, UbloxGps]:
    """A u-blox has been set up; nothing is forked from the first fixture after that."""
    receiver = flight.ublox(10, 115_200, period_ms=200)
    flight.until(lambda seen: receiver.period_ms == 100 and seen.updates >= 3, 3e9)
    flight.pico.board.run_for(350e6)  # its answer, and the end of the old period
    assert (receiver.outputs, flight.seen.protocol, flight.seen.fix) == (1, UBX, 1)
    return flight, receiver


def _flood(flight: Flight, receiver: UbloxGps) -> None:
    """The line is full of sentences, as many as fit on it."""
    data = b"".join(nmea_epoch(flight.path(0), 5))
    flight.pico.board.uart(0).send((data * 12)[:2900], 115_200)


def _garbage(flight: Flight, receiver: UbloxGps) -> None:
    """Noise, beginnings of frames that never end, sentences without an end."""
    receiver.stop()
    rng = random.Random(1)
    noise = bytes(rng.randrange(256) for _ in range(1000))
    parts = (noise, b"\xb5\x62\x01\x07\x78\x00" * 160, b"$GPGGA,1" * 120)
    flight.pico.board.uart(0).send(b"".join(parts), 115_200)


def _silence(flight: Flight, receiver: UbloxGps) -> None:
    """It has hung for a time: the fix ends, and then the receiver is lost."""
    receiver.stop()
    flight.pass_the_time(2900)


def _another(flight: Flight, receiver: UbloxGps) -> None:
    """Torn off in the middle of a frame; what comes back, too late, sends at another rate."""
    flight.pico.board.uart(0).send(b"\xb5\x62\x01\x07\x5c", 115_200)
    flight.pass_the_time(3000)
    receiver.baud = 57600


@pytest.mark.parametrize("happens", [_flood, _garbage, _silence, _another])
@forked
def test_no_control_frame_is_lost_and_no_pulse_changes(
    set_up: tuple[Flight, UbloxGps], happens: Callable[[Flight, UbloxGps], None]
) -> None:
    flight, receiver = set_up
    pico = flight.pico
    before = flight.seen
    flight.forget_the_longest()
    happens(flight, receiver)
    ghost = pico.fly(lambda index, t: FRAME, 500)
    pico.board.run_for(260e6)
    if happens is _another:
        flight.until(lambda seen: seen.updates > before.updates, 1e9)
    ghost.stop()
    pico.board.run_for(5e6)
    frames = len(ghost.sent)
    seen = flight.seen
    # The main loop was there all the time, and the GPS was what it was about.
    assert seen.rounds - before.rounds > frames // 5
    assert seen.longest_us < (LIMIT_US if happens is _another else STEADY_US)
    if happens is _flood:
        assert (seen.fix, seen.faults - before.faults <= 1) == (1, True)
    elif happens is _garbage:
        assert 40 < seen.faults - before.faults < 500
    elif happens is _silence:
        assert (seen.fix, seen.baudrate, seen.faults - before.faults) == (0, 0, 1)
    else:
        # The UART was set to 9600 baud in between, which takes longest.
        assert (seen.fix, seen.baudrate, seen.longest_us > 3100) == (1, 57600, True)
    # Every frame came in, and moved its servos in time to where they were before.
    assert frames >= 130
    assert pico.word(ghst.decoder.FRAMES) == frames
    assert pico.word(ghst.decoder.CRC_ERRORS) == 0
    assert pico.word(ghst.decoder.SKIPPED_BYTES) == 0
    latencies = pico.latencies_us(ghost)
    assert None not in latencies
    assert max(latencies) <= LATENCY_US, sorted(latencies)[-5:]
    assert len({(compare.slice, compare.value) for compare in pico.compares}) == 4
    for pin, channel in zip((6, 7, 8, 9), range(4), strict=True):
        widths = {pulse.width_ns for pulse in pico.meter.pulses[pin]}
        assert len(widths) == 1
        assert abs(widths.pop() - steps(pico.pulses()[channel]) * 312.5) <= 8
