"""What the board sends to itself and hears: bits for its player, and recordings read back."""

from __future__ import annotations

import random
import struct
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ghst.protocol import BAUD_RATE, FRAME_SIZE  # type: ignore[import-not-found]
from ghst_tools.uart_bits import DecodedByte, decode

_WORD = 32
_BYTE_BITS = 10
_CYCLES_PER_SAMPLE = 32


class Recording(NamedTuple):
    """What the receiver's pin has shown since a control frame of 14 bytes was sent on it.

    `control`: what was heard of that; `telemetry`: the bytes behind it; `start_us`: from the end
    of the control frame's last stop bit to the first start bit behind it, None without one.
    """

    control: bytes
    telemetry: bytes
    start_us: float | None
    framing_ok: bool


def of_bits(bits: Sequence[int]) -> str:
    """A transmission of these levels, each as long as a bit; the line is high before them."""
    levels = [1] * (-len(bits) % _WORD) + list(bits)
    words = [len(levels) - 1]
    for at in range(0, len(levels), _WORD):
        words.append(sum(level << index for index, level in enumerate(levels[at : at + _WORD])))
    return struct.pack(f"<{len(words)}I", *words).hex()


def of_frame(frame: bytes, broken_stop_bit: int | None = None) -> str:
    """A transmission of a frame, 8N1; `broken_stop_bit`: number of a byte that ends low."""
    return of_bits(list(_bits(frame, broken_stop_bit)))


def of_noise(seed: int, bits: int = 600) -> str:
    """A transmission of random levels that ends with an idle line."""
    chance = random.Random(seed)
    return of_bits([chance.getrandbits(1) for _ in range(bits)] + [1] * _BYTE_BITS)


def read(recording: str, clock_hz: int) -> Recording:
    """Read what the player has recorded: hexadecimal, lowest bit first, 32 cycles apart."""
    period_ns = _CYCLES_PER_SAMPLE * 1e9 / clock_hz
    edges = []
    level = True
    samples = bytes.fromhex(recording)
    for at, byte in enumerate(samples):
        if byte == (0xFF if level else 0):
            continue
        for index in range(8):
            if bool(byte >> index & 1) is not level:
                level = not level
                edges.append(((8 * at + index) * period_ns, level))
    heard = decode(edges, BAUD_RATE, 8 * len(samples) * period_ns)
    control, behind = heard[:FRAME_SIZE], heard[FRAME_SIZE:]
    start_us = None
    # A start bit that was too short, or too late for a whole byte, is one as well.
    end_ns = _end_ns(control)
    if end_ns is not None:
        falls = [t_ns for t_ns, high in edges if not high and t_ns > end_ns - period_ns]
        start_us = (falls[0] - end_ns) / 1e3 if falls else None
    return Recording(
        bytes(byte.value for byte in control),
        bytes(byte.value for byte in behind),
        start_us,
        all(byte.framing_ok for byte in heard),
    )


def _end_ns(control: Sequence[DecodedByte]) -> float | None:
    """The end of the last stop bit: the first start bit tells it best."""
    if len(control) < FRAME_SIZE:
        return None
    return control[0].t_ns + FRAME_SIZE * _BYTE_BITS * 1e9 / BAUD_RATE


def _bits(frame: bytes, broken_stop_bit: int | None) -> Iterator[int]:
    for number, value in enumerate(frame):
        yield 0
        yield from (value >> index & 1 for index in range(8))
        yield 0 if number == broken_stop_bit else 1
