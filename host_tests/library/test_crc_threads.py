"""`crc8` called by several threads at once, as a program with a thread for its port does."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest

import ghst

FRAMES = [bytes(range(first, first + 12)) for first in range(0, 200, 7)]


@pytest.fixture
def switches_often() -> Iterator[None]:
    """Threads take turns after a few instructions."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def test_threads_do_not_disturb_each_other(switches_often: None) -> None:
    alone = [ghst.crc8(frame, 0, length) for frame in FRAMES for length in (12, 3)]

    def again(_: int) -> bool:
        return [ghst.crc8(frame, 0, length) for frame in FRAMES for length in (12, 3)] == alone

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(again, range(60)))
