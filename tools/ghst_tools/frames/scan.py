"""Which frames the library's decoder finds in a buffer, computed for all bytes at once.

`ghst.decoder.scan` looks at one byte after the other. The rules are the same here: a byte that
cannot begin a valid frame is skipped alone, so that an intact frame behind a false start is never
lost with it, and an unfinished frame waits for its rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ghst import crc8  # type: ignore[import-not-found]
from ghst.protocol import (  # type: ignore[import-not-found]
    ADDRESS_RADIO,
    ADDRESS_RX,
    FRAME_LENGTH,
    FRAME_SIZE,
)

Integers = NDArray[np.int64]
Octets = NDArray[np.uint8]

_SHORTEST_LENGTH = 2  # type and CRC


@dataclass(frozen=True)
class Scan:
    """What the decoder makes of a buffer.

    `starts`, `stops`: the valid frames it takes; `wrong`, `wrong_stops`: where address and length
    are those of a frame but the CRC is not, wherever the decoder has passed; `position`: where it
    waits for more bytes.
    """

    starts: Integers
    stops: Integers
    wrong: Integers
    wrong_stops: Integers
    position: int


def scan(buffer: bytes, begin: int) -> Scan:
    """What the decoder makes of `buffer`, having found no frame before `begin`."""
    octets = np.frombuffer(buffer, np.uint8)
    lengths = octets[1:]
    begins = np.flatnonzero(known_address(octets[:-1]) & possible_length(lengths))
    ends = begins + lengths[begins] + 2
    waiting = begins[(ends > len(buffer)) & (begins >= begin)]
    begins, ends = begins[ends <= len(buffer)], ends[ends <= len(buffer)]
    right = _crc_right(octets, begins, ends)
    starts, stops = _one_after_the_other(begins[right], ends[right], begin)
    position = len(buffer)
    if position and not (len(stops) and stops[-1] == position):
        position = max(begin, position - 1)  # the length of what may be a frame is not there yet
    for at in waiting.tolist():
        # Inside an accepted frame a beginning is none.
        before = int(np.searchsorted(starts, at, "right"))
        if before == 0 or stops[before - 1] <= at:
            starts, stops, position = starts[:before], stops[:before], at
            break
    wrong, wrong_stops = begins[~right], ends[~right]
    known = wrong < position
    return Scan(starts, stops, wrong[known], wrong_stops[known], position)


def _one_after_the_other(
    starts: Integers, stops: Integers, begin: int
) -> tuple[Integers, Integers]:
    """Of valid frames those that the decoder takes: none begins inside another."""
    if len(starts) and (np.any(starts[1:] < stops[:-1]) or starts[0] < begin):
        taken = []
        free = begin
        for index, (start, stop) in enumerate(zip(starts.tolist(), stops.tolist(), strict=True)):
            if start >= free:
                taken.append(index)
                free = stop
        starts, stops = starts[taken], stops[taken]
    return starts, stops


def _crc_right(octets: Octets, starts: Integers, stops: Integers) -> NDArray[np.bool_]:
    """For each candidate whether its last byte is the CRC of type and payload."""
    table = _crc_table()
    right = np.zeros(len(starts), np.bool_)
    sizes = stops - starts
    for size in range(_SHORTEST_LENGTH + 2, FRAME_SIZE + 1):
        chosen = np.flatnonzero(sizes == size)
        at = starts[chosen]
        crc = np.zeros(len(chosen), np.uint8)
        for index in range(2, size - 1):
            crc = table[crc ^ octets[at + index]]
        right[chosen] = crc == octets[at + (size - 1)]
    return right


def outside(places: Integers, found: Scan, begin: int) -> Integers:
    """Of `places` those that the decoder has come to since `begin`: none inside a frame."""
    places = places[(places >= begin) & (places < found.position)]
    if not len(found.starts):
        return places
    before = np.searchsorted(found.starts, places, "right")
    return places[(before == 0) | (places >= found.stops[before - 1])]


def is_address(octet: int) -> bool:
    """Whether a frame may begin with this byte (description: Addresses)."""
    return bool(ADDRESS_RADIO <= octet <= ADDRESS_RX)


def known_address(octets: Octets) -> NDArray[np.bool_]:
    """`is_address` for each byte."""
    return (octets >= ADDRESS_RADIO) & (octets <= ADDRESS_RX)


def possible_length(octets: Octets) -> NDArray[np.bool_]:
    """Whether each may be a length byte: a type, up to ten bytes of payload and a CRC."""
    return (octets >= _SHORTEST_LENGTH) & (octets <= FRAME_LENGTH)


@cache
def _crc_table() -> Octets:
    """The CRC of each single byte."""
    return np.array([crc8(bytes((octet,)), 0, 1) for octet in range(256)], np.uint8)
