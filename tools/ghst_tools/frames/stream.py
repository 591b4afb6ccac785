"""A recording as pieces with their times, and the counts of what was in it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from ghst.protocol import FRAME_LENGTH  # type: ignore[import-not-found]
from ghst_tools.frames import kinds
from ghst_tools.frames.blocks import Block
from ghst_tools.frames.counters import Counters
from ghst_tools.frames.finder import DAMAGED, FRAME, GARBAGE, UNFINISHED, Finder, Pieces
from ghst_tools.frames.timeline import Timeline, Times
from ghst_tools.frames.timing import Timing


@dataclass
class Summary:
    """Counts of pieces."""

    frames: Counter[tuple[int, int, bool]] = field(default_factory=Counter)
    """Valid frames by address, type, and whether their length is the usual one."""
    damaged: int = 0
    garbage_pieces: int = 0
    garbage_bytes: int = 0
    unfinished_bytes: int = 0
    bytes: int = 0

    def add(self, pieces: Pieces) -> None:
        """Count what is in `pieces`."""
        octets = np.frombuffer(pieces.data, np.uint8)
        sizes = pieces.stops - pieces.starts
        self.bytes += len(pieces.data)
        at = pieces.starts[pieces.verdicts == FRAME]
        whole = octets[at + 1] == FRAME_LENGTH
        keys = octets[at].astype(np.int64) << 16 | octets[at + 2].astype(np.int64) << 8 | whole
        for key, count in zip(*np.unique(keys, return_counts=True), strict=True):
            self.frames[int(key) >> 16, int(key) >> 8 & 0xFF, bool(key & 1)] += int(count)
        garbage = pieces.verdicts == GARBAGE
        self.damaged += int(np.sum(pieces.verdicts == DAMAGED))
        self.garbage_pieces += int(np.sum(garbage))
        self.garbage_bytes += int(np.sum(sizes[garbage]))
        self.unfinished_bytes += int(np.sum(sizes[pieces.verdicts == UNFINISHED]))

    def leftovers(self) -> str:
        """What was no valid frame, in one line."""
        text = (
            f"{_many(self.damaged, 'damaged frame')}, {_many(self.garbage_bytes, 'byte')} of "
            f"garbage in {_many(self.garbage_pieces, 'piece')}"
        )
        if self.unfinished_bytes:
            text += f", {_many(self.unfinished_bytes, 'byte')} of an unfinished frame"
        return text

    def lines(self, counters: Counters) -> list[str]:
        """What to print at the end; `counters`: what a receiver would have counted."""
        found = [
            f"{_many(sum(self.frames.values()), 'valid frame')} in {_many(self.bytes, 'byte')}"
        ]
        for (address, kind, whole), count in sorted(self.frames.items()):
            title = kinds.title(kinds.name(address, kind))
            text = f"{count:9d}  {kinds.direction(address):<4}  0x{kind:02x}  {title}"
            text += "" if address in kinds.ENDS else f", to 0x{address:02x}"
            found.append(text + ("" if whole else ", of a wrong length"))
        found.append(self.leftovers())
        counts = ", ".join(f"{name} {count}" for name, count in counters.lines() if count)
        found.append(f"a receiver's counters: {counts or 'all 0'}")
        return found


def _many(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


class Stream:
    """Cuts blocks into pieces, with their times if the blocks have any, and counts them."""

    def __init__(self, baud: int) -> None:
        self.finder = Finder()
        self.timeline = Timeline(baud)
        self.summary = Summary()
        self.timing = Timing()
        self._timed = True

    def feed(self, block: Block) -> tuple[Pieces, Times | None]:
        """Take a block; returns what it completes, and when that was on the wire."""
        if block.reads is None:
            self._timed = self._timed and not block.data
        else:
            self.timeline.add(block.reads)
        return self._with_times(self.finder.feed(block.data))

    def finish(self) -> tuple[Pieces, Times | None]:
        """There is no more: returns what waited for it."""
        return self._with_times(self.finder.finish())

    def lines(self) -> list[str]:
        """What to print at the end."""
        return self.summary.lines(self.finder.counters) + self.timing.lines()

    def _with_times(self, pieces: Pieces) -> tuple[Pieces, Times | None]:
        self.summary.add(pieces)
        if not self._timed:
            return pieces, None
        times = self.timeline.times(pieces.offset + pieces.starts, pieces.offset + pieces.stops)
        self.timing.add(pieces, times)
        self.timeline.forget(pieces.offset + len(pieces.data))
        return pieces, times
