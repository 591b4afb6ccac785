"""ST LPS22HB and LPS22HH (data sheets DocID027083, DocID030890): 50 pressures a second."""

try:
    from micropython import const
except ImportError:
    from ghst._host import const

from firmware.sensors.i2c_sensor import FAILED, NEW, NOTHING, STARTED

_ID = const(0x0F)
_CTRL_REG1 = const(0x10)
_CTRL_REG2 = const(0x11)
_STATUS = const(0x27)
_PRESSURE = const(0x28)
_TEMPERATURE = const(0x2B)

_ID_LPS22HB = const(0xB1)
_ID_LPS22HH = const(0xB3)
_RESET = const(0x14)  # and the register address increments
_RESET_MS = const(5)
# 50 Hz, low-pass at a ninth of it, no new low byte between two reads.
_RUN = const(4 << 4 | 1 << 3 | 1 << 1)
_INCREMENT = const(0x10)
_LOW_NOISE = const(0x02)  # LPS22HH only
_PRESSURE_READY = const(0x01)
_TEMPERATURE_EVERY = const(25)


class Lps22h:
    """One LPS22HB or LPS22HH; see `firmware.sensors.i2c_sensor` for what a driver has.

    `pressure_16`: pressure in sixteenths of a pascal; `temperature_decicelsius`.
    """

    PERIOD_MS = 18

    def __init__(self, bus):
        self.NAME = "LPS22HB"
        self.address = 0
        self.pressure_16 = 0
        self.temperature_decicelsius = 0
        self.raw = 0
        self.taken_ms = 0
        self._bus = bus
        self._one = bytearray(1)
        self._settings = bytearray(2)
        self._mode = _INCREMENT
        self._data = bytearray(3)
        self._warmth = bytearray(2)
        self._until_temperature = 0

    def identify(self):
        if not self._bus.read(self.address, _ID, self._one):
            return False
        new = self._one[0] == _ID_LPS22HH
        self.NAME = "LPS22HH" if new else "LPS22HB"
        self._mode = _INCREMENT | _LOW_NOISE if new else _INCREMENT
        return new or self._one[0] == _ID_LPS22HB

    def start(self, step):
        if step == 0:
            return _RESET_MS if self._bus.write(self.address, _CTRL_REG2, _RESET) else FAILED
        self._until_temperature = 0
        # The mode first: low noise can only be chosen while the chip is powered down.
        done = self._bus.write(self.address, _CTRL_REG2, self._mode) and self._bus.write(
            self.address, _CTRL_REG1, _RUN
        )
        return STARTED if done else FAILED

    def read(self, now_ms):
        one = self._one
        if not self._bus.read(self.address, _STATUS, one):
            return FAILED
        if not one[0] & _PRESSURE_READY:
            return NOTHING
        settings = self._settings
        if not self._bus.read(self.address, _CTRL_REG1, settings):
            return FAILED
        if settings[0] != _RUN or settings[1] != self._mode:
            return FAILED
        if self._until_temperature == 0:
            self._until_temperature = _TEMPERATURE_EVERY
            warmth = self._warmth
            if not self._bus.read(self.address, _TEMPERATURE, warmth):
                return FAILED
            hundredths = warmth[0] | warmth[1] << 8
            if hundredths >= 0x8000:
                hundredths -= 0x10000
            self.temperature_decicelsius = (hundredths + 5) // 10
        self._until_temperature -= 1
        # Its highest byte has to be the last one that is read of a pressure (register 0x10, BDU).
        if not self._bus.read(self.address, _PRESSURE, self._data):
            return FAILED
        self.taken_ms = now_ms
        return NEW

    def convert(self):
        data = self._data
        self.raw = data[0] | data[1] << 8 | data[2] << 16
        self.pressure_16 = pressure_16(self.raw)
        return NEW


def pressure_16(raw):
    """Returns the pressure in sixteenths of a pascal; 0 when it cannot be.

    `raw`: 24 bits, two's complement, 4096 to the hectopascal.
    """
    if raw >= 0x800000:
        return 0
    return (raw * 25 + 32) >> 6
