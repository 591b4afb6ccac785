"""A serial port with a clock of its own, for what is sent at certain times."""

from __future__ import annotations

BEGUN_S = 100.0


class PacedPort:
    """Notes when it is written to; only sleeping moves the clock, which begins at BEGUN_S."""

    def __init__(self) -> None:
        self.now_s = BEGUN_S
        self.written: list[tuple[float, bytes]] = []
        """Seconds since BEGUN_S, and what was written."""

    def clock(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds

    def write(self, data: bytes) -> None:
        self.written.append((round(self.now_s - BEGUN_S, 6), data))
