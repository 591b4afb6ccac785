"""What the flight controller says, and when, out of all that is read."""

from __future__ import annotations

from array import array
from bisect import bisect_right
from collections import Counter, deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ghst.protocol import ADDRESS_RX  # type: ignore[import-not-found]
from ghst_tools.frames import kinds
from ghst_tools.frames.finder import DAMAGED, FRAME, Finder, Pieces
from ghst_tools.frames.timeline import Reads, Timeline
from ghst_tools.simulate.echo import EchoFilter, Stretch
from ghst_tools.simulate.send import Sent
from ghst_tools.sniff.listen import Read

_KEPT_BURSTS = 64
# An emulated board may take seconds for a frame when its computer is busy.
_NETWORK_PATIENCE_S = 5.0
_ROUNDING_S = 1e-9


class Heard(NamedTuple):
    """A frame of the flight controller.

    `time_s`: its first start bit; `slot_us`: from the end of what was sent before it, None where
    both were read together, so that nothing was measured, or where nothing was sent.
    """

    time_s: float
    frame: bytes
    slot_us: float | None


class _Burst(NamedTuple):
    """Something that was sent; `read`: in which read its echo came, None without an echo."""

    end_s: float
    read: int | None


class Listening:
    """Takes slots that were sent and bytes that were read, with times of one clock.

    Counted are valid frames to the receiver in `frames`, by name, and what else was no echo:
    `others` (valid frames to somebody else), `damaged`, `garbage_bytes`. `slots_us` are those that
    were measured, `slots_unknown` how many were not. Without an echo a slot begins when the bytes
    were written, and the adapter's way there and back is in it. Over a `network` nothing is
    measured, and an echo may take its time.
    """

    def __init__(self, baud: int, network: bool = False) -> None:
        self.echo = EchoFilter(_NETWORK_PATIENCE_S, 1) if network else EchoFilter()
        self._network = network
        self.frames: Counter[str] = Counter()
        self.others = self.damaged = self.garbage_bytes = 0
        self.slots_us = array("d")
        self.slots_unknown = 0
        self._timeline = Timeline(baud)
        self._finder = Finder()
        self._bursts: deque[_Burst] = deque(maxlen=_KEPT_BURSTS)
        self._offset = 0
        # What is no echo is a stream of its own: where stretches begin in it, and in all.
        self._length = self._decided = 0
        self._begins: list[int] = []
        self._offsets: list[int] = []

    def add(self, sent: Sequence[Sent], reads: Sequence[Read], now_s: float) -> list[Heard]:
        """Take what happened since the last call; returns the frames that it completed."""
        for slot in sent:
            if slot.octets:
                self.echo.sent(slot.time_s, slot.octets)
                if not self.echo.present:
                    end_s = slot.time_s + len(slot.octets) * self._timeline.byte_s
                    self._bursts.append(_Burst(end_s, None))
        if reads:
            ends = np.cumsum([len(data) for _, data in reads], dtype=np.int64)
            self._timeline.add(Reads(ends, np.array([time_s for time_s, _ in reads])))
        octets = b"".join(data for _, data in reads)
        return self._take(self.echo.read(octets, now_s))

    def finish(self, now_s: float) -> list[Heard]:
        """Nothing more comes."""
        return self._take(self.echo.finish(now_s)) + self._pieces(self._finder.finish())

    def _take(self, stretches: list[Stretch]) -> list[Heard]:
        found: list[Heard] = []
        for octets, is_echo in stretches:
            begin = self._offset
            self._offset += len(octets)
            if is_echo:
                if self._bursts and self._bursts[-1].read is None:
                    self._bursts.clear()  # from before it was known that there is an echo
                times = self._timeline.times(np.array([begin]), np.array([self._offset]))
                self._bursts.append(_Burst(float(times.ends_s[0]), int(times.last_reads[0])))
                continue
            self._begins.append(self._length)
            self._offsets.append(begin)
            self._length += len(octets)
            found += self._pieces(self._finder.feed(octets))
        self._forget()
        return found

    def _pieces(self, pieces: Pieces) -> list[Heard]:
        found = []
        limits = zip(pieces.starts.tolist(), pieces.stops.tolist(), strict=True)
        for (start, stop), verdict in zip(limits, pieces.verdicts.tolist(), strict=True):
            octets = pieces.data[start:stop]
            if verdict == DAMAGED:
                self.damaged += 1
            elif verdict != FRAME:
                self.garbage_bytes += len(octets)
            elif octets[0] != ADDRESS_RX:
                self.others += 1
            else:
                self.frames[kinds.name(octets[0], octets[2])] += 1
                found.append(self._heard(self._offset_of(pieces.offset + start), octets))
        self._decided = pieces.offset + len(pieces.data)
        return found

    def _heard(self, offset: int, frame: bytes) -> Heard:
        times = self._timeline.times(np.array([offset]), np.array([offset + 1]))
        begin_s, read = float(times.begins_s[0]), int(times.first_reads[0])
        before = [burst for burst in self._bursts if burst.end_s <= begin_s + _ROUNDING_S]
        slot_us = (begin_s - before[-1].end_s) * 1e6 if before else 0.0
        # Two reads without time between them were gathered somewhere.
        if slot_us < _ROUNDING_S * 1e6 or before[-1].read == read or self._network:
            self.slots_unknown += 1
            return Heard(begin_s, frame, None)
        self.slots_us.append(slot_us)
        return Heard(begin_s, frame, slot_us)

    def _offset_of(self, place: int) -> int:
        """Where a byte of what is no echo lies in all that was read."""
        at = bisect_right(self._begins, place) - 1
        return self._offsets[at] + place - self._begins[at]

    def _forget(self) -> None:
        """Drop what no piece can reach back to."""
        if not self._begins:
            self._timeline.forget(self._offset)
            return
        at = bisect_right(self._begins, self._decided) - 1
        del self._begins[:at], self._offsets[:at]
        if self._decided == self._length:
            self._timeline.forget(self._offset)
        else:
            self._timeline.forget(self._offset_of(self._decided))
