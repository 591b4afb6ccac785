"""QST QMC5883L (data sheet 1.0): 50 measurements a second, 8 gauss full scale."""

try:
    from micropython import const
except ImportError:
    from ghst._host import const

from firmware.sensors.i2c_sensor import FAILED, NEW, NOTHING, OVERFLOW, STARTED, read_whole
from firmware.sensors.words import signed_words

_DATA = const(0x00)
_STATUS = const(0x06)
_CONTROL_1 = const(0x09)
_CONTROL_2 = const(0x0A)
_SET_RESET_PERIOD = const(0x0B)
_ID = const(0x0D)

_CHIP = const(0xFF)
_READY = const(0x01)
_OVERFLOW = const(0x02)
_SOFT_RESET = const(0x80)
_RESET_MS = const(5)
_RECOMMENDED_PERIOD = const(0x01)
# 512 samples each, 8 gauss, 50 Hz, continuous.
_RUN = const(0 << 6 | 1 << 4 | 1 << 2 | 1)


class Qmc5883l:
    """One QMC5883L; see `firmware.sensors.i2c_sensor` for what a driver has.

    `words`: x, y, z as measured; `nanotesla(word)`: the field they mean.
    """

    NAME = "QMC5883L"
    PERIOD_MS = 40

    def __init__(self, bus):
        self.address = 0
        self.raw = 0
        self.taken_ms = 0
        self.words = [0, 0, 0]
        self._bus = bus
        self._one = bytearray(1)
        self._settings = bytearray(4)
        self._data = bytearray(6)
        self._again = bytearray(6)

    def identify(self):
        # 0xFF is also what a bus without a target reads, but then nobody acknowledges.
        return self._bus.read(self.address, _ID, self._one) and self._one[0] == _CHIP

    def start(self, step):
        if step == 0:
            done = self._bus.write(self.address, _CONTROL_2, _SOFT_RESET)
            return _RESET_MS if done else FAILED
        done = self._bus.write(
            self.address, _SET_RESET_PERIOD, _RECOMMENDED_PERIOD
        ) and self._bus.write(self.address, _CONTROL_1, _RUN)
        return STARTED if done else FAILED

    def read(self, now_ms):
        # Status, two bytes of temperature, and the register that a reset would have cleared.
        settings = self._settings
        if not self._bus.read(self.address, _STATUS, settings) or settings[3] != _RUN:
            return FAILED
        if not settings[0] & _READY:
            return NOTHING
        # A new measurement replaces the data at any time ("Output Data Register"): the bytes of a
        # word may be of two, and then the heading is wrong by tens of degrees.
        found = read_whole(self._bus, self.address, _DATA, self._data, self._again)
        self.taken_ms = now_ms
        return found

    def convert(self):
        self.raw = signed_words(self._data, self.words, True)
        return OVERFLOW if self._settings[0] & _OVERFLOW else NEW

    def nanotesla(self, word):
        """Returns the field that `word` means: 3000 to the gauss."""
        return word * 100 // 3
