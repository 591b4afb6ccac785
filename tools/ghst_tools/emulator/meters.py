"""Measuring pulses at pins."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import NamedTuple

from ghst_tools.emulator.board import Board


class Pulse(NamedTuple):
    """A complete pulse: when it rose, and for how long the pin was high, in nanoseconds."""

    rise_ns: float
    width_ns: float


class PulseMeter:
    """Records every complete high pulse that the chip drives on `pins`.

    A pulse ends when the pin goes low or is not driven any more; one whose beginning was not seen
    is not complete. `pulses[pin]` may be cleared at
    any time to save memory in long runs.
    """

    def __init__(self, board: Board, pins: Iterable[int]) -> None:
        self._board = board
        self.pulses: dict[int, list[Pulse]] = {pin: [] for pin in pins}
        self._rise: dict[int, float | None] = dict.fromkeys(self.pulses)
        for pin in self.pulses:
            board.pin(pin).watch(partial(self._changed, pin))

    def level(self, pin: int) -> bool | None:
        """What the chip drives on `pin` now; None: its output is off."""
        return self._board.pin(pin).device

    def last(self, pin: int) -> Pulse | None:
        """The last complete pulse on `pin`, or None."""
        pulses = self.pulses[pin]
        return pulses[-1] if pulses else None

    def since(self, t_ns: float, pin: int) -> list[Pulse]:
        """The complete pulses on `pin` that began at or after `t_ns`."""
        pulses = self.pulses[pin]
        first = len(pulses)
        while first and pulses[first - 1].rise_ns >= t_ns:
            first -= 1
        return pulses[first:]

    def _changed(self, pin: int, t_ns: float, level: bool | None) -> None:
        rise = self._rise[pin]
        if level:
            self._rise[pin] = t_ns
        elif rise is not None:
            # Emulated time is a float of nanoseconds; the chip's grid is 8 ns.
            self.pulses[pin].append(Pulse(rise, round(t_ns - rise, 3)))
            self._rise[pin] = None
