"""What emulated I2C sensors have in common: strict register files, faults, and their surroundings.

A sensor answers with what a real one would measure in surroundings that are functions of emulated
time. Software that uses it in a way its data sheet does not allow gets `SensorMisuse`, which ends
the run: reading a register that does not exist, or a measurement before there was one.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import Protocol

SEA_LEVEL_PA = 101_325.0
_EXPONENT = 287.05287 * 0.0065 / 9.80665


Scalar = Callable[[float], float]
"""A quantity as a function of emulated time in nanoseconds."""

Vector = Callable[[float], tuple[float, float, float]]
"""A field as a function of emulated time in nanoseconds: x, y, z in nanotesla."""


class Clock(Protocol):
    """Where a sensor has its time from: a `Board`."""

    @property
    def now_ns(self) -> float: ...


class SensorMisuse(AssertionError):
    """Software did what the sensor's data sheet does not allow."""


def pressure_at(altitude_m: float, sea_level_pa: float = SEA_LEVEL_PA) -> float:
    """Return the pressure in Pa of the standard atmosphere (ISO 2533), below 11 km."""
    return float(sea_level_pa * (1 - 0.0065 * altitude_m / 288.15) ** (1 / _EXPONENT))


def field_at(
    heading_deg: float,
    horizontal_nt: float = 20_000.0,
    down_nt: float = 44_000.0,
    hard_iron_nt: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> tuple[float, float, float]:
    """Return the field in nT along x (forward), y (left) and z (up) of a level sensor.

    `heading_deg`: where x points to, clockwise from magnetic north; `hard_iron_nt`: the field that
    the model carries with it.
    """
    heading = math.radians(heading_deg)
    return (
        horizontal_nt * math.cos(heading) + hard_iron_nt[0],
        horizontal_nt * math.sin(heading) + hard_iron_nt[1],
        -down_nt + hard_iron_nt[2],
    )


def solve(function: Callable[[int], float], wanted: float, low: int, high: int) -> int:
    """Return the integer in low..high whose value is nearest to `wanted`; `function` monotonic."""
    rising = function(high) > function(low)
    while high - low > 1:
        middle = (low + high) // 2
        if (function(middle) < wanted) is rising:
            low = middle
        else:
            high = middle
    return min(low, high, key=lambda raw: abs(function(raw) - wanted))


class RegisterTarget:
    """An I2C target with 8-bit registers and a pointer that counts up.

    Faults, all off at first: `plugged_in` is whether it has power and answers; while `garbage` is
    a generator every byte read comes from it, and what is written is lost; while `frozen` is True
    the measurements stay what they are.
    """

    NAME = ""
    READABLE: frozenset[int] = frozenset()
    WRITABLE: frozenset[int] = frozenset()
    # Asked for by software that looks for another chip at the same address; they read as 0.
    FOREIGN: frozenset[int] = frozenset()
    START_UP_NS = 0.0

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._random = random.Random(self.NAME)
        self.plugged_in = True
        self.garbage: random.Random | None = None
        self.frozen = False
        self.registers = bytearray(256)
        self.measurements = 0
        self._pointer: int | None = None
        self.power_up()

    # -- power ----------------------------------------------------------------------------------

    def power_up(self) -> None:
        """Put everything into the state that it has after power-on or a reset."""
        self.registers[:] = bytes(256)
        self._answers_ns = self.now_ns + self.START_UP_NS
        self.reset_registers()

    def unplug(self) -> None:
        """Take the sensor off the bus and off its power."""
        self.plugged_in = False

    def plug_in(self) -> None:
        """Give it back: as after power-on."""
        self.plugged_in = True
        self.power_up()

    @property
    def now_ns(self) -> float:
        """Emulated time."""
        return self._clock.now_ns

    def noise(self, deviation: float) -> float:
        """Return random noise; the same in every run."""
        return self._random.gauss(0.0, deviation)

    # -- the sensor's own -----------------------------------------------------------------------

    def reset_registers(self) -> None:
        """Fill `registers` with what they have after power-on; the rest is 0."""

    def read_register(self, register: int) -> int:
        """Return the value of a register that may be read."""
        return self.registers[register]

    def write_register(self, register: int, value: int) -> None:
        """Write a register that may be written."""
        self.registers[register] = value

    def next_register(self, register: int) -> int:
        """Return the register behind `register` in a transfer of several bytes."""
        return (register + 1) & 0xFF

    def misuse(self, what: str) -> SensorMisuse:
        """Return the error for `what` the software did."""
        return SensorMisuse(f"{self.NAME}, {self.now_ns / 1e6:.3f} ms: {what}")

    # -- the bus --------------------------------------------------------------------------------

    def start(self, read: bool) -> bool:
        if not self.plugged_in or (self.now_ns < self._answers_ns and self.garbage is None):
            return False
        if not read:
            self._pointer = None
        elif self._pointer is None and self.garbage is None:
            raise self.misuse("read without a register")
        return True

    def write(self, value: int) -> bool:
        if self.garbage is not None or self._pointer is None:
            self._pointer = value
            return True
        if self._pointer not in self.WRITABLE:
            raise self.misuse(f"register 0x{self._pointer:02x} cannot be written")
        self.write_register(self._pointer, value)
        self._pointer = self.next_register(self._pointer)
        return True

    def read(self) -> int:
        if self.garbage is not None:
            return self.garbage.randrange(256)
        register = self._pointer
        if register is None:
            raise self.misuse("read without a register")
        self._pointer = self.next_register(register)
        if register in self.FOREIGN:
            return 0
        if register not in self.READABLE:
            raise self.misuse(f"register 0x{register:02x} does not exist")
        return self.read_register(register)

    def stop(self) -> None:
        pass


class Barometer(RegisterTarget):
    """A chip in air of a pressure (Pa) and a temperature (degrees Celsius)."""

    NOISE_PA = 1.0

    def __init__(self, clock: Clock, pressure_pa: Scalar, temperature_c: Scalar) -> None:
        self.pressure_pa, self.temperature_c = pressure_pa, temperature_c
        self.noise_pa = self.NOISE_PA
        super().__init__(clock)

    def air(self, t_ns: float) -> tuple[float, float]:
        """Return pressure and temperature at `t_ns` as the chip feels them."""
        self.measurements += 1
        return self.pressure_pa(t_ns) + self.noise(self.noise_pa), self.temperature_c(t_ns)
