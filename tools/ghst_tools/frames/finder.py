"""Cuts a stream of bytes into GHST frames, damaged frames and garbage.

The same frames as the library's decoder finds, and the same counters, for recordings of hours; the
tests compare them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ghst_tools.frames.counters import Counters
from ghst_tools.frames.scan import Integers, Octets, Scan, is_address, scan

# What a piece of the stream is.
FRAME = 0
"""A valid frame: address, length and CRC are right."""
DAMAGED = 1
"""Address and length are those of a frame, but its CRC is wrong, and no valid frame is inside."""
GARBAGE = 2
"""Bytes that belong to no frame."""
UNFINISHED = 3
"""The beginning of a frame at the end of the stream."""

LONGEST_GARBAGE = 4096
"""Garbage is reported in pieces of at most this many bytes: it does not wait for its end."""


@dataclass(frozen=True)
class Pieces:
    """A stretch of the stream, cut into pieces without gaps.

    Piece `i` is `data[starts[i]:starts[i + 1]]`, the last one reaches to the end; `verdicts[i]` is
    FRAME, DAMAGED, GARBAGE or UNFINISHED. `offset` is where `data` begins in the stream.
    """

    data: bytes
    offset: int
    starts: Integers
    verdicts: Octets

    @property
    def stops(self) -> Integers:
        """Where each piece ends."""
        return np.append(self.starts, len(self.data))[1:]


class Finder:
    """Takes the bytes of a stream in chunks of any size."""

    def __init__(self) -> None:
        self.counters = Counters()
        self._held = b""
        self._offset = 0
        self._scanned = 0

    def feed(self, data: bytes) -> Pieces:
        """Take received bytes; returns the pieces that are certain now, none of them UNFINISHED.

        Whatever the chunks, all pieces together are the same.
        """
        buffer = self._held + data
        found = scan(buffer, self._scanned)
        self.counters.add(buffer, found, self._scanned)
        pieces = _Pieces()
        end = self._cut(found, pieces)
        end = pieces.wrong(end, found.position, found, final=False)
        self._scanned = found.position - end
        return self._give(buffer, end, pieces)

    def finish(self) -> Pieces:
        """The stream is over: returns the pieces that waited for more."""
        buffer, pieces = self._held, _Pieces()
        found = scan(buffer, self._scanned)
        unfinished = self._scanned
        if unfinished < len(buffer) and not is_address(buffer[unfinished]):
            unfinished = len(buffer)
        # No other frame can come: a damaged one may reach into what was waiting.
        end = pieces.wrong(0, len(buffer), found, final=True)
        if end < unfinished:
            pieces.garbage(end, unfinished)
            end = unfinished
        if end < len(buffer):
            rest_is_frame = end == unfinished
            pieces.add(end, UNFINISHED if rest_is_frame else GARBAGE)
        self._scanned = 0
        return self._give(buffer, len(buffer), pieces)

    def _cut(self, found: Scan, pieces: _Pieces) -> int:
        """Append the frames and what is between them; returns where the last frame ends."""
        if not len(found.starts):
            return 0
        before = np.concatenate(([0], found.stops[:-1]))
        done = 0
        for index in np.flatnonzero(found.starts > before).tolist():
            pieces.frames(found.starts[done:index])
            start, stop = int(before[index]), int(found.starts[index])
            end = pieces.wrong(start, stop, found, final=True)
            pieces.garbage(end, stop)
            done = index
        pieces.frames(found.starts[done:])
        return int(found.stops[-1])

    def _give(self, buffer: bytes, end: int, pieces: _Pieces) -> Pieces:
        given = Pieces(buffer[:end], self._offset, *pieces.arrays())
        self._held = buffer[end:]
        self._offset += end
        return given


class _Pieces:
    """Pieces in the making."""

    def __init__(self) -> None:
        self._starts: list[Integers] = []
        self._verdicts: list[Octets] = []

    def frames(self, starts: Integers) -> None:
        self._starts.append(starts)
        self._verdicts.append(np.zeros(len(starts), np.uint8))

    def add(self, start: int, verdict: int) -> None:
        self._starts.append(np.array([start], np.int64))
        self._verdicts.append(np.array([verdict], np.uint8))

    def garbage(self, start: int, stop: int) -> None:
        for at in range(start, stop, LONGEST_GARBAGE):
            self.add(at, GARBAGE)

    def wrong(self, start: int, stop: int, found: Scan, *, final: bool) -> int:
        """Append the damaged frames of the garbage in `start:stop` with what is before each.

        Returns where they end. Unless this is `final`, what may still become part of a damaged
        frame is left, and what is longer than LONGEST_GARBAGE is not.
        """
        first, last = np.searchsorted(found.wrong, (start, stop))
        undecided = stop
        for at, end in zip(
            found.wrong[first:last].tolist(), found.wrong_stops[first:last].tolist(), strict=True
        ):
            if at < start:
                continue
            if end > stop:
                if final:
                    continue
                undecided = at
                break
            self.garbage(start, at)
            self.add(at, DAMAGED)
            start = end
        while not final and undecided - start >= LONGEST_GARBAGE:
            self.add(start, GARBAGE)
            start += LONGEST_GARBAGE
        return start

    def arrays(self) -> tuple[Integers, Octets]:
        if not self._starts:
            return np.zeros(0, np.int64), np.zeros(0, np.uint8)
        return np.concatenate(self._starts), np.concatenate(self._verdicts)
