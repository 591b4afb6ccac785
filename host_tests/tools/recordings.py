"""Recordings to try the commands on."""

from __future__ import annotations

import math
from collections.abc import Iterator
from datetime import UTC, datetime

from ghst import encode, protocol, telemetry
from ghst_tools.frames import log

BYTE_S = 10 / protocol.BAUD_RATE
FRAME_S = protocol.FRAME_SIZE * BYTE_S
SLOT_S = 1000e-6
BEGUN = datetime(2026, 5, 1, 12, tzinfo=UTC)


def pulses(index: int) -> list[int]:
    """What 16 sticks do: sines, in quarter microseconds."""
    return [round(6000 + 1800 * math.sin(index / 80 + channel)) for channel in range(16)]


def uplink(count: int) -> list[bytes]:
    """Control frames in the order in which a receiver of 12 channels sends them."""
    found = []
    for index in range(count):
        kind = (0x11, 0x13, 0x10)[index % 3]
        if kind == 0x13:
            primaries = [encode.raw_primary(kind, pulse) for pulse in pulses(index)[:4]]
            found.append(
                encode.link_data(kind, primaries, lq=99 - index % 7, rssi_dbm=-70, rf_mode=10)
            )
        else:
            found.append(encode.channels_from_pulses(kind, pulses(index)))
    return found


def pack(number: int) -> bytes:
    """A battery frame."""
    frame = bytearray(protocol.FRAME_SIZE)
    telemetry.pack_status(frame, 16000 - 10 * number, 5000, number, True)
    return bytes(frame)


def reads(count: int, rate_hz: float = 250.0) -> Iterator[tuple[float, bytes]]:
    """Reads of `count` control frames, and telemetry 1000 us behind every fourth of them.

    The time is the end of the last byte.
    """
    for index, frame in enumerate(uplink(count)):
        end_s = 0.01 + index / rate_hz + FRAME_S
        yield end_s, frame
        if index % 4 == 3:
            yield end_s + SLOT_S + FRAME_S, pack(index)


def log_text(count: int) -> str:
    """A log of them."""
    lines = [log.line(time_s, data) for time_s, data in reads(count)]
    return log.header("/dev/ttyUSB0", BEGUN) + "".join(lines)
