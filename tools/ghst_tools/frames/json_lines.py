"""Frames as JSON, one object a line."""

from __future__ import annotations

import json
from functools import cache

from ghst.protocol import (  # type: ignore[import-not-found]
    ADDRESS_FC,
    FRAME_LENGTH,
    TYPE_12_BIT,
    TYPE_CHANNELS_5_TO_8,
    TYPE_LINK_DATA,
)
from ghst_tools.frames import fields, kinds, scaling
from ghst_tools.frames.lines import LineWriter

_UNKNOWN = "null, null, null, null"


class JsonLines(LineWriter):
    """Objects with `t`, `offset_bytes`, `addr`, `type`, `name`, `crc_ok` and the fields.

    `t` is the time of the first start bit in seconds, null if the recording has no times;
    `offset_bytes` where the frame begins in the stream. `channels_us` are all 16 channels as a
    receiver has them after this frame, null for those that have not come yet; `carries` tells the
    numbers of those that this frame brought.
    """

    def __init__(self) -> None:
        self._groups = [_UNKNOWN] * 4
        self._heads: dict[bytes, str] = {}
        self._primary = [_numbers(scaling.primary(wide).tolist()) for wide in (False, True)]
        self._auxiliary = [_numbers(scaling.auxiliary(wide).tolist()) for wide in (False, True)]
        self._link = _link_json()

    def frame(self, time_s: float | None, offset: int, frame: bytes) -> str:
        head = self._heads.get(frame[:3]) or self._head(frame)
        begin = "null" if time_s is None else f"{time_s:.6f}"
        kind = frame[2]
        if frame[0] == ADDRESS_FC and kind & 0xD0 == 0x10 and frame[1] == FRAME_LENGTH:
            return f'{{"t": {begin}, "offset_bytes": {offset}, {head}{self._control(frame)}}}'
        found = json.dumps(fields.read(frame))
        return f'{{"t": {begin}, "offset_bytes": {offset}, {head}, {found[1:]}'

    def _control(self, frame: bytes) -> str:
        kind = frame[2]
        wide = kind & TYPE_12_BIT != 0
        table = self._primary[wide]
        raw = int.from_bytes(frame[3:9], "little")
        groups = self._groups
        groups[0] = (
            f"{table[raw & 4095]}, {table[raw >> 12 & 4095]}, "
            f"{table[raw >> 24 & 4095]}, {table[raw >> 36]}"
        )
        group = (kind & 0xDF) - TYPE_CHANNELS_5_TO_8
        rest = ""
        if group < 3:
            table = self._auxiliary[wide]
            groups[group + 1] = (
                f"{table[frame[9]]}, {table[frame[10]]}, {table[frame[11]]}, {table[frame[12]]}"
            )
        elif kind & 0xDF == TYPE_LINK_DATA:
            lq, rssi, protocol, power = self._link
            rest = (
                f", {lq[frame[9]]}, {rssi[frame[10]]}, {protocol[frame[11]]}, {power[frame[12]]}"
            )
        else:
            rest = f', "payload": "{frame[9:13].hex()}"'
        return f', "channels_us": [{", ".join(groups)}]{rest}'

    def damaged(self, time_s: float | None, offset: int, frame: bytes) -> str:
        return self._object(time_s, offset, frame, kinds.name(frame[0], frame[2]), False)

    def garbage(self, time_s: float | None, offset: int, octets: bytes) -> str:
        return self._object(time_s, offset, octets, "garbage", None)

    def unfinished(self, time_s: float | None, offset: int, octets: bytes) -> str:
        return self._object(time_s, offset, octets, "unfinished", None)

    def _object(
        self, time_s: float | None, offset: int, octets: bytes, name: str, crc_ok: bool | None
    ) -> str:
        is_frame = crc_ok is not None
        return json.dumps(
            {
                "t": None if time_s is None else round(time_s, 6),
                "offset_bytes": offset,
                "addr": octets[0] if is_frame else None,
                "type": octets[2] if is_frame else None,
                "name": name,
                "crc_ok": crc_ok,
                "length_bytes": len(octets),
                "bytes": octets.hex(),
            }
        )

    def _head(self, frame: bytes) -> str:
        """The part that all frames of an address, a length and a type share."""
        address, _, kind = frame[:3]
        name = kinds.name(address, kind)
        head = json.dumps({"addr": address, "type": kind, "name": name, "crc_ok": True})[1:-1]
        if kinds.carries_channels(address, kind) and frame[1] == FRAME_LENGTH:
            carried = [1, 2, 3, 4, *kinds.auxiliary_channels(kind)]
            head += f', "carries": {json.dumps(carried)}'
        self._heads[frame[:3]] = head
        return head


def _numbers(pulses: list[int]) -> list[str]:
    """Quarter microseconds as microseconds in JSON, without digits that say nothing."""
    return [json.dumps(pulse / 4 if pulse % 4 else pulse // 4) for pulse in pulses]


@cache
def _link_json() -> tuple[list[str], ...]:
    """For each of the four bytes of link data and each value the fields that it makes."""
    table = [link.of_each_byte for link in fields.link_table()]
    return tuple([json.dumps(row[byte])[1:-1] for row in table] for byte in range(4))
