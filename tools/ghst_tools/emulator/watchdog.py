"""The watchdog: what rp2040py leaves standing across a reset.

rp2040py 0.3.6 keeps the watchdog counting through the reset that it caused itself, and turns the
enable bit on again when the write that forced a reset is done. On the chip a reset leaves it
disabled, with REASON and the scratch registers kept after a watchdog reset and cleared by a power
cycle. Source: RP2040 datasheet, section 4.7. The counter counts two a microsecond (erratum
RP2040-E1) and stands while ENABLE is clear.
"""

from __future__ import annotations

from typing import Any

from rp2040py.peripherals.watchdog import RPWatchdog

_CTRL, _LOAD, _REASON = 0x00, 0x04, 0x08
_TRIGGER, _ENABLE = 1 << 31, 1 << 30
_REASON_TIMER = 1 << 0


class Watchdog(RPWatchdog):
    """The watchdog block of the chip."""

    def __init__(self, mcu: Any) -> None:
        super().__init__(mcu, "WATCHDOG")

    @property
    def reason(self) -> str:
        """What the last watchdog reset was: "timer" (it ran out) or "forced"."""
        return "timer" if self.read_uint32(_REASON) & _REASON_TIMER else "forced"

    def write_uint32(self, offset: int, value: int) -> None:
        if offset == _CTRL and value & _TRIGGER:
            super().write_uint32(_CTRL, (value & ~_ENABLE) | _TRIGGER)
        else:
            super().write_uint32(offset, value)

    def disable(self) -> None:
        """Put the counter into its state after a reset: standing at zero."""
        super().write_uint32(_CTRL, 0)
        super().write_uint32(_LOAD, 0)

    def reset(self) -> None:
        """Power-on: REASON and the scratch registers are lost as well."""
        super().reset()
        self.disable()


def install(mcu: Any) -> Watchdog:
    """Replace the watchdog of `mcu`; to be done before the chip runs."""
    watchdog = Watchdog(mcu)
    mcu.watchdog = mcu.peripherals[0x40058] = watchdog
    return watchdog
