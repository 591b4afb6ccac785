"""Honeywell HMC5883L and HMC5983 (data sheet 900405): single measurements, 1.9 gauss."""

try:
    from micropython import const
except ImportError:
    from ghst._host import const

from firmware.sensors.i2c_sensor import FAILED, NEW, NOTHING, OVERFLOW, STARTED
from firmware.sensors.words import signed_words
from ghst.schedule import ticks_diff

_CONFIGURATION_A = const(0x00)
_CONFIGURATION_B = const(0x01)
_MODE = const(0x02)
_DATA = const(0x03)
_ID = const(0x0A)

_AVERAGE_8_AT_75_HZ = const(3 << 5 | 6 << 2)
_GAIN_820 = const(2 << 5)
_SINGLE = const(0x01)
_MEASURING_MS = const(20)
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
        self._started_ms = 0
        self._started = False
        self._expected = bytearray((_AVERAGE_8_AT_75_HZ, _GAIN_820))
        self._settings = bytearray(2)
        self._data = bytearray(6)

    def identify(self):
        return self._bus.read(self.address, _ID, self._id) and self._id == b"H43"

    def start(self, step):
        self._started = False
        if step:
            return STARTED
        # The first measurement still has the old gain.
        done = (
            self._bus.write(self.address, _CONFIGURATION_A, _AVERAGE_8_AT_75_HZ)
            and self._bus.write(self.address, _CONFIGURATION_B, _GAIN_820)
            and self._bus.write(self.address, _MODE, _SINGLE)
        )
        return _MEASURING_MS if done else FAILED

    def read(self, now_ms):
        # It takes 250 us to write a measurement, and reading locks the registers even in the
        # middle of that: they would stay of two measurements, and read the same twice. So it
        # measures only when it is told to, and has long finished when it is read.
        if not self._started:
            return self._measure(now_ms, NOTHING)
        if ticks_diff(now_ms, self._started_ms) < _MEASURING_MS:
            return NOTHING
        settings = self._settings
        if (
            not self._bus.read(self.address, _CONFIGURATION_A, settings)
            or settings != self._expected
            or not self._bus.read(self.address, _DATA, self._data)
        ):
            self._started = False
            return FAILED
        self.taken_ms = self._started_ms
        return self._measure(now_ms, NEW)

    def _measure(self, now_ms, found):
        """Begins a measurement; returns `found`, or FAILED if the chip does not answer."""
        self._started_ms = now_ms
        self._started = self._bus.write(self.address, _MODE, _SINGLE)
        return found if self._started else FAILED

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
