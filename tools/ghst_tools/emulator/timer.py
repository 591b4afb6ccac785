"""The microsecond timer: alarms on the microsecond, and a clock that can be moved forward.

rp2040py 0.3.6 fires an alarm up to 1 us before the count reaches its target; the SDK then finds
that nothing is due and has to arm it again. Here an alarm fires when the count becomes the
target. Source: RP2040 datasheet, section 4.6.
"""

from __future__ import annotations

from typing import Any

from rp2040py.peripherals.timer import RPTimer

_ALARM0, _ALARM3 = 0x10, 0x1C
_WORD = 1 << 32


class Timer(RPTimer):
    """The TIMER block of the chip."""

    def __init__(self, mcu: Any) -> None:
        super().__init__(mcu, "TIMER")

    def write_uint32(self, offset: int, value: int) -> None:
        super().write_uint32(offset, value)
        if _ALARM0 <= offset <= _ALARM3:
            alarm = self.alarms[(offset - _ALARM0) // 4]
            self._arm(alarm, (value - int(self._micros())) % _WORD)

    def advance(self, us: int) -> None:
        """Move the 64-bit count forward by `us` microseconds at once.

        Nothing runs meanwhile. An alarm whose target lies in what was skipped fires now, as it
        would have fired in between; the others fire that much earlier.
        """
        if us < 0:
            raise ValueError("the clock only moves forward")
        before = int(self._micros())
        self._epoch_nanos -= us * 1000.0
        for alarm in self.alarms:
            if alarm.armed:
                left = (alarm.target_micros - before) % _WORD
                self._arm(alarm, max(0, left - us))

    def _arm(self, alarm: Any, us: int) -> None:
        into_the_microsecond = self._micros() % 1.0 * 1000.0
        alarm.clock_alarm.schedule(max(0.0, us * 1000.0 - into_the_microsecond))


def install(mcu: Any) -> Timer:
    """Replace the timer of `mcu`; to be done before the chip runs."""
    timer = Timer(mcu)
    mcu.timer = mcu.peripherals[0x40054] = timer
    return timer
