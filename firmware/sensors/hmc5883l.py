"""Honeywell HMC5883L and HMC5983 (data sheet 900405): 75 measurements a second, 1.9 gauss."""

try:
    from micropython import const
except ImportError:
    from ghst._host import const

from firmware.sensors.i2c_sensor import FAILED, NEW, OVERFLOW, STARTED
from firmware.sensors.words import signed_words

_CONFIGURATION_A = const(0x00)
_DATA = const(0x03)
_ID = const(0x0A)

_AVERAGE_8_AT_75_HZ = const(3 << 5 | 6 << 2)
_GAIN_820 = const(2 << 5)
_CONTINUOUS = const(0x00)
_SETTLE_MS = const(50)  # the first measurement still has the old gain
_SATURATED = const(-4096)


class Hmc5883l:
    """One HMC5883L; see `firmware.sensors.i2c_sensor` for what a driver has.

    `words`: x, y, z as measured; `nanotesla(word)`: the field they mean.
    """

    NAME = "HMC5883L"
    PERIOD_MS = 40

    def __init__(self, bus):
        self.address = 0
        self.raw = 0
        self.taken_ms = 0
        self.words = [0, 0, 0]
        self._bus = bus
        self._id = bytearray(3)
        self._expected = bytearray((_AVERAGE_8_AT_75_HZ, _GAIN_820, _CONTINUOUS))
        self._settings = bytearray(3)
        self._data = bytearray(6)

    def identify(self):
        return self._bus.read(self.address, _ID, self._id) and self._id == b"H43"

    def start(self, step):
        if step:
            return STARTED
        for register in range(3):
            if not self._bus.write(
                self.address, _CONFIGURATION_A + register, self._expected[register]
            ):
                return FAILED
        return _SETTLE_MS

    def read(self, now_ms):
        # Its ready flag is low for 250 us only, so it is not waited for. All six data registers
        # have to be read, or the chip keeps them locked.
        settings = self._settings
        if (
            not self._bus.read(self.address, _CONFIGURATION_A, settings)
            or settings != self._expected
            or not self._bus.read(self.address, _DATA, self._data)
        ):
            return FAILED
        self.taken_ms = now_ms
        return NEW

    def convert(self):
        words = self.words
        self.raw = signed_words(self._data, words, False)
        words[1], words[2] = words[2], words[1]  # they come as x, z, y
        if words[0] == _SATURATED or words[1] == _SATURATED or words[2] == _SATURATED:
            return OVERFLOW
        return NEW

    def nanotesla(self, word):
        """Returns the field that `word` means: 820 to the gauss."""
        return word * 5000 // 41
