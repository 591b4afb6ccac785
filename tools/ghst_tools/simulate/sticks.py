"""What the sticks do: patterns, and channels that are held."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Protocol

from ghst_tools.control_frames import CENTRE

CHANNELS = 16
LOWEST_US, HIGHEST_US = 1000, 2000
THROTTLE = 3
"""The channel that no pattern of rest leaves in the middle: it may drive a motor."""

_RANGE = 4 * (HIGHEST_US - LOWEST_US)
_LOW = 4 * LOWEST_US
_STEPS = 5
_REMEMBERED = 4

Pulses = list[int]
"""16 pulse widths in quarter microseconds (6000 = 1500 us)."""


class Sticks(Protocol):
    """Where the channels come from."""

    end_s: float | None
    """When there is no more; None: never."""

    def pulses(self, t_s: float) -> Pulses:
        """All channels `t_s` seconds after the first frame; called with times that never fall."""


def at_rest() -> Pulses:
    """All in the middle, the throttle low."""
    pulses = [CENTRE] * CHANNELS
    pulses[THROTTLE - 1] = _LOW
    return pulses


class Pattern:
    """One of PATTERNS, which repeats after `period_s`."""

    end_s: float | None = None

    def __init__(self, name: str, period_s: float = 4.0, seed: int = 0) -> None:
        self._shape = PATTERNS[name]
        self._period_s = period_s
        self._seed = seed

    def pulses(self, t_s: float) -> Pulses:
        """As `Sticks.pulses`."""
        return self._shape(t_s / self._period_s, self._seed)


class Held:
    """Some channels of other sticks held at a pulse width, whatever those do."""

    def __init__(self, sticks: Sticks, held: Mapping[int, int]) -> None:
        """`held`: channel number -> quarter microseconds."""
        self.end_s = sticks.end_s
        self._sticks = sticks
        self._held = held

    def pulses(self, t_s: float) -> Pulses:
        """As `Sticks.pulses`."""
        pulses = self._sticks.pulses(t_s)
        for channel, pulse in self._held.items():
            pulses[channel - 1] = pulse
        return pulses


def _centre(turns: float, seed: int) -> Pulses:
    return at_rest()


def _sweep(turns: float, seed: int) -> Pulses:
    # A triangle, from low to high and back; each channel a sixteenth of a turn behind.
    phases = [(turns - index / CHANNELS) % 1 for index in range(CHANNELS)]
    return [_LOW + round(_RANGE * min(2 * phase, 2 - 2 * phase)) for phase in phases]


def _steps(turns: float, seed: int) -> Pulses:
    at = int(turns * _STEPS)
    return [_LOW + _RANGE * ((at + index) % _STEPS) // (_STEPS - 1) for index in range(CHANNELS)]


def _square(turns: float, seed: int) -> Pulses:
    high = int(turns * 2) % 2
    return [_LOW + _RANGE * ((high + index) % 2) for index in range(CHANNELS)]


@lru_cache(maxsize=_REMEMBERED)
def _drawn(seed: int, turn: int) -> tuple[int, ...]:
    source = random.Random(f"{seed} {turn}")
    return tuple(_LOW + source.randint(0, _RANGE) for _ in range(CHANNELS))


def _random(turns: float, seed: int) -> Pulses:
    return list(_drawn(seed, int(turns * 8)))


PATTERNS: dict[str, Callable[[float, int], Pulses]] = {
    "centre": _centre,
    "sweep": _sweep,
    "steps": _steps,
    "square": _square,
    "random": _random,
}
"""`centre`: at rest. `sweep`: from 1000 to 2000 us and back, one channel behind the other.
`steps`: 1000, 1250, 1500, 1750, 2000 us. `square`: 1000 and 2000 us, odd and even channels against
each other. `random`: eight values a period."""
