"""An I2C bus in emulated time without a chip: sensors of the firmware meet emulated targets."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from firmware.sensors.barometer import Barometer
from firmware.sensors.magnetometer import Magnetometer

from ghst_tools.emulator import i2c_barometers, i2c_bmp280, i2c_hmc5883l, i2c_magnetometers
from ghst_tools.emulator.i2c_sensors import RegisterTarget, field_at, pressure_at

BYTE_NS = 22_500.0  # nine clocks at 400 kHz
WRAP = 1 << 30  # of the milliseconds that a board counts


class SimulatedI2c:
    """Has what `firmware.sensors.i2c_bus.I2cBus` has, and a clock, which its transfers move.

    `fails(number)` tells of each transfer, counted from 0, whether nobody answers it.
    """

    def __init__(self, start_ms: int = 0) -> None:
        self.now_ns = 0.0
        self.targets: dict[int, RegisterTarget] = {}
        self.fails: Callable[[int], bool] = lambda number: False
        self.transfers = 0
        self.blocked = False
        self._start_ms = start_ms

    @property
    def now_ms(self) -> int:
        """What `time.ticks_ms()` gives on a board."""
        return (self._start_ms + int(self.now_ns / 1e6)) % WRAP

    def ready(self, now_ms: int) -> bool:
        return not self.blocked

    def _begin(self, address: int, read: bool) -> RegisterTarget | None:
        number, self.transfers = self.transfers, self.transfers + 1
        self.now_ns += BYTE_NS
        target = self.targets.get(address)
        if target is None or self.fails(number) or not target.start(read):
            return None
        return target

    def _send(self, target: RegisterTarget, *values: int) -> bool:
        for value in values:
            self.now_ns += BYTE_NS
            if not target.write(value):
                return False
        return True

    def read(self, address: int, register: int, buffer: Any) -> bool:
        assert 1 <= len(buffer) <= 12, "a read longer than the time-out allows"
        target = self._begin(address, False)
        if target is None or not self._send(target, register) or not target.start(True):
            return False
        for place in range(len(buffer)):
            self.now_ns += BYTE_NS
            buffer[place] = target.read()
        target.stop()
        return True

    def write(self, address: int, register: int, value: int) -> bool:
        target = self._begin(address, False)
        if target is None:
            return False
        done = self._send(target, register, value)
        target.stop()
        return done

    def run(
        self,
        sensor: Any,
        seconds: float,
        period_ms: float = 5.0,
        watch: Callable[[], None] | None = None,
    ) -> int:
        """Call `sensor.update` every `period_ms`; return how often there were new values.

        `watch()` is called behind each update.
        """
        end_ns = self.now_ns + seconds * 1e9
        found = 0
        while self.now_ns < end_ns:
            due_ns = self.now_ns + period_ms * 1e6
            before = self.transfers
            found += sensor.update(self.now_ms)
            assert self.transfers - before <= 12, "too many transfers for one step"
            if watch is not None:
                watch()
            self.now_ns = max(self.now_ns, due_ns)
        return found


BAROMETERS = {
    "BMP280": (i2c_bmp280.Bmp280, (0x76, 0x77)),
    "BME280": (i2c_bmp280.Bme280, (0x76, 0x77)),
    "DPS310": (i2c_barometers.Dps310, (0x77, 0x76)),
    "LPS22HB": (i2c_barometers.Lps22hb, (0x5C, 0x5D)),
    "LPS22HH": (i2c_barometers.Lps22hh, (0x5C, 0x5D)),
}
MAGNETOMETERS = {
    "QMC5883L": (i2c_magnetometers.Qmc5883l, (0x0D,)),
    "HMC5883L": (i2c_hmc5883l.Hmc5883l, (0x1E,)),
    "LIS3MDL": (i2c_magnetometers.Lis3mdl, (0x1C, 0x1E)),
}
PLACES = [
    (name, address)
    for chips in (BAROMETERS, MAGNETOMETERS)
    for name, (_, addresses) in chips.items()
    for address in addresses
]
CHIPS = [*BAROMETERS, *MAGNETOMETERS]


class Bench:
    """A bus, a chip on it, and the sensor that shall find it."""

    def __init__(self, name: str, address: int | None = None, start_ms: int = 0) -> None:
        self.bus = SimulatedI2c(start_ms)
        self.altitude_m = 123.0
        self.temperature_c = 18.7
        self.heading_deg = 200.0
        self.chip: RegisterTarget
        self.sensor: Any
        if name in BAROMETERS:
            barometer, addresses = BAROMETERS[name]
            self.chip = barometer(
                self.bus,
                lambda t_ns: pressure_at(self.altitude_m),
                lambda t_ns: self.temperature_c,
            )
            self.sensor = Barometer(self.bus)
        else:
            magnetometer, addresses = MAGNETOMETERS[name]
            self.chip = magnetometer(self.bus, lambda t_ns: field_at(self.heading_deg))
            self.chip.noise_nt = 150.0
            self.sensor = Magnetometer(self.bus)
        self.address = addresses[0] if address is None else address
        self.bus.targets[self.address] = self.chip
        self.bus.now_ns += 50e6  # the board boots longer than the chip

    def run(self, seconds: float, **options: Any) -> int:
        return self.bus.run(self.sensor, seconds, **options)

    @property
    def value(self) -> int | None:
        sensor = self.sensor
        return sensor.pressure_pa if isinstance(sensor, Barometer) else sensor.heading_decideg

    def right(self) -> bool:
        """Whether the sensor has the right value."""
        if self.value is None or self.sensor.chip != self.chip.NAME:
            return False
        if isinstance(self.sensor, Barometer):
            return abs(self.value - pressure_at(self.altitude_m)) < 6
        difference = (self.value - 10 * self.heading_deg + 1800) % 3600 - 1800
        return bool(abs(difference) < 30)
