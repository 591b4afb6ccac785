"""`AltitudeFilter`: smooth altitude and vertical speed from noisy altitudes, in integers."""

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython

LONGEST_STEP_MS = const(500)
FURTHEST_JUMP_MM = const(30_000)

_MAXIMUM_SPEED_8 = const(200_000 * 8)


class AltitudeFilter:
    """An alpha-beta filter: it predicts with the speed, and corrects altitude and speed.

    Its gains follow from the time since the last altitude so that both poles stay at the same
    `time_constant_ms`, T: alpha = 1 - q^2, beta = (1 - q)^2, q = T / (T + dt). It neither
    oscillates nor lags behind a steady climb; behind a sudden climb the speed has 63 % of it
    after 2.1 T and 95 % after 4.7 T.

    `altitude_mm` is None before the first altitude, `speed_mm_s` up positive.
    """

    def __init__(self, time_constant_ms=400):
        """`time_constant_ms`: 300..5000."""
        # Below, products of the gains would leave the range of small integers.
        if not 300 <= time_constant_ms <= 5000:
            raise ValueError(f"time_constant_ms is {time_constant_ms}, must be 300..5000")
        self._time_constant_ms = time_constant_ms
        # Both in eighths, or the rounding of small corrections would add up.
        self._altitude_8 = 0
        self._speed_8 = 0
        self.reset()

    def reset(self):
        """Forgets everything; the next altitude is taken as it is, with no speed."""
        self.altitude_mm = None
        self.speed_mm_s = 0
        self._speed_8 = 0

    @micropython.native
    def update(self, altitude_mm, step_ms):
        """Takes an altitude; returns False for one that is too far away to be true.

        `altitude_mm`: within +-12 km; `step_ms`: time since the last altitude that was taken. More
        than `LONGEST_STEP_MS` of it, or less than 1, reset the filter. Too far away is more than
        `FURTHEST_JUMP_MM` from the prediction; such an altitude changes nothing.
        """
        if self.altitude_mm is None or not 0 < step_ms <= LONGEST_STEP_MS:
            self.altitude_mm = altitude_mm
            self.speed_mm_s = 0
            self._altitude_8 = altitude_mm << 3
            self._speed_8 = 0
            return True
        predicted_8 = self._altitude_8 + (self._speed_8 * step_ms + 500) // 1000
        error_8 = (altitude_mm << 3) - predicted_8
        if not -8 * FURTHEST_JUMP_MM <= error_8 <= 8 * FURTHEST_JUMP_MM:
            return False
        time_ms = self._time_constant_ms + step_ms
        pole = (self._time_constant_ms << 12) // time_ms
        alpha = 4096 - (pole * pole >> 12)
        # beta / dt, with 12 binary places for an error in mm and a speed in mm/s.
        gain = (step_ms << 14) // time_ms * 250 // time_ms
        self._altitude_8 = predicted_8 + ((error_8 * alpha + 2048) >> 12)
        speed_8 = self._speed_8 + ((error_8 * gain + 2048) >> 12)
        self._speed_8 = max(-_MAXIMUM_SPEED_8, min(_MAXIMUM_SPEED_8, speed_8))
        self.altitude_mm = (self._altitude_8 + 4) >> 3
        self.speed_mm_s = (self._speed_8 + 4) >> 3
        return True
