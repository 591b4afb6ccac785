"""When the bytes of a stream were on the wire, from the times at which they were read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ghst.protocol import BAUD_RATE  # type: ignore[import-not-found]
from ghst_tools.frames.scan import Integers

Seconds = NDArray[np.float64]


@dataclass(frozen=True)
class Reads:
    """The reads that some bytes came in.

    `ends`: for each read where it ends among these bytes; `times_s`: when its last byte was there,
    never decreasing.
    """

    ends: Integers
    times_s: Seconds


@dataclass(frozen=True)
class Times:
    """When some pieces of the stream were on the wire.

    `begins_s`: the start bit of the first byte of each; `ends_s`: the end of the stop bit of its
    last byte; `first_reads`, `last_reads`: the numbers of the reads in which those bytes came. Of
    two pieces the distance is measured only if a new read began between them.
    """

    begins_s: Seconds
    ends_s: Seconds
    first_reads: Integers
    last_reads: Integers


class Timeline:
    """Knows when each byte began: those of one read came back to back, before its time.

    That is the best guess. It is right for a read that brought one burst, without a delay; an
    operating system hands over what has gathered meanwhile (`docs/tools.md`).
    """

    def __init__(self, baud: int = BAUD_RATE) -> None:
        self.byte_s = 10 / baud  # start bit, eight data bits, stop bit
        self._stops = np.zeros(0, np.int64)  # in the stream
        self._ends_s = np.zeros(0)
        self._forgotten = 0
        self._length = 0
        self._end_s = 0.0  # nobody listened before

    def add(self, reads: Reads) -> Seconds:
        """Take the reads that follow in the stream; returns when the first byte of each began."""
        if not len(reads.ends):
            return np.zeros(0)
        lengths = np.diff(reads.ends, prepend=0) * self.byte_s
        # A byte takes its time: a read ends no earlier than the one before and its own bytes.
        passed = np.cumsum(lengths)
        ends_s = passed + np.maximum.accumulate(np.maximum(reads.times_s - passed, self._end_s))
        self._stops = np.append(self._stops, self._length + reads.ends)
        self._ends_s = np.append(self._ends_s, ends_s)
        self._length += int(reads.ends[-1])
        self._end_s = float(ends_s[-1])
        return ends_s - lengths

    def times(self, starts: Integers, stops: Integers) -> Times:
        """When the pieces `starts:stops` of the stream were there; none is empty."""
        begins_s, first_reads = self._begins(starts)
        last_begins_s, last_reads = self._begins(stops - 1)
        return Times(begins_s, last_begins_s + self.byte_s, first_reads, last_reads)

    def _begins(self, offsets: Integers) -> tuple[Seconds, Integers]:
        found = np.searchsorted(self._stops, offsets, "right")
        begins_s = self._ends_s[found] - (self._stops[found] - offsets) * self.byte_s
        return begins_s, found + self._forgotten

    def forget(self, offset: int) -> None:
        """Drop what lies before `offset` in the stream."""
        count = int(np.searchsorted(self._stops, offset, "right"))
        self._stops, self._ends_s = self._stops[count:], self._ends_s[count:]
        self._forgotten += count
