"""What the firmware is to keep to, and whether it does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ghst_tools.bench.figures import Findings, Spread, Table
from ghst_tools.bench.kinds import EIGHT_ARMED, EIGHT_PLAIN, EIGHT_SHAPED, SIXTEEN_SHAPED

LATENCY_US, AIM_US = 35.0, 25.0
SHARE_PERCENT = 2.0
SLOT_US = (990.0, 1010.0)
PULSE_US = 0.5
# Bytes kept with nothing connected, for each form: what the tests hold, and the aim.
KEPT = {".mpy": (40 * 1024, 40_000), "frozen": (16 * 1024, 16_000)}

TITLES = ("Goals", "Why goals are missed")

# What holds in place of goals that are known to be missed.
_SHAPED_US = 36.0
_SIXTEEN_US = 46.0
_SIXTEEN_PERCENT = 2.4
_TALKING_PERCENT = 3.0

_WHY_NOT_AIM = (
    "The decoder within the handler would reach it: a second copy of its text in RAM, for which "
    "there is no room within the goal for RAM, and without MSP, since with it the function is too "
    "big for viper (other ways that were tried, below)."
)
_WHY_SHAPED = (
    "It is at the edge: the slowest frames are those that meet another interrupt, and how many of "
    "them do under a load is a matter of its phase. To hold pulses to their limits once and not "
    "twice, measured below with motors, would make a small difference, and one guard less."
)
_WHY_ARMED = (
    "Everything at once: the function for shaped outputs looks at the link and at the arm channel "
    "before it comes to the outputs. What would make it faster is measured below: to hold pulses "
    "to their limits once and not twice is not enough, and for the decoder within the handler "
    "there is no room."
)
_WHY_SIXTEEN = (
    "Twice as many outputs are worked out one after the other, and eight compare registers are "
    "written in place of four. What would make it faster is measured below; none of it is enough."
)
_WHY_RAM = (
    "The ways to keep less, below, are all in use but one: without line numbers a traceback would "
    "tell the file alone. What else is kept is code and names; a frozen image has both in flash."
)


@dataclass(frozen=True)
class Goal:
    """A goal, or an aim beyond it, and the figure that was reached."""

    name: str
    reached: str
    met: bool
    aim: bool = False
    """Whether it is wished for only: missing it is no fault."""
    why: str = ""
    """The reason, if it is known to be missed."""
    instead: str = ""
    """The limit that holds in its place; empty: none, it has to be met."""
    held: bool = False

    @property
    def failed(self) -> bool:
        """Whether it is missed and nobody has said that it would be, or not by that much."""
        return not (self.met or self.aim or self.held)

    @property
    def verdict(self) -> str:
        """What stands beside it."""
        if self.met:
            return "met"
        return "missed, as known" if self.held else "missed"


def goals(findings: Findings) -> list[Goal]:
    """The goals, each with the figure that was reached."""
    slots = [us for found in findings.slots_us.values() for us in found]
    found = _latency_goals(findings)
    found += [
        _none("frames lost under any load", findings.lost),
        *_share_goals(findings),
        Goal(
            "telemetry 1000 +- 10 us behind the frame under every load",
            f"{min(slots):.2f}..{max(slots):.2f} us",
            SLOT_US[0] <= min(slots) and max(slots) <= SLOT_US[1],
        ),
        _none("telemetry frames broken under any load", findings.broken),
        _none("bytes of heap taken by frames", findings.heap_bytes),
        _at_most(
            "pulses are as the frame demands, error",
            max(abs(us) for us in findings.pulse_errors_us),
            PULSE_US,
            "us",
            3,
        ),
        _none("pulses that are not the step nearest to that", findings.wrong_pulses),
    ]
    for form, kept in findings.kept.items():
        limit, aim = KEPT[form]
        name = f"RAM, {form}, nothing connected"
        found.append(_at_most(name, kept, limit, "bytes", 0))
        found.append(_aim(name, kept, aim, "bytes", _WHY_RAM, 0))
    return found


def tables(found: Sequence[Goal]) -> tuple[Table, ...]:
    """The goals, and the reasons of those that are missed."""
    reached = Table(
        TITLES[0],
        "What the firmware is to keep to on the emulated chip, and the worst of what was "
        "measured; how is told below. The time to the registers is a goal for eight servos; "
        "shaped ones, motors and sixteen outputs stand beside it. An aim is wished for: "
        "`make bench` fails with any other goal that is missed, unless it is known to be and the "
        "limit in its place holds.",
        ("goal", "reached", ""),
        tuple((goal.name, goal.reached, goal.verdict) for goal in found),
    )
    missed = [goal for goal in found if not goal.met and goal.why]
    if not missed:
        return (reached,)
    reasons = Table(
        TITLES[1],
        "With the limit that holds in place of the goal.",
        ("goal", "holds instead", "why"),
        tuple((goal.name, goal.instead or "-", goal.why) for goal in missed),
        words=True,
    )
    return reached, reasons


def _latency_goals(findings: Findings) -> list[Goal]:
    name = "outputs: last stop bit to registers under every load, p99"
    plain = _p99(findings.latencies_us)
    found = [
        _at_most(f"{EIGHT_PLAIN} {name}", plain, LATENCY_US, "us"),
        _aim(f"{EIGHT_PLAIN} {name}", plain, AIM_US, "us", _WHY_NOT_AIM),
    ]
    for kind, us in findings.kinds_us.items():
        goal = _at_most(f"{kind} {name}", _p99(us), LATENCY_US, "us")
        if kind == SIXTEEN_SHAPED:
            goal = _known(goal, _p99(us), _SIXTEEN_US, "us", _WHY_SIXTEEN)
        elif kind == EIGHT_ARMED:
            goal = _known(goal, _p99(us), _SHAPED_US, "us", _WHY_ARMED)
        elif kind == EIGHT_SHAPED:
            goal = _known(goal, _p99(us), _SHAPED_US, "us", _WHY_SHAPED)
        found.append(goal)
    return found


def _share_goals(findings: Findings) -> list[Goal]:
    name = "outputs: share of the CPU at 500 Hz, control frames alone"
    percents = {EIGHT_PLAIN: findings.share_percent, **findings.kinds_percent}
    found = []
    for kind, percent in percents.items():
        goal = _at_most(f"{kind} {name}", percent, SHARE_PERCENT, "%")
        if kind == SIXTEEN_SHAPED:
            goal = _known(goal, percent, _SIXTEEN_PERCENT, "%", _WHY_SIXTEEN)
        found.append(goal)
    talking = findings.talking_percent
    goal = _at_most(
        f"{EIGHT_PLAIN} outputs: the same with telemetry behind each frame",
        talking,
        SHARE_PERCENT,
        "%",
    )
    found.append(_known(goal, talking, _TALKING_PERCENT, "%", _why_talking(findings)))
    return found


def _why_talking(findings: Findings) -> str:
    why = "What is sent is heard as well and raises the interrupt once more, to be compared."
    if findings.ways_percent:
        name, least = min(findings.ways_percent.items(), key=lambda way: way[1])
        why += f" Of the ways to take it that were tried, below, the least takes {least:.2f} %"
        why += f" ({name})."
    return why


def _p99(found: Mapping[str, Sequence[float]]) -> float:
    """Under the load under which it is latest."""
    return max(Spread.of(us).p99 for us in found.values())


def _none(name: str, count: int) -> Goal:
    return Goal(f"{name}: 0", f"{count}", count == 0)


def _at_most(name: str, value: float, limit: float, unit: str, digits: int = 2) -> Goal:
    return Goal(f"{name} <= {limit:g} {unit}", f"{value:.{digits}f} {unit}", value <= limit)


def _aim(name: str, value: float, limit: float, unit: str, why: str, digits: int = 2) -> Goal:
    return replace(_at_most(f"aim: {name}", value, limit, unit, digits), aim=True, why=why)


def _known(goal: Goal, value: float, limit: float, unit: str, why: str) -> Goal:
    """The goal, known to be missed for a reason; `limit` holds in its place."""
    return replace(goal, why=why, instead=f"<= {limit:g} {unit}", held=value <= limit)
