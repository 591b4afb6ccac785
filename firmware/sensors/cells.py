"""What a voltage tells of a battery: whether there is one, how many cells it has, how empty.

Pure logic; `firmware.sensors.battery` measures.
"""

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython

GOOD = 0
WARNING = 1
CRITICAL = 2
NOT_PRESENT = 3
STARTING = 4

_FULL_MV = const(4350)  # LiHV; a LiPo has 4200
_EMPTY_MV = const(2500)
_TOLERANCE_MV = const(100)
_STEADY_MV = const(100)
_STEADY_MS = const(1000)
_SETTLE_MS = const(10_000)
_PRESENT_MV = const(3000)
_UNPLUGGED_MV = const(2500)
_UNPLUGGED_MS = const(3000)
_HYSTERESIS_MV = const(100)
_ALARM_MS = const(2000)
_NEVER_MV = const(0x3FFFFFFF)


class _Alarm:
    """A cell voltage that has been below its limit for two seconds."""

    def __init__(self, limit_mv):
        self.limit_mv = limit_mv
        self.clear()

    def clear(self):
        self.on = False
        self.against_ms = 0

    @micropython.native
    def update(self, voltage_mv, count, step_ms):
        if self.on:
            against = voltage_mv >= (self.limit_mv + _HYSTERESIS_MV) * count
        else:
            against = voltage_mv < self.limit_mv * count
        against_ms = self.against_ms + step_ms if against else 0
        if against_ms >= _ALARM_MS:
            self.on = not self.on
            against_ms = 0
        self.against_ms = against_ms


class Cells:
    """The cells of the battery that is plugged in.

    `present`: a battery is there from 3 V on, until 3 s after it fell below 2.5 V. A single cell
    that sags for longer than that is broken, and is taken for unplugged. `unplugged`: whether it
    was, and no other has come since.

    `count`: as given, or found when the battery was plugged in: the first voltage that has been
    steady within 0.1 V for a second, or the one after ten seconds, divided by 4.35 V and rounded
    up. That is right for each LiPo and LiHV of up to 4 cells above 3.27 V a cell, of 5 above
    3.48 V, of 6 above 3.63 V. None while not known.
    """

    def __init__(self, *, given=0, before=0, low_mv=3500, critical_mv=3300):
        """`given`: the number of cells, 0 = find out; `before`: found before a reset, 0 = not.

        `low_mv`, `critical_mv`: limits for one cell.
        """
        self._given = given
        self._restored = before and not given
        self.count = given or before or None
        self.present = False
        self._low = _Alarm(low_mv)
        self._critical = _Alarm(critical_mv)
        self.unplugged = False
        self._absent_ms = self._steady_ms = self._settle_ms = self._steady_mv = 0
        # From this voltage on there is nothing to do.
        self._calm_mv = _NEVER_MV

    @property
    def found(self):
        """The number of cells that was found, 0 while it was not; to be given back as `before`."""
        return 0 if self._given else self.count or 0

    @property
    def low(self):
        """Whether the voltage was below `low_mv` a cell for 2 s; over after 2 s 0.1 V above it."""
        return self._low.on or self._critical.on

    @property
    def critical(self):
        """The same for `critical_mv`."""
        return self._critical.on

    @property
    def state(self):
        """The battery as MSP has it: `GOOD`, `WARNING`, `CRITICAL`, `NOT_PRESENT`, `STARTING`."""
        if not self.present:
            return NOT_PRESENT
        if self.count is None:
            return STARTING
        if self._critical.on:
            return CRITICAL
        return WARNING if self._low.on else GOOD

    @micropython.native
    def update(self, voltage_mv, step_ms):
        """Takes the voltage, `step_ms` after the last one.

        Returns True when it is another battery than before.
        """
        if voltage_mv >= self._calm_mv:
            return False
        other = self._plugged_in(voltage_mv, step_ms)
        if not self.present:
            return other
        count = self.count
        if count is None:
            self._find(voltage_mv, step_ms)
            return other
        low = self._low
        critical = self._critical
        low.update(voltage_mv, count, step_ms)
        critical.update(voltage_mv, count, step_ms)
        if low.on or critical.on or low.against_ms or self._absent_ms:
            self._calm_mv = _NEVER_MV
        else:
            self._calm_mv = low.limit_mv * count
        return other

    @micropython.native
    def _plugged_in(self, voltage_mv, step_ms):
        if voltage_mv >= _UNPLUGGED_MV:
            self._absent_ms = 0
        elif not self.unplugged:
            self._absent_ms += step_ms
            if self._absent_ms >= _UNPLUGGED_MS:
                self.unplugged = True
                self.present = False
                self._low.clear()
                self._critical.clear()
        if voltage_mv < _PRESENT_MV or self.present:
            return False
        self.present = True
        count = self.count
        other = self.unplugged
        if self._restored:
            highest_mv = (_FULL_MV + _TOLERANCE_MV) * count
            other = other or not _EMPTY_MV * count <= voltage_mv <= highest_mv
        self.unplugged = self._restored = False
        if other:
            self.count = self._given or None
            self._steady_ms = self._settle_ms = self._steady_mv = 0
        return other

    def _find(self, voltage_mv, step_ms):
        self._settle_ms += step_ms
        self._steady_ms += step_ms
        if abs(voltage_mv - self._steady_mv) > _STEADY_MV:
            self._steady_mv = voltage_mv
            self._steady_ms = 0
        if self._steady_ms >= _STEADY_MS or self._settle_ms >= _SETTLE_MS:
            self.count = (voltage_mv + _FULL_MV - 1) // _FULL_MV
