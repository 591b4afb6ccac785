"""Faults of time: links that end anywhere, rates that change, clocks that wrap."""

from __future__ import annotations

import random
from collections.abc import Iterator
from functools import partial
from itertools import pairwise

from ghst import decoder  # type: ignore[import-not-found]
from ghst_tools.campaign.line import (
    FAILSAFE_LIMIT_NS,
    FAILSAFE_NS,
    still,
)
from ghst_tools.campaign.outputs import Outputs, moving, moving_link
from ghst_tools.campaign.pico import NO_SENSORS, Pico
from ghst_tools.campaign.picos import connect_battery, forked, no_exception
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Row, Trial, equal, expect
from ghst_tools.emulator.wire import BAUD
from ghst_tools.uart_bits import encode

_PERIOD_NS = 4e6
_SLOWEST_HZ, _FASTEST_HZ = 19.0, 500.0
_RATES_HZ = (19, 50, 55, 150, 160, 250, 333, 500)
_TIMER_HIGH, _TIMER_LOW = 0x40054024, 0x40054028  # without a latch
_APPLICATION_HZ = 250
_SETTLING_US, _BEFORE_US, _BEHIND_US = 700_000, 500_000, 500_000
_TELEMETRY_MS = 400
CONFIGURATION = NO_SENSORS | {"battery": {"enabled": True}}
READY = b"sensors: battery"


def loss(pico: Pico, outputs: Outputs, phase: float, first: int) -> float:
    """End the link at `phase` 0..1 of a frame's period; the delay of failsafe in ns.

    `first`: which frame it begins with.
    """
    failsafes = pico.control("FAILSAFES")
    receiver = pico.fly(lambda index, t: moving(first + index), 1e9 / _PERIOD_NS)
    fourth = pico.at(1e6) + 3 * _PERIOD_NS
    receiver.stop_at(fourth + phase * _PERIOD_NS)
    pico.board.run_for(20e6)
    at = f"a link that ended at {phase:.3f} of a frame's period"
    # Whole as soon as nothing is left of it but a line that is high.
    levels, end = encode(moving(first + 3), fourth, BAUD)
    whole = fourth + phase * _PERIOD_NS >= levels[-1][0]
    last = end if whole else end - _PERIOD_NS
    for before in (3, 2, 1, 0) if whole else (3, 2, 1):
        outputs.frame(end - before * _PERIOD_NS, moving(first + 3 - before))
    equal(pico.pulses(), outputs.model.pulses, f"{at}: channels")
    pico.board.run_for(125e6)
    equal(pico.control("FAILSAFES"), failsafes + 1, f"{at}: failsafes")
    delay = pico.compares[-1].t_ns - last
    outputs.failsafe(last + FAILSAFE_NS, last + FAILSAFE_LIMIT_NS)
    pico.board.run_for(20e6)
    outputs.check(at)
    return delay


def losses(pico: Pico, count: int) -> str:
    """The link ends at `count` phases of a frame's period, one after the other."""
    outputs = Outputs(pico)
    delays = [loss(pico, outputs, index / count, 5 * index) / 1e6 for index in range(count)]
    no_exception(pico)
    return (
        f"no part of a frame is seen at the outputs, {outputs.shown()}; failsafe "
        f"{min(delays):.1f} to {max(delays):.1f} ms after the last whole frame, at 110 ms and the "
        "next ticks; then no pulse; the link comes back each time"
    )


def _fly(pico: Pico, periods_ns: list[float]) -> str:
    outputs = Outputs(pico)
    start = pico.at(1e6)
    for index, period in enumerate(periods_ns):
        frame = moving(index)
        outputs.frame(pico.wire.send(frame, start), frame)
        start += period
        pico.board.run_for(start - 50e3 - pico.board.now_ns)
    count = len(periods_ns)
    equal(pico.word(decoder.FRAMES), count, "frames decoded")
    equal(pico.word(decoder.SKIPPED_BYTES), 0, "bytes skipped")
    equal(pico.control("FAILSAFES"), 0, "failsafes")
    outputs.finish()
    no_exception(pico)
    return f"all {count} frames decoded and written to the outputs, {outputs.shown()}; no failsafe"


def changing(pico: Pico, count: int, seed: int) -> str:
    """Frames at rates that change with every frame."""
    rng = random.Random(seed)
    return _fly(pico, [1e9 / rng.uniform(_SLOWEST_HZ, _FASTEST_HZ) for _ in range(count)])


def steady(pico: Pico, count: int) -> str:
    """Frames at each rate in turn."""
    return _fly(pico, [1e9 / rate for rate in _RATES_HZ for _ in range(count)])


