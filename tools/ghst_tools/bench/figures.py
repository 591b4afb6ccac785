"""What a measurement gives: a table, with the words that say how it came about."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Spread:
    """How a measured quantity is spread; all in its own unit."""

    count: int
    minimum: float
    mean: float
    p99: float
    """The smallest value that 99 % of all values do not exceed (nearest rank)."""
    maximum: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """The spread of `values`. Raises ValueError if there are none."""
        if not values:
            raise ValueError("nothing was measured")
        ordered = sorted(values)
        rank = math.ceil(0.99 * len(ordered))
        mean = math.fsum(ordered) / len(ordered)
        return cls(len(ordered), ordered[0], mean, ordered[rank - 1], ordered[-1])


@dataclass(frozen=True)
class Table:
    """A table of figures."""

    title: str
    how: str
    """What was measured and how, in plain sentences."""
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    repeatable: bool = True
    """Whether every run gives the same figures; false for what depends on the host's speed."""


# What the main loop does meanwhile.
IDLE = "idle"
COLLECTING = "garbage collection all the time"
PRINTING = "USB printing all the time"


@dataclass(frozen=True)
class Effort:
    """How much is measured."""

    loads: tuple[str, ...]
    latency_frames: int
    """For each load of the main loop."""
    collisions: int
    """Frames that meet the tick."""
    pulse_s: float
    failsafe_phases: int
    share_s: float
    heap_frames: int
    host_frames: int


FULL = Effort(
    loads=(IDLE, COLLECTING, PRINTING),
    latency_frames=400,
    collisions=60,
    pulse_s=1.5,
    failsafe_phases=10,
    share_s=0.2,
    heap_frames=500,
    host_frames=20_000,
)
QUICK = Effort(
    loads=(IDLE,),
    latency_frames=40,
    collisions=10,
    pulse_s=0.2,
    failsafe_phases=2,
    share_s=0.04,
    heap_frames=50,
    host_frames=200,
)
