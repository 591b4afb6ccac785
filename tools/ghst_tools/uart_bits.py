"""Asynchronous serial (8N1) as edges in time: encoding bytes to levels and back."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple


class DecodedByte(NamedTuple):
    """A byte on a line: when its start bit began, its value, whether its stop bit was high."""

    t_ns: float
    value: int
    framing_ok: bool


def encode(
    data: bytes, start_ns: float, baud: float, gap_ns: float = 0.0
) -> tuple[list[tuple[float, bool]], float]:
    """Return the level changes of `data` on an idle-high line, and the end of its last stop bit.

    The first change is the first start bit at `start_ns`; `gap_ns` is the idle time between bytes.
    """
    bit_ns = 1e9 / baud
    changes: list[tuple[float, bool]] = []
    level = True
    begin = start_ns
    for number, value in enumerate(data):
        begin = start_ns + number * (10 * bit_ns + gap_ns)
        frame = (value | 0x100) << 1  # start bit, eight data bits from the lowest, stop bit
        for index in range(10):
            bit = bool(frame >> index & 1)
            if bit is not level:
                changes.append((begin + index * bit_ns, bit))
                level = bit
    return changes, begin + 10 * bit_ns if data else start_ns


class SerialDecoder:
    """Reads level changes of an idle-high line as 8N1, sampling in the middle of each bit."""

    def __init__(self, baud: float) -> None:
        self._bit_ns = 1e9 / baud
        self._start: float | None = None
        self._level = True
        self._bits = 0
        self._value = 0

    @property
    def pending(self) -> bool:
        """Whether a byte has begun that is not complete yet."""
        return self._start is not None

    def feed(self, t_ns: float, level: bool) -> list[DecodedByte]:
        """Take a change of level; return the byte that was complete before it, if any."""
        done = self._sample(t_ns)
        if self._start is None and not level and self._level:
            self._start, self._bits, self._value = t_ns, 0, 0
        self._level = level
        return done

    def flush(self, now_ns: float) -> list[DecodedByte]:
        """Let time pass up to `now_ns` without a change."""
        return self._sample(now_ns)

    def _sample(self, until_ns: float) -> list[DecodedByte]:
        if self._start is None:
            return []
        while self._bits < 9:
            if self._start + (1.5 + self._bits) * self._bit_ns > until_ns:
                return []
            self._value |= self._level << self._bits
            self._bits += 1
        done = DecodedByte(self._start, self._value & 0xFF, bool(self._value & 0x100))
        self._start = None
        return [done]


def decode(
    edges: Iterable[tuple[float, bool]], baud: float, now_ns: float = float("inf")
) -> list[DecodedByte]:
    """Read `edges` as 8N1; bytes whose stop bit lies behind `now_ns` are left out."""
    decoder = SerialDecoder(baud)
    found: list[DecodedByte] = []
    for t_ns, level in edges:
        found += decoder.feed(t_ns, level)
    return found + decoder.flush(now_ns)
