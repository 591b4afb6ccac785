"""What a check has found."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Verdict(Enum):
    """What becomes of a check."""

    OK = "ok"
    FAILED = "failed"
    WIRING = "wiring"
    """Something at the pins is not as the picture shows; the firmware was not put to the test."""
    SKIPPED = "skipped"
    """Needs something that another check has not found."""


@dataclass(frozen=True)
class Result:
    """One row of the table."""

    check: str
    expected: str
    measured: str
    verdict: Verdict
    hint: str = ""
    """What to do about it; one line."""


def judged(check: str, expected: str, measured: str, ok: bool, hint: str = "") -> Result:
    """A check that is all right or has failed; `hint` is for the second."""
    if ok:
        return Result(check, expected, measured, Verdict.OK)
    return Result(check, expected, measured, Verdict.FAILED, hint)
