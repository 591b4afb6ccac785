"""The telemetry scheduler against an independent model, and its rates in every RF mode."""

from itertools import pairwise

import pytest
from downlink_model import Turn, Turns
from hypothesis import example, given, settings
from hypothesis import strategies as st

from ghst import protocol
from ghst.schedule import Schedule, Source, ticks_diff

thorough = settings(max_examples=400, deadline=None, derandomize=True)

KINDS = (0x23, 0x25, 0x26, 0x27)
WRAP = 2**30
"""After this many milliseconds MicroPython's clock starts again on a 32-bit port."""

durations = st.sampled_from((1, 2, 19, 50, 100, 250, 1000, 5000, 2**28))
steps = st.lists(
    st.one_of(
        st.tuples(st.just("refresh"), st.integers(0, 3)),
        st.tuples(st.just("stop"), st.integers(0, 3)),
        st.tuples(st.just("wait"), st.sampled_from((1, 2, 4, 18, 52, 100, 300, 6000))),
        st.tuples(st.just("next"), st.booleans()),
        st.tuples(st.just("next"), st.just(False)),
        st.tuples(st.just("slots"), st.integers(1, 12)),
    ),
    max_size=80,
)
starts = st.one_of(
    st.integers(0, 2**62),
    st.builds(
        lambda turns, before: max(0, turns * WRAP // 2 - before),
        st.integers(0, 5),
        st.integers(0, 5000),
    ),
)


@thorough
@given(
    sources=st.lists(st.tuples(durations, durations), max_size=4),
    steps=steps,
    start_ms=starts,
    wrap=st.sampled_from((WRAP, 2**32, 2**62)),
)
def test_any_sequence_is_as_the_model_has_it(
    sources: list[tuple[int, int]], steps: list[tuple[str, int]], start_ms: int, wrap: int
) -> None:
    schedule, model = Schedule(), Turns()
    added: list[Source] = []
    for kind, (timeout_ms, period_ms) in zip(KINDS, sources, strict=False):
        added.append(schedule.add(kind, timeout_ms, period_ms))
        model.turns.append(Turn(kind, timeout_ms, period_ms))
    now_ms = start_ms
    for what, number in steps:
        match what:
            case "wait":
                now_ms += number
            case "refresh" if number < len(added):
                added[number].refresh(now_ms % wrap)
                model.refresh(number, now_ms)
            case "stop" if number < len(added):
                added[number].stop()
                model.turns[number].live = False
            case "next" if number:
                assert schedule.next(now_ms % wrap, True) == 0x28
            case "next":
                assert schedule.next(now_ms % wrap) == model.next(now_ms)
            case "slots":
                for _ in range(number):
                    now_ms += 18
                    assert schedule.next(now_ms % wrap) == model.next(now_ms)
        assert [source.live for source in added] == [turn.live for turn in model.turns]


def fly(slots_hz: int, seconds: int, kinds: tuple[int, ...] = KINDS) -> dict[int, list[float]]:
    """Kind -> the times in ms of its frames, all sources fresh all the time; 0: empty slots."""
    schedule = Schedule()
    sources = [schedule.add(kind, timeout_ms=500) for kind in kinds]
    times: dict[int, list[float]] = {kind: [] for kind in (0, *kinds)}
    for slot in range(slots_hz * seconds):
        at_ms = 1000 * slot / slots_hz
        for source in sources:
            source.refresh(int(at_ms))
        times[schedule.next(int(at_ms))].append(at_ms)
    return times


BIDIRECTIONAL = [(name, hz) for name, hz, downlink in protocol.RF_MODES.values() if downlink]


def test_the_modes_that_carry_telemetry() -> None:
    assert BIDIRECTIONAL == [("Normal", 55), ("Race", 160), ("Long Range", 19), ("Race250", 250)]


@pytest.mark.parametrize(("name", "slots_hz"), BIDIRECTIONAL)
def test_rates_in_each_rf_mode(name: str, slots_hz: int) -> None:
    times = fly(slots_hz, seconds=20)
    empty = times.pop(0)
    if slots_hz < 40:
        # Four kinds at 10 Hz need 40 slots a second: every slot is used, each kind has a quarter.
        assert empty == []
        assert [len(sent) for sent in times.values()] == [slots_hz * 5] * 4
    else:
        assert [len(sent) for sent in times.values()] == [200] * 4
        assert len(empty) == 20 * (slots_hz - 40)
    slot_ms = 1000 / slots_hz
    for sent in times.values():
        gaps = [later - earlier for earlier, later in pairwise(sent)]
        # In its turn: at most the three others before it.
        assert max(gaps) < max(100, 4 * slot_ms) + 4 * slot_ms
        assert min(gaps) > 100 - 4 * slot_ms


@pytest.mark.parametrize("count", [1, 2, 3])
def test_fewer_sources_share_the_slots_of_long_range(count: int) -> None:
    times = fly(19, seconds=20, kinds=KINDS[:count])
    each = {1: 200, 2: 190, 3: 127}[count]
    found = [len(times[kind]) for kind in KINDS[:count]]
    assert max(found) == each
    assert max(found) - min(found) <= 1


@settings(max_examples=80, deadline=None, derandomize=True)
@given(periods=st.lists(st.integers(1, 2000), min_size=2, max_size=6), slot_ms=st.integers(2, 60))
@example(periods=[1, 1, 1, 1, 1, 2000], slot_ms=60)
def test_no_kind_is_ever_left_out(periods: list[int], slot_ms: int) -> None:
    """Whatever the others want: once due, at most two slots for each other kind go by."""
    schedule = Schedule()
    sources = [
        schedule.add(0x40 + place, 1000, period_ms) for place, period_ms in enumerate(periods)
    ]
    last = dict.fromkeys(range(len(periods)), 0)
    for now_ms in range(0, 8000, slot_ms):
        for source in sources:
            source.refresh(now_ms)
        kind = schedule.next(now_ms)
        if kind:
            last[kind - 0x40] = now_ms
        for place, at_ms in last.items():
            waited_ms = now_ms - at_ms - periods[place]
            assert waited_ms <= 2 * len(periods) * slot_ms


@given(start=st.integers(0, 2**64), step=st.integers(-(2**29), 2**29 - 1))
@settings(deadline=None, derandomize=True)
def test_differences_of_any_times(start: int, step: int) -> None:
    for wrap in (WRAP, 2**32, 2**62, 2**65):
        assert ticks_diff((start + step) % wrap, start % wrap) == step
