"""Infineon DPS310 (data sheet V1.2): pressure 32 times a second, temperature four times."""

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython

from firmware.sensors.arithmetic import multiply
from firmware.sensors.i2c_sensor import FAILED, NEW, NOTHING, STARTED, read_whole

_DATA = const(0x00)
_PRS_CFG = const(0x06)
_TMP_CFG = const(0x07)
_MEAS_CFG = const(0x08)
_CFG_REG = const(0x09)
_RESET = const(0x0C)
_ID = const(0x0D)
_COEFFICIENTS = const(0x10)
_COEFFICIENT_SOURCE = const(0x28)

_PRODUCT = const(0x10)  # revision and product
_SOFT_RESET = const(0x09)
_RESET_MS = const(40)  # until the coefficients are there
_ASK_AGAIN_MS = const(10)
_LAST_STEP = const(12)
_READY = const(0xC0)  # coefficients and sensor
_TEMPERATURE_READY = const(0x20)
_PRESSURE_READY = const(0x10)
_CONTINUOUS = const(0x07)
_EXTERNAL = const(0x80)
# 32 Hz with 16 samples each are 883 ms of every second, 4 Hz with one sample are 14 ms.
_PRESSURE = const(5 << 4 | 4)
_TEMPERATURE = const(2 << 4)
_PRESSURE_SHIFT = const(0x04)  # with more than 8 samples

# Not in the data sheet, but in the manufacturer's own driver: some chips measure a wrong
# temperature after a reset until these registers have been written.
_TEMPERATURE_REPAIR = ((0x0E, 0xA5), (0x0F, 0x96), (0x62, 0x02), (0x0E, 0x00), (0x0F, 0x00))

# Section 4.9.3: kT of one sample is 2^19, kP of 16 samples 253952. Both raw values get 24 binary
# places; the factor has 20 itself.
_TEMPERATURE_SHIFT = const(5)
_PRESSURE_FACTOR = const(((1 << 44) + 126_976) // 253_952)
_LARGEST = const(2 << 24)


class Dps310:
    """One DPS310; see `firmware.sensors.i2c_sensor` for what a driver has.

    `pressure_16`: pressure in sixteenths of a pascal; `temperature_decicelsius`.
    """

    NAME = "DPS310"
    PERIOD_MS = 28

    def __init__(self, bus):
        self.address = 0
        self.pressure_16 = 0
        self.temperature_decicelsius = 0
        self.raw = 0
        self.taken_ms = 0
        self.coefficients = ()
        self._bus = bus
        self._one = bytearray(1)
        self._settings = bytearray(4)
        self._expected = bytearray((_PRESSURE, _TEMPERATURE, _CONTINUOUS, _PRESSURE_SHIFT))
        self._data = bytearray(6)
        self._again = bytearray(6)
        self._halves = (bytearray(9), bytearray(9))
        self._complete = False

    def identify(self):
        return self._bus.read(self.address, _ID, self._one) and self._one[0] == _PRODUCT

    def _write(self, register, value):
        return self._bus.write(self.address, register, value)

    def start(self, step):
        if step == 0:
            self._complete = False
            self.coefficients = ()
            return _RESET_MS if self._write(_RESET, _SOFT_RESET) else FAILED
        if not self.coefficients:
            return self._read_coefficients() if step < _LAST_STEP else FAILED
        for register, value in _TEMPERATURE_REPAIR:
            if not self._write(register, value):
                return FAILED
        for place in (0, 1, 3, 2):
            if not self._write(_PRS_CFG + place, self._expected[place]):
                return FAILED
        return STARTED

    def _read_coefficients(self):
        # The flags may take longer than the data sheet says: asked for a few times.
        one = self._one
        if not self._bus.read(self.address, _MEAS_CFG, one):
            return FAILED
        if one[0] & _READY != _READY:
            return _ASK_AGAIN_MS
        low, high = self._halves
        if not (
            self._bus.read(self.address, _COEFFICIENTS, low)
            and self._bus.read(self.address, _COEFFICIENTS + 9, high)
            and self._bus.read(self.address, _COEFFICIENT_SOURCE, one)
        ):
            return FAILED
        # The sensor element that the coefficients belong to.
        self._expected[1] = _TEMPERATURE | one[0] & _EXTERNAL
        self.coefficients = unpack(low + high)
        return 1

    # Native: as bytecode it would take the heap for its frame.
    @micropython.native
    def read(self, now_ms):
        settings = self._settings
        expected = self._expected
        if not self._bus.read(self.address, _PRS_CFG, settings):
            return FAILED
        ready = settings[2]
        if (
            settings[0] != expected[0]
            or settings[1] != expected[1]
            or ready & _CONTINUOUS != expected[2]
            or settings[3] != expected[3]
        ):
            return FAILED
        if not ready & _PRESSURE_READY or not (ready & _TEMPERATURE_READY or self._complete):
            return NOTHING
        # The data sheet promises nothing about bytes that are read while a measurement ends.
        found = read_whole(self._bus, self.address, _DATA, self._data, self._again)
        self._complete = self._complete or found != FAILED
        self.taken_ms = now_ms
        return found

    # Native: as bytecode it would take the heap for its frame.
    @micropython.native
    def convert(self):
        data = self._data
        pressure = _signed(data[0] << 16 | data[1] << 8 | data[2], 24)
        temperature = _signed(data[3] << 16 | data[4] << 8 | data[5], 24)
        if pressure == 0 or temperature == 0:
            return FAILED  # what the registers have after a reset
        self.raw = pressure
        c0 = self.coefficients[0]
        c1 = self.coefficients[1]
        temperature <<= _TEMPERATURE_SHIFT
        self.temperature_decicelsius = 5 * c0 + multiply(10 * c1, temperature, 24)
        self.pressure_16 = pressure_16(
            self.coefficients, multiply(pressure, _PRESSURE_FACTOR, 20), temperature
        )
        return NEW


def _signed(value, bits):
    return value - (1 << bits) if value >> (bits - 1) else value


def unpack(data):
    """Returns c0, c1, c00, c10, c01, c11, c20, c21 and c30 out of registers 0x10 to 0x21."""
    numbers = [
        _signed(data[0] << 4 | data[1] >> 4, 12),
        _signed((data[1] & 15) << 8 | data[2], 12),
        _signed(data[3] << 12 | data[4] << 4 | data[5] >> 4, 20),
        _signed((data[5] & 15) << 16 | data[6] << 8 | data[7], 20),
    ]
    numbers += [_signed(data[at] << 8 | data[at + 1], 16) for at in range(8, 18, 2)]
    return tuple(numbers)


@micropython.native
def pressure_16(coefficients, pressure, temperature):
    """Returns the pressure in sixteenths of a pascal (section 4.9.1); 0 when it cannot be.

    `coefficients` from `unpack`; `pressure` and `temperature`: scaled raw values with 24 binary
    places.
    """
    _, _, c00, c10, c01, c11, c20, c21, c30 = coefficients
    if not -_LARGEST < pressure < _LARGEST:
        return 0
    if not -_LARGEST < temperature < _LARGEST:
        return 0
    # With 8 binary places.
    sum_8 = (c20 << 8) + multiply(c30 << 8, pressure, 24)
    sum_8 = (c10 << 8) + multiply(sum_8, pressure, 24)
    sum_8 = (c00 << 8) + multiply(sum_8, pressure, 24)
    cross_8 = (c11 << 8) + multiply(c21 << 8, pressure, 24)
    cross_8 = (c01 << 8) + multiply(cross_8, pressure, 24)
    return (sum_8 + multiply(cross_8, temperature, 24) + 8) >> 4
