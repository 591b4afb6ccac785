"""A Pico with the firmware, a barometer and a magnetometer on one bus, for forked tests."""

from __future__ import annotations

import functools
from itertools import pairwise
from pathlib import Path

from rig import SERVOS, Pico, steps

import ghst
from ghst_tools import boards
from ghst_tools.emulator import GhostReceiver
from ghst_tools.emulator.i2c_bmp280 import Bmp280
from ghst_tools.emulator.i2c_magnetometers import Magnetometer, Qmc5883l
from ghst_tools.emulator.i2c_sensors import Barometer, RegisterTarget, field_at, pressure_at

GO, WATCH_HEAP = 22, 21
LONGEST_UPDATE_US = 2000
LONGEST_LOAD_US = 75_000  # once for each sensor, out of the file system
LATENCY_US = 40
PERIOD_NS = 20e6
# Two sticks move with each frame, the others rest.
RAW = range(1024, 3073, 64)
FRAMES = [ghst.encode.channels(0x30, (raw, 2048, 4096 - raw, 2048), (128,) * 4) for raw in RAW]
CENTRE = 6000
NONE = -(1 << 29)
NOTES = (
    *("barometer_us", "magnetometer_us", "pressures", "headings", "barometer_faults"),
    *("magnetometer_faults", "faults", "timeouts", "recoveries", "pressure_pa"),
    *("temperature_decicelsius", "altitude_cm", "vario_cm_s", "heading_decideg"),
    *("heap_bytes", "heap_watches", "load_us"),
)

# The main loop waits for a pin, so that the chips are there from the start. With another one it
# watches the heap: there is garbage, and the collector is set to run as soon as anything is
# allocated; so if the garbage is still there in the end, nothing was.
SETUP = """
import gc, sys
from array import array
from machine import Pin
from firmware.sensors.i2c_bus import I2cBus
from firmware.sensors.barometer import Barometer
from firmware.sensors.magnetometer import Magnetometer
bus = I2cBus(0, sda=4, scl=5)
barometer = Barometer(bus)
magnetometer = Magnetometer(bus)
magnetometer.start_calibration()
go = Pin(22, Pin.IN, Pin.PULL_DOWN)
watch_heap = Pin(21, Pin.IN, Pin.PULL_DOWN)
notes = array("i", [0] * 17)
def known(value):
    return -(1 << 29) if value is None else value
def update_one(sensor, place):
    modules = len(sys.modules)
    start_us = time.ticks_us()
    new = sensor.update(time.ticks_ms())
    taken_us = time.ticks_diff(time.ticks_us(), start_us)
    if len(sys.modules) != modules:
        place = 16
    notes[place] = max(notes[place], taken_us)
    return new
def update():
    notes[2] += update_one(barometer, 0)
    notes[3] += update_one(magnetometer, 1)
def write_down():
    notes[4] = barometer.faults
    notes[5] = magnetometer.faults
    notes[6] = bus.faults
    notes[7] = bus.timeouts
    notes[8] = bus.recoveries
    notes[9] = known(barometer.pressure_pa)
    notes[10] = known(barometer.temperature_decicelsius)
    notes[11] = known(barometer.altitude_cm)
    notes[12] = known(barometer.vario_cm_s)
    notes[13] = known(magnetometer.heading_decideg)
@micropython.native
def step():
    if not go.value():
        return
    if not watch_heap.value():
        update()
        write_down()
        return
    gc.collect()
    bytearray(5000)
    gc.threshold(16)
    before = gc.mem_alloc()
    for _ in range(30):
        now_ms = time.ticks_ms()
        notes[2] += barometer.update(now_ms)
        notes[3] += magnetometer.update(now_ms)
        time.sleep_ms(4)
    notes[14] = before - gc.mem_alloc()
    notes[15] += 1
    gc.threshold(-1)
print("notes", uctypes.addressof(notes))
"""
LOOP = "adapter.poll(); step(); time.sleep_ms(4)"


@functools.cache
def _boot(image: Path, compiled: tuple[tuple[str, bytes], ...]) -> Pico:
    pico = Pico(image, dict(compiled), boards.load("rpi_pico").filesystem_size)
    pico.run(LOOP, setup=SETUP)
    return pico


def grounded(image: Path, files: dict[str, bytes]) -> Flight:
    """Return a Pico that has booted and waits; the same one every time, so only for forks."""
    return Flight(_boot(image, tuple(files.items())))


