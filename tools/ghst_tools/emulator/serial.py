"""Asynchronous serial (8N1) as edges in time: encoding bytes to levels and back."""

from __future__ import annotations

from collections.abc import Sequence
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


def decode(
    edges: Sequence[tuple[float, bool]], baud: float, now_ns: float = float("inf")
) -> list[DecodedByte]:
    """Read level changes of an idle-high line as 8N1, sampling in the middle of each bit.

    Bytes whose stop bit lies behind `now_ns` are left out.
    """
    bit_ns = 1e9 / baud
    found: list[DecodedByte] = []
    index, count = 0, len(edges)
    while index < count:
        start, level = edges[index]
        if level:
            index += 1
            continue
        if start + 9.5 * bit_ns > now_ns:
            break
        value, line, position = 0, False, index + 1
        for bit in range(9):
            sample = start + (1.5 + bit) * bit_ns
            while position < count and edges[position][0] <= sample:
                line = edges[position][1]
                position += 1
            value |= line << bit
        found.append(DecodedByte(start, value & 0xFF, bool(value & 0x100)))
        index = position
    return found
