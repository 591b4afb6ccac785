"""What writes pieces of a stream as lines: the part that text and JSON have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

from ghst_tools.frames.finder import DAMAGED, FRAME, GARBAGE, Pieces


class LineWriter(ABC):
    """Turns each piece into one line, and remembers what that takes.

    Times are those of the beginning of a piece, in seconds; None where they are not known.
    """

    def lines(self, pieces: Pieces, times_s: Sequence[float] | None) -> list[str]:
        """One line for each piece; `times_s` is as long as there are pieces."""
        found: list[str] = []
        data, offset = pieces.data, pieces.offset
        starts, verdicts = pieces.starts.tolist(), pieces.verdicts.tolist()
        times: Sequence[float | None] = times_s if times_s is not None else [None] * len(starts)
        frame = self.frame
        for time_s, start, stop, verdict in zip(
            times, starts, pieces.stops.tolist(), verdicts, strict=True
        ):
            octets = data[start:stop]
            if verdict == FRAME:
                found.append(frame(time_s, offset + start, octets))
            elif verdict == DAMAGED:
                found.append(self.damaged(time_s, offset + start, octets))
            elif verdict == GARBAGE:
                found.append(self.garbage(time_s, offset + start, octets))
            else:
                found.append(self.unfinished(time_s, offset + start, octets))
        return found

    @abstractmethod
    def frame(self, time_s: float | None, offset: int, frame: bytes) -> str:
        """A valid frame."""

    @abstractmethod
    def damaged(self, time_s: float | None, offset: int, frame: bytes) -> str:
        """A frame whose CRC is wrong: its values are not shown, since no receiver uses them."""

    @abstractmethod
    def garbage(self, time_s: float | None, offset: int, octets: bytes) -> str:
        """Bytes that belong to no frame."""

    @abstractmethod
    def unfinished(self, time_s: float | None, offset: int, octets: bytes) -> str:
        """The beginning of a frame, at the end of the stream."""
