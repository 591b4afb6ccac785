"""Bosch BMP280 and BME280 (data sheet BST-BMP280-DS001): one measurement after the other.

Forced mode: each measurement is started by the driver, so that none is read twice and its time is
known. The IIR filter stays off, the vario has its own.
"""

import struct

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython

from firmware.sensors.arithmetic import divide, multiply
from firmware.sensors.i2c_sensor import FAILED, NEW, NOTHING, STARTED

_CALIBRATION = const(0x88)
_ID = const(0xD0)
_RESET = const(0xE0)
_STATUS = const(0xF3)
_CTRL_MEAS = const(0xF4)
_CONFIG = const(0xF5)
_DATA = const(0xF7)

_ID_BMP280 = const(0x58)
_ID_BME280 = const(0x60)
_RESET_WORD = const(0xB6)
_RESET_MS = const(5)  # 2 ms by the data sheet
_MEASURING = const(0x08)
_MODE = const(0x03)
_FORCED = const(0x01)
# Pressure eight times, temperature once: 19.5 ms, 22.5 ms at most (section 3.8.1).
_OVERSAMPLING = const(1 << 5 | 4 << 2)
_SKIPPED = const(0x80000)


class Bmp280:
    """One BMP280 or BME280; see `firmware.sensors.i2c_sensor` for what a driver has.

    `pressure_16`: pressure in sixteenths of a pascal; `temperature_decicelsius`.
    """

    PERIOD_MS = 20

    def __init__(self, bus):
        self.NAME = "BMP280"
        self.address = 0
        self.pressure_16 = 0
        self.temperature_decicelsius = 0
        self.raw = 0
        self.taken_ms = 0
        self.calibration = ()
        self._bus = bus
        self._one = bytearray(1)
        self._settings = bytearray(3)
        self._data = bytearray(6)
        self._halves = (bytearray(12), bytearray(12))
        self._started = False
        self._started_ms = 0

    def identify(self):
        if not self._bus.read(self.address, _ID, self._one):
            return False
        self.NAME = "BME280" if self._one[0] == _ID_BME280 else "BMP280"
        return self._one[0] in (_ID_BMP280, _ID_BME280)

    def start(self, step):
        self._started = False
        if step == 0:
            done = self._bus.write(self.address, _RESET, _RESET_WORD)
            return _RESET_MS if done else FAILED
        if step < 3:
            done = self._bus.read(
                self.address, _CALIBRATION + 12 * (step - 1), self._halves[step - 1]
            )
            return 1 if done else FAILED
        self.calibration = struct.unpack("<HhhHhhhhhhhh", self._halves[0] + self._halves[1])
        return STARTED if self._bus.write(self.address, _CONFIG, 0) else FAILED

    def read(self, now_ms):
        if not self._started:
            self._started_ms = now_ms
            self._started = self._bus.write(self.address, _CTRL_MEAS, _OVERSAMPLING | _FORCED)
            return NOTHING if self._started else FAILED
        settings = self._settings
        if not self._bus.read(self.address, _STATUS, settings):
            return FAILED
        if settings[1] & ~_MODE != _OVERSAMPLING or settings[2]:
            self._started = False
            return FAILED
        if settings[0] & _MEASURING or settings[1] & _MODE:
            return NOTHING
        if not self._bus.read(self.address, _DATA, self._data):
            return FAILED
        self.taken_ms = self._started_ms
        self._started_ms = now_ms
        self._started = self._bus.write(self.address, _CTRL_MEAS, _OVERSAMPLING | _FORCED)
        return NEW

    def convert(self):
        data = self._data
        pressure = data[0] << 12 | data[1] << 4 | data[2] >> 4
        temperature = data[3] << 12 | data[4] << 4 | data[5] >> 4
        if pressure == _SKIPPED or temperature == _SKIPPED:
            return FAILED
        self.raw = pressure ^ temperature << 9
        t_fine = fine_temperature(self.calibration, temperature)
        self.temperature_decicelsius = (t_fine + 256) // 512
        self.pressure_16 = pressure_16(self.calibration, pressure, t_fine)
        return NEW


@micropython.native
def fine_temperature(calibration, raw):
    """Returns the temperature in 1/5120 degree Celsius (t_fine in section 8.1).

    `calibration`: T1..T3 and P1..P9 as numbers; `raw`: 20 bits.
    """
    # All bits of `raw`: those that the data sheet's integer formula drops are worth 0.5 Pa.
    difference = raw - (calibration[0] << 4)
    square = multiply(difference, difference, 14)
    return multiply(difference, calibration[1], 14) + multiply(square, calibration[2], 20)


@micropython.native
def pressure_16(calibration, raw, t_fine):
    """Returns the pressure in sixteenths of a pascal; 0 when it cannot be.

    The floating point formula of section 8.1 in fixed point: within 0.1 Pa of it. `calibration`
    and `raw` as for `fine_temperature`.
    """
    _, _, _, p1, p2, p3, p4, p5, p6, p7, p8, p9 = calibration
    # t is the formula's var1 doubled, in one place for all what follows.
    t = t_fine - 128_000
    if not -400_000 <= t <= 400_000:
        return 0
    square = multiply(t, t, 8)
    # Offset of the raw value, with 6 binary places.
    offset = multiply(square, p6, 17) + multiply(t, p5, 8) + (p4 << 10)
    raw_6 = ((1_048_576 - raw) << 6) - offset
    # Sensitivity: P1 with 13 binary places, times 1 + a small number with 30.
    small = multiply(square, p3, 17) + multiply(p2, t, 5)
    sensitivity = (p1 << 13) + multiply(p1 << 13, small, 30)
    if sensitivity <= 6250 << 13:
        return 0
    pressure_6 = multiply(raw_6, divide(6250 << 13, sensitivity, 30), 30)
    if not 0 < pressure_6 < 130_000 << 6:
        return 0
    square = multiply(pressure_6, pressure_6, 16)
    curvature = multiply(square, p9, 25) + multiply(pressure_6, p8, 19) + (p7 << 2)
    return (pressure_6 + curvature + 2) >> 2
