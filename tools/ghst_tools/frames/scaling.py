"""Pulse widths of every raw channel value, as the library's decoder makes them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ghst import Receiver, encode  # type: ignore[import-not-found]
from ghst.protocol import TYPE_12_BIT, TYPE_CHANNELS_5_TO_8  # type: ignore[import-not-found]

Pulses = NDArray[np.uint16]
"""Pulse widths in quarter microseconds (6000 = 1500 us)."""


@cache
def primary(twelve_bit: bool) -> Pulses:
    """The pulse width of each raw value 0..4095 of a primary channel."""
    raw = np.arange(4096).reshape(-1, 4).tolist()
    return _decoded(twelve_bit, [(values, (0, 0, 0, 0)) for values in raw], 0)


@cache
def auxiliary(twelve_bit: bool) -> Pulses:
    """The pulse width of each raw value 0..255 of an auxiliary channel."""
    raw = np.arange(256).reshape(-1, 4).tolist()
    return _decoded(twelve_bit, [((0, 0, 0, 0), values) for values in raw], 4)


def _decoded(
    twelve_bit: bool, raw: Sequence[tuple[Sequence[int], Sequence[int]]], first: int
) -> Pulses:
    kind = TYPE_CHANNELS_5_TO_8 + (TYPE_12_BIT if twelve_bit else 0)
    receiver = Receiver()
    pulses = []
    for primaries, auxiliaries in raw:
        receiver.feed(encode.channels(kind, primaries, auxiliaries))
        pulses += receiver.pulses[first : first + 4]
    return np.array(pulses, np.uint16)