class Flight:
    """Both sensors in surroundings that a test may change."""

    def __init__(self, pico: Pico) -> None:
        self.pico = pico
        self.board = pico.board
        self.bus = self.board.i2c(0)
        self.altitude_m = 120.0
        self.temperature_c = 20.0
        self.heading_deg = 123.0
        self.barometer: RegisterTarget
        self.magnetometer: RegisterTarget
        words = self.board.console.output.split()
        self._notes = int(words[words.index(b"notes") + 1])
        self.receiver: GhostReceiver

    def start(
        self,
        barometer: type[Barometer] | None = Bmp280,
        barometer_address: int = 0x76,
        magnetometer: type[Magnetometer] | None = Qmc5883l,
        magnetometer_address: int = 0x0D,
    ) -> None:
        """Put the chips on the bus and let the sensors start."""
        if barometer is not None:
            self.barometer = barometer(
                self.board, lambda t: pressure_at(self.altitude_m), lambda t: self.temperature_c
            )
            self.bus.attach(barometer_address, self.barometer)
        if magnetometer is not None:
            self.magnetometer = magnetometer(self.board, lambda t: field_at(self.heading_deg))
            self.bus.attach(magnetometer_address, self.magnetometer)
        self.bus.connect(self.board.pin(4), self.board.pin(5))
        self.wait(3)  # the chips' own start
        self.board.pin(GO).drive(True)

    def take_off(self) -> None:
        """Start with the usual chips, and with control frames at 500 Hz."""
        self.start()
        self.wait(180)
        self.receiver = self.pico.fly(lambda index, t: FRAMES[index % len(FRAMES)], 500)
        self.wait(45)
        self.start_ns = self.board.now_ns

    def note(self, name: str) -> int:
        """A number that the main loop has written down."""
        word = self.board.read32(self._notes + 4 * NOTES.index(name))
        return word - (word >> 31 << 32)

    def wait(self, ms: float) -> None:
        self.board.run_for(ms * 1e6)

    def values(self, ms: float) -> tuple[int, int]:
        """How many pressures and headings there are in the next `ms`."""
        before = self.note("pressures"), self.note("headings")
        self.wait(ms)
        return self.note("pressures") - before[0], self.note("headings") - before[1]

    def check_values(self) -> None:
        """Both sensors are right, and bring new values."""
        pressures, headings = self.values(120)
        assert pressures >= 2 and headings >= 2
        assert abs(self.note("pressure_pa") - pressure_at(self.altitude_m)) < 6
        assert abs(self.note("heading_decideg") - 10 * self.heading_deg) < 30

    def check_control(self) -> None:
        """No frame was lost, each moved the servos in time, and no step blocked for long."""
        self.receiver.stop()
        self.wait(2)
        sent = len(self.receiver.sent)
        assert sent > 75
        assert self.pico.word(ghst.decoder.FRAMES) == sent
        assert self.pico.word(ghst.decoder.CRC_ERRORS) == 0
        assert self.pico.word(ghst.decoder.SKIPPED_BYTES) == 0
        latencies = self.pico.latencies_us(self.receiver)
        assert max(latency or 1e9 for latency in latencies) < LATENCY_US
        self.check_pulses()
        assert 0 < self.note("barometer_us") < LONGEST_UPDATE_US
        assert 0 < self.note("magnetometer_us") < LONGEST_UPDATE_US
        assert LONGEST_UPDATE_US < self.note("load_us") < LONGEST_LOAD_US

    def check_heap(self) -> None:
        """Many readings of both sensors allocate nothing."""
        self.board.pin(WATCH_HEAP).drive(True)
        before = self.note("pressures"), self.note("headings"), self.note("heap_watches")
        self.board.run_until(lambda: self.note("heap_watches") > before[2], 1e9)
        self.board.pin(WATCH_HEAP).drive(None)
        assert self.note("pressures") - before[0] >= 3
        assert self.note("headings") - before[1] >= 2
        assert self.note("heap_bytes") == 0

    def check_pulses(self) -> None:
        """A whole pulse every 20 ms at each pin; those of sticks that rest are all the same."""
        resting = {312.5 * steps(CENTRE)}
        moving = {312.5 * steps(CENTRE + raw - 2048) for raw in RAW}
        for pin, channel in SERVOS.items():
            pulses = self.pico.meter.since(self.start_ns, pin)
            flown_ns = self.board.now_ns - self.start_ns
            assert len(pulses) >= flown_ns // PERIOD_NS - 1 >= 5
            gaps = [later.rise_ns - sooner.rise_ns for sooner, later in pairwise(pulses)]
            assert max(abs(gap - PERIOD_NS) for gap in gaps) < 1
            allowed = moving if channel in (1, 3) else resting
            for pulse in pulses:  # the chip's clock is 8 ns
                assert min(abs(pulse.width_ns - width_ns) for width_ns in allowed) < 8
