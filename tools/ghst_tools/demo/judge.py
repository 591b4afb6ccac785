"""What each pulse must be, and whether it is.

The PWM hardware takes a compare value over when its slice wraps, which is where a pulse rises. So
a pulse shows the last frame that was served before it rose; a frame whose interrupt may or may
not have come before that makes both widths right.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import NamedTuple, Protocol

from ghst_tools.demo.flight import pulses_in

SERVED_WITHIN_NS = 50_000
"""What the adapter promises: last stop bit to last compare register."""

FAILSAFE_SLACK_MS = 20

PERIOD_NS = 20_000_000
STEP_NS = 312.5
"""One PWM count: at 50 Hz the firmware counts at 3.2 MHz."""

TOLERANCE_NS = 16
"""The divider is 39 1/16 clocks of 8 ns: an edge is up to two clocks off the ideal step."""

HOLD = "hold"


class Pulse(Protocol):
    """`ghst_tools.emulator.Pulse`, without the emulator."""

    @property
    def rise_ns(self) -> float: ...

    @property
    def width_ns(self) -> float: ...


class _Change(NamedTuple):
    """From some time between the two on the outputs have these pulses, quarter microseconds."""

    earliest_ns: float
    latest_ns: float
    pulses: tuple[int, ...]


class Demand:
    """The pulse width that each output must have, as a function of time.

    `channels`: {GPIO: channel}; `failsafe`: {GPIO: "hold", "none" or us}, "none" where absent.
    """

    def __init__(self, channels: Mapping[int, int], failsafe: Mapping[int, str | float]) -> None:
        self.channels = dict(channels)
        self._index = {pin: index for index, pin in enumerate(channels)}
        self._failsafe = {pin: failsafe.get(pin, "none") for pin in channels}
        self._received = dict.fromkeys(range(1, 17), 0)
        self._without = dict.fromkeys(channels, 0)  # what a pin gives while its channel is missing
        silence = (0,) * len(self._index)
        self._changes = [_Change(0.0, 0.0, silence)]
        self._latest = [0.0]

    def frame(self, end_ns: float, frame: bytes) -> None:
        """A control frame's last stop bit has ended."""
        self._received |= pulses_in(frame)
        pulses = tuple(
            self._received[channel] or self._without[pin] for pin, channel in self.channels.items()
        )
        self._add(_Change(end_ns, end_ns + SERVED_WITHIN_NS, pulses))

    def failsafe(self, earliest_ns: float, latest_ns: float) -> None:
        """The link is lost: failsafe begins between these times."""
        self._without = {pin: self._lost(pin) for pin in self.channels}
        self._received = dict.fromkeys(self._received, 0)
        self._add(_Change(earliest_ns, latest_ns, tuple(self._without.values())))

    def at(self, pin: int, t_ns: float) -> set[int]:
        """The pulse widths on `pin` that are right for a wrap at `t_ns`; 0 means no pulse."""
        index = self._index[pin]
        at = bisect_right(self._latest, t_ns) - 1
        right = {self._changes[at].pulses[index]}
        for change in islice(self._changes, at + 1, None):
            if change.earliest_ns > t_ns:
                break
            right.add(change.pulses[index])
        return right

    def latest(self, pin: int) -> int:
        """What the last frame, or failsafe, demands of `pin`."""
        return self._changes[-1].pulses[self._index[pin]]

    def history(self, pin: int) -> list[tuple[float, int]]:
        """(ns, pulse width) for each frame and failsafe so far, from power-on."""
        index = self._index[pin]
        return [(change.earliest_ns, change.pulses[index]) for change in self._changes]

    def ends_in_failsafe(self, pin: int) -> bool:
        """Whether failsafe means no pulses on `pin`."""
        return self._failsafe[pin] == "none"

    def _lost(self, pin: int) -> int:
        rule = self._failsafe[pin]
        if rule == HOLD:
            return self._received[self.channels[pin]] or self._without[pin]
        return 0 if isinstance(rule, str) else round(4 * rule)

    def _add(self, change: _Change) -> None:
        self._changes.append(change)
        self._latest.append(change.latest_ns)


