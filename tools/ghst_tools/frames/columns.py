"""The values of many frames at once, as arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ghst.protocol import (  # type: ignore[import-not-found]
    ADDRESS_FC,
    ADDRESS_RX,
    FRAME_LENGTH,
    TYPE_12_BIT,
)
from ghst_tools.frames import fields, kinds, scaling
from ghst_tools.frames.finder import FRAME, Pieces
from ghst_tools.frames.scan import Integers, Octets

Mask = NDArray[np.bool_]


def valid(pieces: Pieces) -> Mask:
    """Which pieces are valid frames."""
    return pieces.verdicts == FRAME


def control(pieces: Pieces) -> Mask:
    """Which pieces are control frames: valid, and with channels."""
    at, octets = _heads(pieces)
    kind = octets[at + 2]
    mask = (octets[at] == ADDRESS_FC) & (octets[at + 1] == FRAME_LENGTH) & (kind & 0xD0 == 0x10)
    return _spread(pieces, mask)


def downlink(pieces: Pieces) -> Mask:
    """Which pieces are valid frames to the receiver."""
    at, octets = _heads(pieces)
    return _spread(pieces, octets[at] == ADDRESS_RX)


@dataclass(frozen=True)
class Channels:
    """What control frames carry, one row a frame.

    `frames`: numbers of their pieces; `pulses_us`: 16 channels, NaN where a frame does not carry
    the channel.
    """

    frames: Integers
    pulses_us: NDArray[np.float64]


def channels(pieces: Pieces) -> Channels:
    """The channels of all control frames."""
    frames = np.flatnonzero(control(pieces))
    octets = np.frombuffer(pieces.data, np.uint8)
    rows = octets[pieces.starts[frames][:, None] + np.arange(14)].astype(np.int64)
    kind = rows[:, 2]
    wide = (kind & TYPE_12_BIT) != 0
    # Two channels of 12 bits in three bytes, the lowest bits first (description: Control Packet).
    pairs = [rows[:, at] | rows[:, at + 1] << 8 | rows[:, at + 2] << 16 for at in (3, 6)]
    raw = np.stack([half for pair in pairs for half in (pair & 0xFFF, pair >> 12)], axis=1)
    pulses_us = np.full((len(frames), 16), np.nan)
    for twelve_bit in (False, True):
        chosen = np.flatnonzero(wide == twelve_bit)
        pulses_us[chosen, :4] = scaling.primary(twelve_bit)[raw[chosen]] / 4
        for number in np.unique(kind[chosen]).tolist():
            carried = kinds.auxiliary_channels(number)
            if carried:
                which = chosen[kind[chosen] == number]
                quarters = scaling.auxiliary(twelve_bit)[rows[which, 9:13]]
                pulses_us[which, carried[0] - 1 : carried[-1]] = quarters / 4
    return Channels(frames, pulses_us)


@dataclass(frozen=True)
class Link:
    """Link data, one entry for each frame that has it; `frames`: numbers of their pieces."""

    frames: Integers
    lq_percent: Integers
    rssi_dbm: Integers
    rf_mode: Integers


def link(pieces: Pieces) -> Link:
    """What all link data frames say."""
    frames = np.flatnonzero(control(pieces))
    octets = np.frombuffer(pieces.data, np.uint8)
    kinds_of = octets[pieces.starts[frames] + 2]
    told = np.array([kinds.is_link_data(kind) for kind in range(256)])
    frames = frames[told[kinds_of]]
    at = pieces.starts[frames]
    table = fields.link_table()
    lq = np.array([row.lq_percent for row in table])
    rssi = np.array([row.rssi_dbm for row in table])
    mode = np.array([row.rf_mode for row in table])
    return Link(frames, lq[octets[at + 9]], rssi[octets[at + 10]], mode[octets[at + 11]])


def _heads(pieces: Pieces) -> tuple[Integers, Octets]:
    return pieces.starts[valid(pieces)], np.frombuffer(pieces.data, np.uint8)


def _spread(pieces: Pieces, of_frames: Mask) -> Mask:
    mask = np.zeros(len(pieces.starts), np.bool_)
    mask[valid(pieces)] = of_frames
    return mask
