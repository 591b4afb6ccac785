"""Decides which telemetry frame goes into the next slot.

    schedule = Schedule()
    battery = schedule.add(protocol.TYPE_PACK_STATUS, timeout_ms=1000)
    battery.refresh(now_ms)            # whenever there is a new measurement
    kind = schedule.next(now_ms)       # once a slot; 0 = nothing to send

Each kind of frame with a live source is due once in its period. Of those that are due the one
that has been for longest goes first, so with fewer slots than frames all of them come less often,
and none is left out.

The caller's clock counts milliseconds and may wrap at any multiple of 2^30, as MicroPython's
`ticks_ms` does. Nothing in here allocates but `Schedule()` and `add`.
"""

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython

from ghst.protocol import TYPE_MSP_RESPONSE

# Times are kept modulo 2^30: the largest small integer of a 32-bit port is 2^30 - 1, and adding
# two of them would allocate. So times are only ever subtracted.
_TIME_MASK = const(0x3FFFFFFF)
_TIME_SIGN = const(0x20000000)
_LONGEST_MS = const(0x10000000)  # three days, and far from where differences change their sign


def ticks_diff(end_ms, start_ms):
    """Returns the milliseconds from `start_ms` to `end_ms`, -2^29..2^29 - 1, across a wrap.

    The same as MicroPython's `time.ticks_diff` on ports whose small integers have 31 bits, for
    clocks that wrap at any multiple of 2^30 or never.
    """
    return (((end_ms - start_ms) & _TIME_MASK) ^ _TIME_SIGN) - _TIME_SIGN


def _check(name, value):
    if not 1 <= value <= _LONGEST_MS:
        raise ValueError(f"{name} is {value}, must be 1..{_LONGEST_MS}")
    return value


class Source:
    """Where one kind of frame gets its values; made by `Schedule.add`.

    `live` tells whether it gave any within its time-out before the last `Schedule.next`.
    """

    def __init__(self, kind, timeout_ms, period_ms):
        self.kind = kind
        self.timeout_ms = timeout_ms
        self.period_ms = period_ms
        self.live = False
        self._refreshed_ms = 0
        self._period_start_ms = 0

    def refresh(self, now_ms):
        """Notes that there are new values; the first ones after a gap are due at once."""
        now_ms &= _TIME_MASK
        if not self.live:
            self.live = True
            self._period_start_ms = (now_ms - self.period_ms) & _TIME_MASK
        self._refreshed_ms = now_ms

    def stop(self):
        """Ends the source before its time-out, until the next `refresh`."""
        self.live = False

    def overdue_ms(self, now_ms):
        """Returns for how long the frame has been due; -1 where it is not due or not live."""
        if not self.live:
            return -1
        # Either sign: `now_ms` may have been read before the time of the refresh.
        if abs(ticks_diff(now_ms, self._refreshed_ms)) > self.timeout_ms:
            self.live = False
            return -1
        elapsed = ticks_diff(now_ms, self._period_start_ms)
        if elapsed < 0:
            # Nobody asked for six days, half of the clock's range: it has been due for long.
            return self.period_ms
        return max(-1, elapsed - self.period_ms)

    def sent(self, now_ms, overdue_ms):
        """Starts the next period where the last one ended, but at most one period ago.

        So a frame that had to wait for its slot does not make the next one late, kinds that have
        to share too few slots share them evenly, and at most one frame is made up for.
        """
        self._period_start_ms = (now_ms - min(overdue_ms, self.period_ms)) & _TIME_MASK


class Schedule:
    """Gives every kind of frame that has a live source its turn."""

    def __init__(self):
        self._sources = []

    def add(self, kind, timeout_ms, period_ms=100):
        """Returns a new `Source` for frames of type `kind`, which is not live yet.

        `timeout_ms`: how long its values are good for; `period_ms`: a frame is due once in it
        (100 = ten times a second); both 1..2^28. Raises `ValueError` for other times, for a kind
        that has a source already and for MSP responses, which need none.
        """
        if kind == TYPE_MSP_RESPONSE or not 1 <= kind <= 255:
            raise ValueError(f"type 0x{kind:02x} has no source")
        for source in self._sources:
            if source.kind == kind:
                raise ValueError(f"type 0x{kind:02x} has a source already")
        source = Source(kind, _check("timeout_ms", timeout_ms), _check("period_ms", period_ms))
        self._sources.append(source)
        return source

    # Native: bytecode with this many locals would have them on the heap.
    @micropython.native
    def next(self, now_ms, msp_waiting=False):
        """Returns the type of the frame for the next slot, 0 for none, and takes it as sent.

        `now_ms` never goes back from call to call. `msp_waiting`: whether an MSP response waits;
        it goes before everything else.
        """
        if msp_waiting:
            return TYPE_MSP_RESPONSE
        now_ms = now_ms & _TIME_MASK
        chosen = None
        longest_ms = -1
        for source in self._sources:
            overdue_ms = source.overdue_ms(now_ms)
            if overdue_ms > longest_ms:
                longest_ms = overdue_ms
                chosen = source
        if chosen is None:
            return 0
        chosen.sent(now_ms, longest_ms)
        return chosen.kind