def width_ns(pulse: int) -> float:
    """The width that the PWM makes of `pulse` quarter microseconds: the nearest of its steps."""
    return (8 * pulse + 5) // 10 * STEP_NS


@dataclass
class Verdict:
    """What has been found at one pin."""

    right: int = 0
    missing: int = 0
    worst_step_ns: float = 0.0
    """Largest deviation of a right pulse from the PWM step that was demanded."""
    worst_ns: float = 0.0
    """Largest deviation of a right pulse from the channel's value."""
    errors: list[tuple[float, float]] = field(default_factory=list)
    """When each pulse rose, and how far it was off the channel's value; both in nanoseconds."""
    wrong: list[str] = field(default_factory=list)


class Judge:
    """Judges pulses, pin by pin, in the order of time."""

    def __init__(self, demand: Demand) -> None:
        self._demand = demand
        self.verdicts = {pin: Verdict() for pin in demand.channels}

    def pulse(self, pin: int, pulse: Pulse) -> None:
        """Judge a complete pulse; frames up to its rise must be known to the demand."""
        verdict = self.verdicts[pin]
        right = self._demand.at(pin, pulse.rise_ns)
        nearest = min(right, key=lambda value: abs(width_ns(value) - pulse.width_ns))
        error = pulse.width_ns - 250 * nearest
        verdict.errors.append((pulse.rise_ns, error))
        step_error = abs(pulse.width_ns - width_ns(nearest))
        if nearest and step_error <= TOLERANCE_NS:
            verdict.right += 1
            verdict.worst_step_ns = max(verdict.worst_step_ns, step_error)
            verdict.worst_ns = max(verdict.worst_ns, abs(error))
            return
        demanded = " or ".join(f"{value / 4} us" if value else "none" for value in sorted(right))
        verdict.wrong.append(
            f"GP{pin}: pulse of {pulse.width_ns / 1000:.4f} us at {pulse.rise_ns / 1e6:.3f} ms, "
            f"demanded was {demanded}"
        )

    def periods(self, pin: int, pulses: Sequence[Pulse], since_ns: float, until_ns: float) -> None:
        """Count the PWM periods that begin in this time and lack the pulse they should have."""
        verdict = self.verdicts[pin]
        if not pulses:
            verdict.missing += 1
            return
        rises = {round((pulse.rise_ns - pulses[0].rise_ns) / PERIOD_NS) for pulse in pulses}
        first = -int((pulses[0].rise_ns - since_ns) // PERIOD_NS)
        last = int((until_ns - pulses[0].rise_ns) // PERIOD_NS)
        for number in range(first, last + 1):
            wrap_ns = pulses[0].rise_ns + number * PERIOD_NS
            if number not in rises and 0 not in self._demand.at(pin, wrap_ns):
                verdict.missing += 1
        strays = [
            pulse
            for pulse in pulses
            if abs((pulse.rise_ns - pulses[0].rise_ns + PERIOD_NS / 2) % PERIOD_NS - PERIOD_NS / 2)
            > TOLERANCE_NS
        ]
        verdict.wrong += [
            f"GP{pin}: pulse at {pulse.rise_ns / 1e6:.3f} ms is out of step" for pulse in strays
        ]

    @property
    def right(self) -> int:
        """Pulses that were right, on all pins."""
        return sum(verdict.right for verdict in self.verdicts.values())

    @property
    def missing(self) -> int:
        """Periods without a pulse that should have had one, on all pins."""
        return sum(verdict.missing for verdict in self.verdicts.values())

    @property
    def wrong(self) -> list[str]:
        """A line for each pulse that was wrong, on all pins."""
        return [line for verdict in self.verdicts.values() for line in verdict.wrong]
