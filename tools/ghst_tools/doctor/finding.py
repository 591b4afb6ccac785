"""What was found, and what to do about it."""

from __future__ import annotations

from dataclasses import dataclass

GOOD = "ok"
HINT = "hint"
"""Nothing is broken: something that only some need is not there."""
WRONG = "WRONG"


@dataclass(frozen=True)
class Finding:
    """One line: what it is about, how it is, and the next step if there is one."""

    level: str
    subject: str
    text: str
    step: str = ""

    def __str__(self) -> str:
        step = f": {self.step}" if self.step else ""
        return f"{self.level:5}  {self.subject}: {self.text}{step}"
