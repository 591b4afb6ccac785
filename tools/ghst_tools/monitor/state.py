"""What the status lines of a board tell together: the newest values, and rates."""

from __future__ import annotations

from collections import deque
from typing import Any

from ghst.protocol import RF_MODES  # type: ignore[import-not-found]

_COUNTER_MASK = 0x3FFFFFFF  # of every counter on the board, and of its clock
_WINDOW_MS = 1000
HIGH_US = 2200.0
"""The longest pulse of a servo: what is longer is a pin that is high all the time."""

ERRORS = ("crc_errors", "length_errors", "skipped_bytes", "unknown_frames", "foreign_frames")
SENSORS = ("battery", "gps", "barometer", "magnetometer")


class State:
    """The newest status of a board, and its frames per second over the last second."""

    def __init__(self) -> None:
        self.status: dict[str, Any] = {}
        self.lines = 0
        self._samples: deque[tuple[int, int]] = deque()

    def add(self, status: dict[str, Any]) -> None:
        """Take a line of the kind "status"."""
        time_ms, frames = int(status["time_ms"]), int(status["frames"])
        if self.status and frames < int(self.status["frames"]):
            self._samples.clear()  # the board has started anew, or its counter has
        self.status = status
        self.lines += 1
        self._samples.append((time_ms, frames))
        while len(self._samples) > 2 and _since(self._samples[1][0], time_ms) >= _WINDOW_MS:
            self._samples.popleft()

    @property
    def frame_rate_hz(self) -> float | None:
        """Control frames per second; None before two lines have come."""
        if len(self._samples) < 2:
            return None
        (begin_ms, before), (end_ms, after) = self._samples[0], self._samples[-1]
        elapsed_ms = _since(begin_ms, end_ms)
        return 1000 * (after - before) / elapsed_ms if elapsed_ms else None

    @property
    def rf_mode(self) -> str:
        """The name of the RF mode."""
        number = self.status.get("rf_mode") or 0
        if not number:
            return "RF mode not known yet"
        return str(RF_MODES[number][0]) if number in RF_MODES else f"RF mode {number}"

    @property
    def downlink(self) -> bool | None:
        """Whether the RF mode carries telemetry; None if it is not known."""
        number = self.status.get("rf_mode") or 0
        if self.status.get("telemetry_requested"):
            return True
        return bool(RF_MODES[number][2]) if number in RF_MODES else None


def _since(before_ms: int, now_ms: int) -> int:
    return (now_ms - before_ms) & _COUNTER_MASK
