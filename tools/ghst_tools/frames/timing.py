"""The rhythm of the wire: time between control frames, and from them to the telemetry."""

from __future__ import annotations

from array import array

import numpy as np

from ghst_tools.frames import columns
from ghst_tools.frames.finder import Pieces
from ghst_tools.frames.timeline import Times


class Timing:
    """Gathers distances in microseconds.

    `intervals_us`: from the end of a control frame to the end of the next; `slots_us`: from the
    end of a control frame to the beginning of the downlink frame that follows it. What came in
    one read has no measured distance; it is counted in `intervals_unknown` and `slots_unknown`.
    """

    def __init__(self) -> None:
        self.intervals_us = array("d")
        self.slots_us = array("d")
        self.intervals_unknown = 0
        self.slots_unknown = 0
        # The last control frame: its end, its read, and whether nothing came behind it.
        self._end_s: float | None = None
        self._read = -1
        self._was_last = False

    def add(self, pieces: Pieces, times: Times) -> None:
        """Take the next pieces of the stream."""
        if not len(pieces.starts):
            return
        is_control = columns.control(pieces)
        self._add_slots(times, is_control, columns.downlink(pieces))
        self._was_last = bool(is_control[-1])
        frames = np.flatnonzero(is_control)
        if not len(frames):
            return
        ends_s, reads = times.ends_s[frames], times.last_reads[frames]
        if self._end_s is not None:
            ends_s = np.insert(ends_s, 0, self._end_s)
            reads = np.insert(reads, 0, self._read)
        known = np.diff(reads) > 0
        self.intervals_us.extend((np.diff(ends_s)[known] * 1e6).tolist())
        self.intervals_unknown += int(np.sum(~known))
        self._end_s, self._read = float(ends_s[-1]), int(reads[-1])

    def lines(self) -> list[str]:
        """One line for each kind of distance there is."""
        found = []
        for what, distances_us, unknown in (
            ("control frame to control frame", self.intervals_us, self.intervals_unknown),
            ("control frame to telemetry", self.slots_us, self.slots_unknown),
        ):
            if not distances_us and not unknown:
                continue
            text = f"{what}: "
            if distances_us:
                text += (
                    f"{np.median(distances_us):.0f} us in the median, {min(distances_us):.0f} to "
                    f"{max(distances_us):.0f} us, {len(distances_us)} measured"
                )
            if unknown:
                text += f"{', ' if distances_us else ''}{unknown} came in one read: not measured"
            found.append(text)
        return found

    def _add_slots(self, times: Times, is_control: columns.Mask, is_down: columns.Mask) -> None:
        ends_s = np.insert(times.ends_s[:-1], 0, self._end_s or 0.0)
        reads = np.insert(times.last_reads[:-1], 0, self._read)
        after_control = is_down & np.insert(is_control[:-1], 0, self._was_last)
        known = after_control & (times.first_reads > reads)
        self.slots_us.extend(((times.begins_s - ends_s)[known] * 1e6).tolist())
        self.slots_unknown += int(np.sum(after_control & ~known))
