"""The checks of the outputs: pulses read back at the pins, and bad frames in between."""

from __future__ import annotations

from collections.abc import Iterator

from ghst_tools.selftest import link, transmissions
from ghst_tools.selftest.context import Context
from ghst_tools.selftest.result import Result, judged
from ghst_tools.selftest.session import ask

TIMERS = 3
"""`selftest_pulses.TIMERS`."""

_TOLERANCE_US = 0.5
_MINIMUM, _MAXIMUM = 3200, 8800  # quarter microseconds, `firmware.interrupts`


def limited_us(pulse: int) -> float:
    """The pulse at a pin for a channel."""
    return min(max(pulse, _MINIMUM), _MAXIMUM) / 4


def measured_us(context: Context, sent: list[str], pins: list[int]) -> dict[int, list[float]]:
    """The pulses at these pins while all of `sent` is sent in turn."""
    found: dict[int, list[float]] = {}
    context.session.run(f"bench.settle({sent})")
    for at in range(0, len(pins), TIMERS):
        some = pins[at : at + TIMERS]
        widths = ask(context.session, f"bench.widths({sent}, {some})")
        found |= {pin: [ns / 1e3 for ns in each] for pin, each in zip(some, widths, strict=True)}
    return found


def pulses(context: Context) -> Iterator[Result]:
    """Each output, in each position of the sticks."""
    pins = sorted(context.servos)
    found: dict[int, list[tuple[float, list[float]]]] = {pin: [] for pin in pins}
    for stick in context.sticks:
        sent = [transmissions.of_frame(frame) for frame in stick.frames]
        wanted = stick.pulses
        for pin, widths in measured_us(context, sent, pins).items():
            found[pin].append((limited_us(wanted[context.servos[pin] - 1]), widths))
    wrong = {
        pin: [bool(widths) and max(widths) for _, widths in rows]
        for pin, rows in found.items()
        if not all(right(expected, widths) for expected, widths in rows)
    }
    for pin, rows in found.items():
        yield judged(
            f"servo {context.name(pin)}, channel {context.servos[pin]}",
            " / ".join(f"{expected:g}" for expected, _ in rows) + f" ± {_TOLERANCE_US} us",
            " / ".join(shown(widths) for _, widths in rows) + " us",
            pin not in wrong,
            "" if pin not in wrong else _hint(context, pin, rows, wrong),
        )


def right(expected: float, widths: list[float]) -> bool:
    return bool(widths) and all(abs(width - expected) <= _TOLERANCE_US for width in widths)


def shown(widths: list[float]) -> str:
    if not widths:
        return "no pulse"
    low, high = min(widths), max(widths)
    return f"{low:.2f}" if high - low < 0.1 else f"{low:.2f}..{high:.2f}"


def _hint(
    context: Context,
    pin: int,
    rows: list[tuple[float, list[float]]],
    wrong: dict[int, list[float | bool]],
) -> str:
    name = context.name(pin)
    if not any(widths for _, widths in rows):
        (level,) = ask(context.session, f"bench.levels([{pin}])")
        held = "high" if level else "low"
        return f"{name} stays {held}: something holds it, or it is shorted"
    twins = [other for other in wrong if other != pin and wrong[other] == wrong[pin]]
    if twins:
        return f"{name} moves with {context.names(twins)}: are they shorted?"
    return f"take off what is connected to {name}"


def bad_frames_in_flight(context: Context) -> Result:
    """Good frames with bad ones between them: the pulses are those of the good ones."""
    stick = context.sticks[0]
    good = [transmissions.of_frame(frame) for frame in stick.frames]
    bad = [each[0] for each in link.bad_transmissions().values()]
    # A frame of the good ones behind each bad one.
    sent = [text for number, wrong in enumerate(bad) for text in (wrong, good[number % len(good)])]
    sent += good
    pins = sorted(context.servos)[:TIMERS]
    expected = [limited_us(stick.pulses[context.servos[pin] - 1]) for pin in pins]
    before = ask(context.session, "bench.counters()")
    found = measured_us(context, sent, pins)
    after = ask(context.session, "bench.counters()")
    ok = all(right(width, found[pin]) for width, pin in zip(expected, pins, strict=True))
    errors = after["crc_errors"] - before["crc_errors"]
    return judged(
        "bad frames in flight",
        " / ".join(f"{width:g}" for width in expected) + f" ± {_TOLERANCE_US} us, errors counted",
        " / ".join(shown(found[pin]) for pin in pins) + f" us, {errors} CRC errors",
        ok and errors > 0,
    )
