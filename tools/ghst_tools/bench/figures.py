"""What a measurement gives: a table, with the words that say how it came about."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field


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
    words: bool = False
    """Whether the columns hold words and no figures."""


# What the main loop does meanwhile.
IDLE = "idle"
COLLECTING = "garbage collection all the time"
FLOODING = "USB flooded all the time"
SENSORS = "the application, all sensors on"
# And the worst case made on purpose.
MEETING = "idle, each frame meets the tick"


@dataclass
class Findings:
    """What is shown once more when everything is measured: as goals and as plots."""

    latencies_us: dict[str, list[float]] = field(default_factory=dict)
    """Last stop bit to last compare register, for each load of the main loop."""
    lost: int = 0
    kinds_us: dict[str, dict[str, list[float]]] = field(default_factory=dict)
    """The same for other outputs than eight plain ones: kind -> load -> times."""
    kinds_percent: dict[str, float] = field(default_factory=dict)
    """Of the CPU at 500 Hz, with control frames alone, for each of these."""
    broken: int = 0
    """Telemetry frames without all their stop bits."""
    slots_us: dict[str, list[float]] = field(default_factory=dict)
    """When telemetry began behind the last control frame, for each load."""
    share_percent: float = 100.0
    """Of the CPU at 500 Hz, with control frames alone."""
    talking_percent: float = 100.0
    """The same with telemetry behind each of them."""
    ways_percent: dict[str, float] = field(default_factory=dict)
    """The same for other ways to take the echo."""
    kept: dict[str, int] = field(default_factory=dict)
    """Bytes of RAM with nothing connected, for each form of the firmware."""
    heap_bytes: int = -1
    pulse_errors_us: list[float] = field(default_factory=list)
    wrong_pulses: int = 0
    """Those that are not the step nearest to what the frame demands."""


@dataclass(frozen=True)
class Effort:
    """How much is measured."""

    loads: tuple[str, ...]
    latency_frames: int
    """For each load of the main loop."""
    kinds_frames: int
    """For each load and each kind of outputs but eight plain ones."""
    collisions: int
    """Frames that meet the tick."""
    pulse_s: float
    failsafe_phases: int
    share_s: float
    heap_frames: int
    """And rounds of the application's main loop."""
    heap_sensors: bool
    """Whether with all sensors, which take seconds until all of them are loaded."""
    host_frames: int
    variant_frames: int
    """For each other way to write the control path; 0: none is tried."""
    frozen: bool
    """Whether the frozen image is measured, too, and the RAM of the application."""


FULL = Effort(
    loads=(IDLE, COLLECTING, FLOODING, SENSORS),
    latency_frames=2000,
    kinds_frames=400,
    collisions=60,
    pulse_s=1.5,
    failsafe_phases=10,
    share_s=0.2,
    heap_frames=300,
    heap_sensors=True,
    host_frames=20_000,
    variant_frames=60,
    frozen=True,
)
QUICK = Effort(
    loads=(IDLE,),
    latency_frames=40,
    kinds_frames=240,  # p99 is not that of the first two, before all channels have come
    collisions=10,
    pulse_s=0.2,
    failsafe_phases=2,
    share_s=0.04,
    heap_frames=50,
    heap_sensors=False,
    host_frames=200,
    variant_frames=0,
    frozen=False,
)
