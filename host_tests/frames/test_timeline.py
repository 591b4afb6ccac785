"""When bytes were on the wire, and the distances that can be told from reads."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ghst_tools.campaign.model import control, frame
from ghst_tools.frames.blocks import Block
from ghst_tools.frames.stream import Stream
from ghst_tools.frames.timeline import Reads, Timeline

BYTE_S = 10 / 420000
FRAME_S = 14 * BYTE_S
CONTROL = control(0x13, (1984,) * 4, (100, 60, 10, 20))
DOWN = frame(0x89, 0x23, bytes(10))


def reads(*found: tuple[float, int]) -> Reads:
    """Reads of so many bytes at these times."""
    return Reads(np.cumsum([size for _, size in found]), np.array([time_s for time_s, _ in found]))


def stream(*found: tuple[float, bytes]) -> Stream:
    """A stream that has taken these reads, each in a block of its own."""
    made = Stream(420000)
    for time_s, data in found:
        made.feed(Block(data, reads((time_s, len(data)))))
    made.finish()
    return made


def test_bytes_of_a_read_end_with_it() -> None:
    timeline = Timeline(420000)
    begins_s = timeline.add(reads((0.5, 14), (0.7, 2)))
    assert begins_s.tolist() == pytest.approx([0.5 - FRAME_S, 0.7 - 2 * BYTE_S])
    times = timeline.times(np.array([0, 13, 15]), np.array([13, 15, 16]))
    assert times.begins_s.tolist() == pytest.approx([0.5 - FRAME_S, 0.5 - BYTE_S, 0.7 - BYTE_S])
    assert times.ends_s.tolist() == pytest.approx([0.5 - BYTE_S, 0.7 - BYTE_S, 0.7])
    assert times.first_reads.tolist() == [0, 0, 1]
    assert times.last_reads.tolist() == [0, 1, 1]


def test_the_baud_rate_gives_the_time_of_a_byte() -> None:
    timeline = Timeline(10000)
    assert timeline.add(reads((1.0, 100))).tolist() == pytest.approx([0.9])


@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    gaps_us=st.lists(st.integers(0, 2000), min_size=1, max_size=30),
    sizes=st.lists(st.integers(1, 40), min_size=30, max_size=30),
    cut=st.integers(0, 30),
)
def test_bytes_never_overlap_whatever_the_reads(
    gaps_us: list[int], sizes: list[int], cut: int
) -> None:
    times_s = np.cumsum(gaps_us) / 1e6
    found = list(zip(times_s.tolist(), sizes, strict=False))
    whole, parts = Timeline(420000), Timeline(420000)
    begins_s = whole.add(reads(*found))
    ends_s = begins_s + [size * BYTE_S for _, size in found]
    assert np.all(begins_s[1:] >= ends_s[:-1] - 1e-12)
    assert np.all(ends_s >= times_s - 1e-12)
    # In two parts, and with what is behind forgotten, it is the same.
    first = parts.add(reads(*found[:cut])) if found[:cut] else np.zeros(0)
    parts.forget(sum(size for _, size in found[: min(cut, len(found)) // 2]))
    second = parts.add(reads(*found[cut:])) if found[cut:] else np.zeros(0)
    assert np.concatenate([first, second]).tolist() == pytest.approx(begins_s.tolist())
    total = sum(size for _, size in found)
    last = np.array([total - 1])
    assert parts.times(last, last + 1).last_reads.tolist() == [len(found) - 1]


def test_intervals_and_slots() -> None:
    made = stream(
        (0.1, CONTROL), (0.1 + 0.001 + FRAME_S, DOWN), (0.104, CONTROL), (0.109, CONTROL)
    )
    assert list(made.timing.intervals_us) == pytest.approx([4000, 5000])
    assert list(made.timing.slots_us) == pytest.approx([1000])
    assert made.timing.lines() == [
        "control frame to control frame: 4500 us in the median, 4000 to 5000 us, 2 measured",
        "control frame to telemetry: 1000 us in the median, 1000 to 1000 us, 1 measured",
    ]


def test_what_came_in_one_read_has_no_distance() -> None:
    made = stream((0.1, CONTROL + DOWN + CONTROL), (0.104, CONTROL))
    assert list(made.timing.intervals_us) == pytest.approx([4000])
    assert list(made.timing.slots_us) == []
    assert (made.timing.intervals_unknown, made.timing.slots_unknown) == (1, 1)
    assert made.timing.lines() == [
        "control frame to control frame: 4000 us in the median, 4000 to 4000 us, 1 measured, "
        "1 came in one read: not measured",
        "control frame to telemetry: 1 came in one read: not measured",
    ]


def test_a_frame_that_was_split_ends_with_its_second_read() -> None:
    made = stream((0.1, CONTROL[:9]), (0.1005, CONTROL[9:]), (0.1045, CONTROL))
    assert list(made.timing.intervals_us) == pytest.approx([4000])


def test_telemetry_behind_anything_else_is_in_no_slot() -> None:
    slot_s = 0.001 + FRAME_S
    made = stream((0.1, CONTROL), (0.1 + slot_s, DOWN), (0.102 + slot_s, DOWN))
    assert len(made.timing.slots_us) == 1
    made = stream((0.1, CONTROL), (0.101, b"\x00"), (0.102, DOWN))
    assert (len(made.timing.slots_us), made.timing.slots_unknown) == (0, 0)


def test_a_stream_without_times_has_no_timing() -> None:
    made = Stream(420000)
    assert made.feed(Block(CONTROL))[1] is None
    assert made.timing.lines() == []
