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
    glitches: int
    """Of each width."""
    line_frames: int
    """For each wrong speed, slow edge and pause."""
    talks: int
    phases: int
    rate_frames: int
    """At each rate."""
    cpu_faults: tuple[str, ...] | None
    """Those of the software by name, resets by what they are; None: all."""
    power_cases: int
    files: int
    """Of each kind, on the host and on the unix port."""
    board_files: int
    """Of each kind; each takes the firmware a quarter of a second, emulated."""
    boots: int
    """Whole starts with each of the two files."""
    console_bytes: int
    """On the unix port."""
    serial_bytes: int
    """On the emulated board."""
    flight_s: int
    """Emulated; the emulator takes some seconds for one with this load."""
    mutations: int | None
    """How many of those of the library; None: all of all."""

    def share(self, share: float) -> Effort:
        """A share of each count; all of what has none."""
        counts = {
            name: max(1, round(share * value))
            for name, value in vars(self).items()
            if isinstance(value, int)
        }
        return Effort(**(vars(self) | counts))


LONG = Effort(
    library_bytes=10_000_000,
    wire_bytes=1_000_000,
    application_bytes=200_000,
    glitches=500,
    line_frames=40,
    talks=200,
    phases=200,
    rate_frames=100,
    cpu_faults=None,
    power_cases=6,
    files=10_000,
    board_files=10_000,
    boots=20,
    console_bytes=1_000_000,
    serial_bytes=1_000_000,
    flight_s=3600,
    mutations=None,
)
SHORT = Effort(
    library_bytes=300_000,
    wire_bytes=10_000,
    application_bytes=5_000,
    glitches=20,
    line_frames=8,
    talks=12,
    phases=12,
    rate_frames=8,
    cpu_faults=("leave", "fill", "sensor", "msp", "receiver stopped"),
    power_cases=1,
    files=500,
    board_files=2,
    boots=2,
    console_bytes=50_000,
    serial_bytes=2_000,
    flight_s=1,
    mutations=3,
)
