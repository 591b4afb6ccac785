"""ST LIS3MDL (data sheet DocID024204): 40 measurements a second, 4 gauss full scale."""

try:
    from micropython import const
except ImportError:
    from ghst._host import const

from firmware.sensors.i2c_sensor import FAILED, NEW, NOTHING, OVERFLOW, STARTED, read_whole
from firmware.sensors.words import signed_words

_INCREMENT = const(0x80)  # of the register's number, or the same one is read over and over
_ID = const(0x0F)
_CTRL_REG1 = const(0x20)
_CTRL_REG2 = const(0x21)
_STATUS = const(0x27)
_DATA = const(0x28)

_CHIP = const(0x3D)
_SOFT_RESET = const(0x04)
_RESET_MS = const(10)
_READY = const(0x08)
_SATURATED = const(0x7FFF)


class Lis3mdl:
    """One LIS3MDL; see `firmware.sensors.i2c_sensor` for what a driver has.

    `words`: x, y, z as measured; `nanotesla(word)`: the field they mean.
    """

    NAME = "LIS3MDL"
    PERIOD_MS = 40

    def __init__(self, bus):
        self.address = 0
        self.raw = 0
        self.taken_ms = 0
        self.words = [0, 0, 0]
        self._bus = bus
        self._one = bytearray(1)
        # 40 Hz at the best performance of x, y and z; 4 gauss; continuous. Block data update is
        # off: it holds each word back for itself, so that x could stay of one measurement and y
        # of the next for as long as it takes to read them twice.
        self._expected = bytearray((3 << 5 | 6 << 2, 0, 0, 3 << 2, 0))
        self._settings = bytearray(5)
        self._data = bytearray(6)
        self._again = bytearray(6)

    def identify(self):
        return self._bus.read(self.address, _ID, self._one) and self._one[0] == _CHIP

    def start(self, step):
        if step == 0:
            done = self._bus.write(self.address, _CTRL_REG2, _SOFT_RESET)
            return _RESET_MS if done else FAILED
        for place in range(5):
            if not self._bus.write(self.address, _CTRL_REG1 + place, self._expected[place]):
                return FAILED
        return STARTED

    def read(self, now_ms):
        one = self._one
        if not self._bus.read(self.address, _STATUS, one):
            return FAILED
        if not one[0] & _READY:
            return NOTHING
        settings = self._settings
        if (
            not self._bus.read(self.address, _CTRL_REG1 | _INCREMENT, settings)
            or settings != self._expected
        ):
            return FAILED
        self.taken_ms = now_ms
        register = _DATA | _INCREMENT
        return read_whole(self._bus, self.address, register, self._data, self._again)

    def convert(self):
        words = self.words
        self.raw = signed_words(self._data, words, True)
        for word in words:
            if not -_SATURATED <= word < _SATURATED:
                return OVERFLOW
        return NEW

    def nanotesla(self, word):
        """Returns the field that `word` means: 6842 to the gauss."""
        return word * 14_616 // 1000
