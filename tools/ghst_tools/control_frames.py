"""Control frames from the pulse widths of all channels, in the order of a Ghost receiver."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ghst import encode  # type: ignore[import-not-found]
from ghst_tools.frames import kinds

CENTRE = 6000
"""1500 us in quarter microseconds."""

ROTATIONS = {12: (0x11, 0x13, 0x10), 16: (0x11, 0x13, 0x10, 0x12)}
"""Number of channels -> the types that take turns: the first order is that of a real capture."""


def control_frame(kind: int, pulses: Sequence[int], **link: Any) -> bytes:
    """A control frame of type 0x10-0x13 or 0x30-0x33.

    `pulses`: 16 pulse widths in quarter microseconds; `link`: what `encode.link_data` takes, for
    the types that carry link data.
    """
    if kinds.is_link_data(kind):
        primaries = [encode.raw_primary(kind, pulse) for pulse in pulses[:4]]
        return bytes(encode.link_data(kind, primaries, **link))
    return bytes(encode.channels_from_pulses(kind, pulses))
