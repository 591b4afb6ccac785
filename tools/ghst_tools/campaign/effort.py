"""How much of each the campaign does."""

from __future__ import annotations

from dataclasses import dataclass

SEED = 1


@dataclass(frozen=True)
class Effort:
    """Counts of the trials."""

    library_bytes: int
    wire_bytes: int
    application_bytes: int


LONG = Effort(
    library_bytes=10_000_000,
    wire_bytes=1_000_000,
    application_bytes=200_000,
)
SHORT = Effort(
    library_bytes=300_000,
    wire_bytes=10_000,
    application_bytes=5_000,
)
