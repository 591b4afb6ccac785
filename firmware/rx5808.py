"""Tunes an RX5808 module (RTC6715), a receiver of analogue video on 5.3..6.0 GHz.

The module must be of the kind whose pins CH1, CH2, CH3 are data, select and clock: modules that
choose a channel by these pins have to be modified (SPI_EN open instead of at ground).

Sources: RTC6715 data sheet, SPI timing and register map.
"""

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython

LOWEST_MHZ = 5300
HIGHEST_MHZ = 6000

# A word is 25 bits, least significant first: address, one for writing, value. The module takes a
# bit when the clock rises and the word when select rises; each level must last for 100 ns.
_BITS = const(25)
_WRITE = const(1 << 4)
_VALUE = const(5)
_SYNTHESIZER_A = const(0x00)
_SYNTHESIZER_B = const(0x01)
_POWER_DOWN = const(0x0A)

# Both as after power-on: 8 MHz by 8 is the step of 1 MHz that register B counts in; and video is
# received, sound is not.
_REFERENCE = const(8)
_NO_SOUND = const(0x10DF3)

_INTERMEDIATE_MHZ = const(479)
_COUNT_MASK = const(0x3FFFFFFF)


def synthesizer_b(frequency_mhz):
    """Returns the value of register B that tunes to `frequency_mhz`, or 1 MHz below it.

    The oscillator runs 479 MHz below, at 2 * (32 * N + A) MHz; N are bits 7..19, A bits 0..6.
    """
    steps = (frequency_mhz - _INTERMEDIATE_MHZ) // 2
    return steps // 32 << 7 | steps % 32


class Rx5808:
    """A module on three pins.

    `faults`: how often a frequency was asked for that the module does not have, modulo 2^30.
    """

    def __init__(self, clock, data, select):
        """`clock`, `data`, `select`: `machine.Pin`s, which become outputs."""
        select.init(select.OUT, value=1)
        clock.init(clock.OUT, value=0)
        data.init(data.OUT, value=0)
        # Bound once: they are called a hundred times a word.
        self._clock = clock.value
        self._data = data.value
        self._select = select.value
        self._frequency_mhz = None
        self.faults = 0

    @property
    def frequency_mhz(self):
        """The frequency that was set last, None before the first one."""
        return self._frequency_mhz

    def set_frequency(self, mhz):
        """Tunes to `mhz`, in 1.2 ms; the picture is gone for some 30 ms, always.

        Returns False, and counts a fault, for anything but an integer in 5300..6000. Everything
        that the module must know is sent each time, so that one that had no power before, or lost
        it, is tuned as well.
        """
        if type(mhz) is not int or not LOWEST_MHZ <= mhz <= HIGHEST_MHZ:
            self.faults = (self.faults + 1) & _COUNT_MASK
            return False
        self._write(_SYNTHESIZER_A, _REFERENCE)
        self._write(_POWER_DOWN, _NO_SOUND)
        # Last, because this register starts the tuning.
        self._write(_SYNTHESIZER_B, synthesizer_b(mhz))
        self._frequency_mhz = mhz
        return True

    @micropython.native
    def _write(self, address, value):
        clock = self._clock
        data = self._data
        word = address | _WRITE | value << _VALUE
        self._select(0)
        for _ in range(_BITS):
            data(word & 1)
            clock(1)
            clock(0)
            word >>= 1
        self._select(1)
        data(0)
