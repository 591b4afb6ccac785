"""An ADC input that is read often, for a value with less noise than a single sample has."""

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython

# What `machine.ADC.read_u16` returns is 16 bits, so a sum has 21.
_SAMPLES = const(32)
# 12-bit ADCs are some steps off and have noise: 8 steps, 6 mV, below the end is the end.
_TOP = const(32 * (65535 - 128))
_LONGEST_MS = const(60_000)
_TIME_MASK = const(0x3FFFFFFF)
_TIME_SIGN = const(0x20000000)

HIGHEST_FULL_SCALE = 500_000
"""Limit of `full_scale`: a sum times it must stay a small integer of 31 bits."""


class AnalogInput:
    """Means of 32 samples in units of the caller.

    `value`: the last mean; `smoothed`: the same with 3/4 of what it was before, a time constant
    of four values; both None before the first one. `at_top`: whether the mean was at the upper end
    of the ADC's range; `at_bottom`: whether it was not above `lowest`.
    """

    def __init__(self, adc, full_scale, zero=0, lowest=-1):
        """`adc`: a `machine.ADC`. `full_scale`: units from one end of its range to the other, 1..
        `HIGHEST_FULL_SCALE`. `zero`: units that are subtracted; `lowest`: before that.
        """
        # Bound once: what is called 32 times in a row is not looked up there.
        self._read = adc.read_u16
        self._full_scale = full_scale
        self._zero = zero
        self._lowest = lowest - zero
        self._time_ms = None
        self._smoothed_4 = 0
        self.value = self.smoothed = None
        self.at_bottom = self.at_top = False

    def forget(self):
        """Has `value` and `smoothed` None until the next mean, which does not smooth them."""
        self.value = self.smoothed = None

    @micropython.native
    def update(self, now_ms):
        """Takes a mean, in 0.3 ms.

        Returns the milliseconds since the last one that succeeded, 0..60000, or -1 when reading
        failed. `now_ms` may wrap at any multiple of 2^30.
        """
        elapsed_ms = 0
        if self._time_ms is not None:
            # `ghst.schedule.ticks_diff`, without the call.
            elapsed_ms = (((now_ms - self._time_ms) & _TIME_MASK) ^ _TIME_SIGN) - _TIME_SIGN
            if elapsed_ms < 0:
                elapsed_ms = 0
            elif elapsed_ms > _LONGEST_MS:
                elapsed_ms = _LONGEST_MS
        try:
            total = self._sum()
        except OSError:
            return -1
        self._time_ms = now_ms
        self.at_top = total >= _TOP
        # round(total * full_scale / 2^21) without an intermediate of more than 30 bits.
        full_scale = self._full_scale
        low = ((total & 0x3FF) * full_scale) >> 10
        value = (((total >> 10) * full_scale + low + 0x400) >> 11) - self._zero
        self.at_bottom = value <= self._lowest
        smoothed_4 = 4 * value
        if self.value is not None:
            smoothed_4 = self._smoothed_4
            smoothed_4 += value - (smoothed_4 >> 2)
        self._smoothed_4 = smoothed_4
        self.smoothed = smoothed_4 >> 2
        self.value = value
        return elapsed_ms

    @micropython.native
    def _sum(self):
        # A function of its own: around a loop, `try` makes it slower by half.
        read = self._read
        total = 0
        for _ in range(_SAMPLES):
            total += read()
        return total
