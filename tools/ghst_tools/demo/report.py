"""What a run hands on: to the screen while it lasts, to plot and summary at its end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

Points = Sequence[tuple[float, float]]
"""(seconds, microseconds)"""


class Row(NamedTuple):
    """One output as the screen shows it."""

    output: str
    channel: int
    sent_us: float
    """0 = nothing, or no pulses."""
    measured_us: float | None
    """None: no pulse within the last two periods."""
    error_us: float
    """Last pulse against what the channel demanded when it rose."""


@dataclass(frozen=True)
class Snapshot:
    """The state of the run at one moment."""

    phase: str
    progress: float
    """0..1"""
    emulated_s: float | None
    """None where no chip is emulated."""
    link: str
    lq: int
    rssi_dbm: int
    frames_sent: int
    frames_decoded: int
    crc_errors: int
    right: int
    wrong: int
    rows: tuple[Row, ...]
    console: tuple[str, ...]
    """What the board has printed."""
    radio: tuple[tuple[str, str], ...] = ()
    """Label and text of each line that the pilot's radio shows."""


class View(Protocol):
    """Where a run shows its progress."""

    def show(self, snapshot: Snapshot) -> None:
        """Show the state; called about fifty times for a second of emulated time."""


class Trace(NamedTuple):
    """One output over time, for the plot."""

    output: str
    channel: int
    sent: Points
    """0 us = no pulses demanded."""
    measured: Points
    errors: Points
    """How far each measured pulse is off the channel's value."""


class Span(NamedTuple):
    """A part of the time axis, in seconds."""

    name: str
    start: float
    end: float
    failsafe: bool = False


@dataclass
class Report:
    """The outcome of a run. All was right if `failures` is empty."""

    title: str
    measured: str
    """What the measured values are."""
    lines: list[tuple[str, str]] = field(default_factory=list)
    """Label and text, in the order of the summary."""
    failures: list[str] = field(default_factory=list)
    traces: list[Trace] = field(default_factory=list)
    spans: list[Span] = field(default_factory=list)
