"""The last checks: failsafe when frames are cut, and the watchdog when the control path stops."""

from __future__ import annotations

from collections.abc import Iterator

from ghst_tools.selftest import servos, transmissions
from ghst_tools.selftest.context import FIXED_PULSE, Context, Stick
from ghst_tools.selftest.load import MODULES, load
from ghst_tools.selftest.result import Result, Verdict, judged
from ghst_tools.selftest.session import RESTARTED, ask

# 500 ms, a tick of 10 ms, the frame itself, and the millisecond between two looks.
_EARLIEST_MS, _LATEST_MS = 500.0, 513.0
_QUIET_MS = 60
_WATCHDOG_MS = (900, 1100)
_TIMEOUT_REASON = 1


def _sent(stick: Stick) -> list[str]:
    return [transmissions.of_frame(frame) for frame in stick.frames]


def failsafe(context: Context) -> Iterator[Result]:
    """The link is cut, what the outputs do then, and that they come back."""
    stick = context.sticks[0]
    session = context.session
    lost_ms = ask(session, f"bench.lose({_sent(stick) * 5})")
    yield judged(
        "failsafe: time",
        f"{_EARLIEST_MS:g}..{_LATEST_MS:g} ms behind the last frame",
        "never" if lost_ms is None else f"{lost_ms:.1f} ms",
        lost_ms is not None and _EARLIEST_MS <= lost_ms <= _LATEST_MS,
    )
    # The pulse that runs is finished.
    ask(session, "bench.wait(25)")
    rose = ask(session, f"bench.wait({_QUIET_MS})")
    kept = [context.held, context.fixed]
    widths = ask(session, f"bench.widths_without_link({kept})")
    wanted = [
        servos.limited_us(stick.pulses[context.servos[context.held] - 1]),
        FIXED_PULSE / 4,
    ]
    found = [[ns / 1e3 for ns in each] for each in widths]
    pairs = list(zip(wanted, found, strict=True))
    yield judged(
        "failsafe: outputs",
        f"hold {wanted[0]:g} us, fixed {wanted[1]:g} us, no pulses at the other "
        f"{len(context.servos) - 2}",
        f"{servos.shown(found[0])}, {servos.shown(found[1])} us; "
        f"pulses at {context.names(sorted(rose))}",
        sorted(rose) == sorted(kept) and all(servos.right(*pair) for pair in pairs),
    )
    pin = max(context.servos)
    back = servos.measured_us(context, _sent(stick), [pin])[pin]
    expected = servos.limited_us(stick.pulses[context.servos[pin] - 1])
    yield judged(
        "failsafe: back",
        f"{context.name(pin)}: {expected:g} us",
        f"{servos.shown(back)} us",
        servos.right(expected, back),
    )


def watchdog(context: Context) -> Iterator[Result]:
    """The control path is stopped: the chip resets, and moves nothing by itself."""
    session = context.session
    pins = sorted(context.servos)
    code = f"print('not reset', bench.starve({_sent(context.sticks[0])}))"
    said = session.run_into_reset(code)
    low, high = _WATCHDOG_MS
    expected = f"a reset {low}..{high} ms after the control path has stopped"
    if said is None:
        yield judged("watchdog", expected, "no reset within 1.5 s", False)
        yield Result("watchdog: told", RESTARTED, "-", Verdict.SKIPPED)
        yield Result("watchdog: pins", "no edge", "-", Verdict.SKIPPED)
        return
    load(session, MODULES, context.board.mpy_arch)
    found = ask(session, f"selftest_board.restart({pins})")
    by_timeout = found["reason"] & _TIMEOUT_REASON
    after_ms = found["counted_ms"]
    yield judged(
        "watchdog",
        expected,
        f"{'time-out' if by_timeout else 'another reset'} after {after_ms} ms",
        bool(by_timeout) and low <= after_ms <= high,
    )
    yield judged(
        "watchdog: told",
        RESTARTED,
        RESTARTED if RESTARTED in said else "not said",
        RESTARTED in said,
    )
    yield judged(
        "watchdog: pins",
        "no edge at any servo pin since the reset",
        context.edges(found["rose"]),
        not found["rose"],
    )