def wrap(pico: Pico, bits: int) -> str:
    """Fly over the moment at which the microsecond clock passes 2 to the power of `bits`."""
    pico.board.advance_timer((1 << bits) - 100_000 - pico.board.read32(_TIMER_LOW))
    outputs = Outputs(pico)
    receiver = pico.fly(lambda index, t: moving(index), 250)
    pico.board.run_for(220e6)
    clock = pico.board.read32(_TIMER_LOW)
    expect(100_000 < (clock - (1 << bits)) % 2**32 < 200_000, f"the clock stands at {clock}")
    receiver.stop()
    pico.board.run_for(5e6)
    count = outputs.frames(receiver.sent)
    equal(count, len(receiver.sent), "frames that are complete")
    equal(pico.control("FAILSAFES"), 0, "failsafes")
    last = receiver.sent[-1].end_ns
    pico.board.run_for(140e6)
    outputs.failsafe(last + FAILSAFE_NS, last + FAILSAFE_LIMIT_NS)
    outputs.finish()
    no_exception(pico)
    return (
        f"all {count} frames across it written to the outputs, {outputs.shown()}; no failsafe; "
        "afterwards failsafe as ever"
    )


def application_wrap(pico: Pico, at_us: int) -> str:
    """Fly the whole application over the moment at which the microsecond clock is `at_us`."""
    connect_battery(pico)
    clock = pico.board.read32(_TIMER_HIGH) << 32 | pico.board.read32(_TIMER_LOW)
    pico.board.advance_timer(at_us - _SETTLING_US - _BEFORE_US - clock)
    wraps_ns = pico.at((_SETTLING_US + _BEFORE_US) * 1e3)
    # Whatever waits for a time has seen the clock jump.
    pico.board.run_for(_SETTLING_US * 1e3)
    outputs = Outputs(pico)
    receiver = pico.fly(
        lambda index, t: moving(index) if index % 4 else moving_link(index), _APPLICATION_HZ
    )
    pico.board.run_for(wraps_ns + _BEHIND_US * 1e3 - pico.board.now_ns)
    clock = pico.board.read32(_TIMER_HIGH) << 32 | pico.board.read32(_TIMER_LOW)
    expect(clock > at_us, f"the clock stands at {clock} us")
    receiver.stop()
    pico.board.run_for(5e6)
    count = outputs.frames(receiver.sent)
    equal(count, len(receiver.sent), "frames that are complete")
    outputs.finish()
    told = [frame.t_ns - wraps_ns for frame in receiver.downlink]
    for frame in receiver.downlink:
        right = frame.ok and frame.after_ns is not None and 990e3 < frame.after_ns < 1010e3
        expect(right, f"telemetry {frame.after_ns} ns behind a frame")
    equal(receiver.noise, [], "bytes that are no telemetry frame")
    before, behind = sum(t < 0 for t in told), sum(t > 0 for t in told)
    expect(min(before, behind) >= 2, f"telemetry frames before and behind: {before}, {behind}")
    longest = max(later - sooner for sooner, later in pairwise(told)) / 1e6
    expect(longest < _TELEMETRY_MS, f"{longest} ms without telemetry")
    no_exception(pico)
    said = pico.reply_to_enter()
    for words in ("stood still 0 times", "failsafes 0", "0 collisions", "battery: 16.50 V"):
        expect(words in said, f"the board says {said}")
    no_exception(pico)
    return (
        f"all {count} control frames written to the outputs, {outputs.shown()}; "
        f"{before} telemetry frames before it and {behind} behind it, each in its slot, at most "
        f"{longest:.0f} ms apart; no failsafe, no fault, no reset; the console answers and has "
        "the battery's voltage"
    )


def trials(setting: Setting) -> Iterator[tuple[str, Trial]]:
    """The trials, by name."""
    effort = setting.effort
    acts = [
        (
            "link lost",
            f"at {effort.phases} phases of a frame's period of 4 ms",
            partial(losses, count=effort.phases),
        ),
        (
            "rates",
            f"{', '.join(map(str, _RATES_HZ))} Hz, {effort.rate_frames} frames each",
            partial(steady, count=effort.rate_frames),
        ),
        (
            "changing rate",
            f"another one of 19 to 500 Hz for each of {4 * effort.rate_frames} frames",
            partial(changing, count=4 * effort.rate_frames, seed=setting.seed),
        ),
    ]
    acts += [
        ("clock wraps", f"in flight, at 2^{bits} us", partial(wrap, bits=bits))
        for bits in (30, 31, 32)
    ]
    for fault, done, act in acts:

        def run(fault: str = fault, done: str = done, act: partial[str] = act) -> list[Row]:
            pico = still(setting.picos)
            return [Row(fault, done, forked(lambda: act(pico)))]

        yield f"{fault}, {done}", run

    for name, at_us in (
        *((f"2^{bits} us", 1 << bits) for bits in (30, 31, 32)),
        ("2^30 ms, where MicroPython's own clock wraps", 1000 << 30),
    ):

        def fly(name: str = name, at_us: int = at_us) -> list[Row]:
            pico = setting.picos.boot(CONFIGURATION, READY)
            happened = forked(lambda: application_wrap(pico, at_us))
            return [Row("clock wraps, whole application", f"in flight, at {name}", happened)]

        yield f"clock wraps, whole application, at {name}", fly
