"""Counts what a receiver would have counted."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ghst.protocol import (  # type: ignore[import-not-found]
    ADDRESS_FC,
    ADDRESS_GOGGLES,
    ADDRESS_RADIO,
    FRAME_LENGTH,
    TYPE_MSP_REQUEST,
    TYPE_MSP_WRITE,
    TYPE_VTX_CONTROL,
    TYPE_VTX_SETUP,
)
from ghst_tools.frames.scan import Scan, known_address, outside, possible_length


@dataclass
class Counters:
    """What a `ghst.Receiver` has counted after the same bytes, under the same names."""

    frames: int = 0
    crc_errors: int = 0
    length_errors: int = 0
    unknown_frames: int = 0
    foreign_frames: int = 0
    msp_frames: int = 0
    vtx_setups: int = 0
    vtx_controls: int = 0
    skipped_bytes: int = 0

    def lines(self) -> list[tuple[str, int]]:
        """Names and numbers, in the order above."""
        return [(entry.name, getattr(self, entry.name)) for entry in fields(self)]

    def add(self, buffer: bytes, scan: Scan, begin: int) -> None:
        """Count what `scan` has found in `buffer` since `begin`, where the last one waited."""
        octets = np.frombuffer(buffer, np.uint8)
        in_frames = int(np.sum(scan.stops - scan.starts))
        self.skipped_bytes += scan.position - begin - in_frames
        # The decoder never comes to what is inside a valid frame.
        self.crc_errors += len(outside(scan.wrong, scan, begin))
        lengths = octets[1:]
        impossible = known_address(octets[:-1]) & ~possible_length(lengths)
        self.length_errors += len(outside(np.flatnonzero(impossible), scan, begin))
        address, kind = octets[scan.starts], octets[scan.starts + 2]
        whole = octets[scan.starts + 1] == FRAME_LENGTH
        ours = address == ADDRESS_FC
        control = ours & (kind & 0xD0 == 0x10)
        msp = ours & whole & ((kind == TYPE_MSP_REQUEST) | (kind == TYPE_MSP_WRITE))
        setup = whole & (kind == TYPE_VTX_SETUP)
        setup &= (address == ADDRESS_RADIO) | (address == ADDRESS_GOGGLES)
        self.frames += int(np.sum(control & whole))
        self.length_errors += int(np.sum(control & ~whole))
        self.msp_frames += int(np.sum(msp))
        self.unknown_frames += int(np.sum(ours & ~control & ~msp))
        self.foreign_frames += int(np.sum(~ours))
        self.vtx_setups += int(np.sum(setup))
        self.vtx_controls += int(np.sum(control & whole & (kind == TYPE_VTX_CONTROL)))
