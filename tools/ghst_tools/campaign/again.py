"""Cases with what there was before them, for what goes wrong only behind it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from ghst_tools.campaign.verdict import Case, Wrong

Block = TypeVar("Block")

EARLIER = (1, 7, 31)
"""How many blocks before a failing one are tried, one after the other."""


def blocks_of(case: Case) -> list[Case]:
    """The blocks of a saved case in their order, each a case; the last is the one that failed."""
    return [*case.get("before", []), case]


@contextmanager
def among(
    blocks: Iterable[Block], case_of: Callable[[Block], tuple[Case, int]], count: str
) -> Iterator[None]:
    """Give a Wrong whose case is one of `blocks` the cases with what there was before it.

    `blocks` are made anew; `case_of`: a block as a case, and its bytes. `count`: which count of
    the effort says how many bytes there are, so that the trial can be done again up to there.
    """
    try:
        yield
    except Wrong as wrong:
        before: deque[Case] = deque(maxlen=max(EARLIER))
        total = 0
        for block in blocks:
            case, size = case_of(block)
            total += size
            if case == wrong.case:
                wrong.wider = with_earlier(case, list(before))
                wrong.counts = {count: total}
                break
            before.append(case)
        raise


def with_earlier(case: Case, before: list[Case]) -> list[Case]:
    """The case with some of the blocks before it, and with more."""
    lengths = sorted({min(length, len(before)) for length in EARLIER} - {0})
    return [case | {"before": before[-length:]} for length in lengths]
