"""`Barometer`: pressure, altitude above the start, and vario, from the chip that is on the bus.

Any of BMP280, BME280, DPS310, LPS22HB, LPS22HH. A chip that is missing or vanishes is searched
for after 100 ms, 200 ms and so on up to 5 s; the altitude of the start is kept meanwhile.
"""

from ghst.schedule import ticks_diff

try:
    from micropython import const
except ImportError:
    from ghst._host import const

from firmware.sensors.atmosphere import MAXIMUM_PRESSURE_16, MINIMUM_PRESSURE_16
from firmware.sensors.i2c_sensor import I2cSensor

_CHIPS = (
    ((0x76, 0x77), 0xD0, (0x58, 0x60), "bmp280", "Bmp280"),
    ((0x77, 0x76), 0x0D, (0x10,), "dps310", "Dps310"),
    ((0x5D, 0x5C), 0x0F, (0xB1, 0xB3), "lps22h", "Lps22h"),
)

_ZERO_MS = const(1000)
_ZERO_READINGS = const(10)


class Barometer(I2cSensor):
    """A barometer on an `I2cBus`; 25 to 40 values a second.

    `pressure_pa`, `temperature_decicelsius`: as measured. `altitude_cm`: filtered, above the mean
    of the first second, by the standard atmosphere; `vario_cm_s`: up positive. None before they
    are known, and a second after the last measurement.
    """

    def __init__(self, bus, *, address=None):
        """`address`: 0x76, 0x77, 0x5C or 0x5D, or None to search at all of them."""
        super().__init__(bus, _CHIPS, address)
        self._filter = None
        self._taken_ms = 0
        self._start_mm = None
        self._first_mm = 0
        self._since_ms = 0
        self._sum_mm = 0
        self._readings = 0
        self._forget()

    def _forget(self):
        self.pressure_pa = None
        self.temperature_decicelsius = None
        self.altitude_cm = None
        self.vario_cm_s = None

    def _load(self):
        from firmware.sensors.atmosphere import altitude_mm
        from firmware.sensors.vario import AltitudeFilter

        self._height_mm = altitude_mm
        self._filter = self._filter or AltitudeFilter()

    def _started(self):
        self._filter.reset()
        self._readings = 0

    def _measured(self):
        chip = self._chip
        pressure_16 = chip.pressure_16
        if not MINIMUM_PRESSURE_16 <= pressure_16 <= MAXIMUM_PRESSURE_16:
            return False
        height_mm = self._height_mm(pressure_16)
        if not self._filter.update(height_mm, ticks_diff(chip.taken_ms, self._taken_ms)):
            return False
        if self._start_mm is None:
            self._find_start(height_mm)
        self._taken_ms = chip.taken_ms
        self.pressure_pa = (pressure_16 + 8) >> 4
        self.temperature_decicelsius = chip.temperature_decicelsius
        if self._start_mm is not None:
            self.altitude_cm = (self._filter.altitude_mm - self._start_mm + 5) // 10
            self.vario_cm_s = (self._filter.speed_mm_s + 5) // 10
        return True

    def _find_start(self, height_mm):
        if self._readings == 0:
            self._first_mm = height_mm
            self._sum_mm = 0
            self._since_ms = self._chip.taken_ms
        self._sum_mm += height_mm - self._first_mm
        self._readings += 1
        if (
            self._readings >= _ZERO_READINGS
            and ticks_diff(self._chip.taken_ms, self._since_ms) >= _ZERO_MS
        ):
            self._start_mm = self._first_mm + self._sum_mm // self._readings

    def describe(self):
        """Returns a line such as "BMP280: 12.3 m, -0.4 m/s, 101325 Pa"."""
        name = self.chip
        if name is None:
            return "no barometer answers"
        if self.pressure_pa is None:
            return f"{name}: no values"
        if self.altitude_cm is None:
            return f"{name}: {self.pressure_pa} Pa, finding its zero"
        return (
            f"{name}: {self.altitude_cm / 100:.1f} m, {self.vario_cm_s / 100:+.1f} m/s, "
            f"{self.pressure_pa} Pa"
        )
