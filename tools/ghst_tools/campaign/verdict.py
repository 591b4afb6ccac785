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


class Wrong(Exception):
    """Something happened that must not; `case` is what makes it happen again (`cases`)."""

    def __init__(self, text: str, case: dict[str, Any] | None = None) -> None:
        super().__init__(text)
        self.case = case


def expect(right: bool, text: str, case: dict[str, Any] | None = None) -> None:
    """Raise Wrong with `text` unless `right`."""
    if not right:
        raise Wrong(text, case)


def equal(found: object, wanted: object, what: str, case: dict[str, Any] | None = None) -> None:
    """Raise Wrong, naming both, unless they are equal."""
    expect(found == wanted, f"{what}: {found!r}, must be {wanted!r}", case)
