"""What is known of the wire while listening."""

from __future__ import annotations

from collections import Counter, deque

import numpy as np

from ghst import Receiver  # type: ignore[import-not-found]
from ghst_tools.frames.blocks import Block
from ghst_tools.frames.finder import FRAME
from ghst_tools.frames.stream import Stream
from ghst_tools.frames.text import TextLines

_RATE_OVER_S = 2.0
_KEPT_LINES = 12

Kind = tuple[int, int]
"""Address and type."""


class State:
    """Takes blocks from the wire; holds counts, rates, the link and the last frames."""

    def __init__(self, baud: int) -> None:
        self.stream = Stream(baud)
        self.receiver = Receiver()
        self.last_lines: deque[str] = deque(maxlen=_KEPT_LINES)
        self.time_s = 0.0
        self._writer = TextLines()
        self._recent: deque[tuple[float, Counter[Kind]]] = deque()

    def add(self, block: Block, time_s: float) -> list[str]:
        """Take a block that was read at `time_s`; returns the lines of what it completed."""
        self.time_s = time_s
        if not block.data:
            return []
        self.receiver.feed(block.data)
        pieces, times = self.stream.feed(block)
        octets = np.frombuffer(pieces.data, np.uint8)
        at = pieces.starts[pieces.verdicts == FRAME]
        kinds = zip(octets[at].tolist(), octets[at + 2].tolist(), strict=True)
        self._recent.append((time_s, Counter(kinds)))
        lines = self._writer.lines(pieces, None if times is None else times.begins_s.tolist())
        self.last_lines.extend(lines)
        return lines

    def finish(self) -> list[str]:
        """Nothing more comes: returns the lines of what waited for more."""
        pieces, times = self.stream.finish()
        return self._writer.lines(pieces, None if times is None else times.begins_s.tolist())

    def rates_hz(self) -> dict[Kind, float]:
        """Frames a second of each kind, over the last two seconds."""
        while self._recent and self._recent[0][0] <= self.time_s - _RATE_OVER_S:
            self._recent.popleft()
        total: Counter[Kind] = Counter()
        for _, counted in self._recent:
            total.update(counted)
        over_s = min(_RATE_OVER_S, self.time_s) or _RATE_OVER_S
        return {kind: count / over_s for kind, count in total.items()}
