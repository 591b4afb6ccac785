"""What a trial of the campaign gives: a row of the report, or a failing case."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Row:
    """One fault: what was done to the firmware, and what happened."""

    fault: str
    done: str
    happened: str


Trial = Callable[[], list[Row]]


Case = dict[str, Any]
"""What makes something happen again, as JSON has it (`cases`)."""


class Wrong(Exception):
    """Something happened that must not.

    `case` is to make it happen again; `wider` are larger ones, for when that is not enough, and
    `counts` those of the trial's effort with which it ends there.
    """

    def __init__(self, text: str, case: Case | None = None) -> None:
        super().__init__(text)
        self.case = case
        self.wider: list[Case] = []
        self.counts: dict[str, int] = {}


def expect(right: bool, text: str, case: Case | None = None) -> None:
    """Raise Wrong with `text` unless `right`."""
    if not right:
        raise Wrong(text, case)


def equal(found: object, wanted: object, what: str, case: Case | None = None) -> None:
    """Raise Wrong, naming both, unless they are equal."""
    expect(found == wanted, f"{what}: {found!r}, must be {wanted!r}", case)
