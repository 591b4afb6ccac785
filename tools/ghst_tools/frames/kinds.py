"""Names of frames: what the protocol's module calls their types, by address, type and length."""

from __future__ import annotations

from functools import cache

from ghst import protocol  # type: ignore[import-not-found]

UP, DOWN = "up", "down"

ENDS = (protocol.ADDRESS_FC, protocol.ADDRESS_RX)
"""The two ends of the wire."""

UNKNOWN = "unknown"
PRIMARIES_ONLY = "channels_1_to_4"
"""Control types that nobody has defined yet carry the first four channels all the same."""

_TYPES = {
    number: name.removeprefix("TYPE_").lower()
    for name, number in vars(protocol).items()
    if name.startswith("TYPE_") and name != "TYPE_12_BIT"
}
_DOWNLINK = {
    protocol.TYPE_PACK_STATUS,
    protocol.TYPE_GPS_PRIMARY,
    protocol.TYPE_GPS_SECONDARY,
    protocol.TYPE_MAG_BARO,
    protocol.TYPE_MSP_RESPONSE,
}
_ABBREVIATIONS = {"gps", "msp", "vtx"}
_MSP = {protocol.TYPE_MSP_REQUEST, protocol.TYPE_MSP_WRITE}


def carries_channels(address: int, kind: int) -> bool:
    """Whether a frame is a control frame, if its length is right (description: Control Packet).

    To the flight controller, 0x10-0x1F legacy and 0x30-0x3F 12-bit.
    """
    return address == protocol.ADDRESS_FC and kind & 0xD0 == 0x10


def auxiliary_channels(kind: int) -> tuple[int, ...]:
    """Numbers of the channels behind the four primaries of a control frame: four, or none."""
    group = kind & 0xDF
    first = {
        protocol.TYPE_CHANNELS_5_TO_8: 5,
        protocol.TYPE_CHANNELS_9_TO_12: 9,
        protocol.TYPE_CHANNELS_13_TO_16: 13,
    }.get(group)
    return () if first is None else tuple(range(first, first + 4))


def is_link_data(kind: int) -> bool:
    """Whether a control frame tells of the link: 0x13, and 0x33."""
    return bool(kind & 0xDF == protocol.TYPE_LINK_DATA)


def direction(address: int) -> str:
    """UP, from the receiver, or DOWN, from the flight controller: those are for the receiver."""
    return DOWN if address == protocol.ADDRESS_RX else UP


@cache
def name(address: int, kind: int) -> str:
    """What a frame is, as in `ghst.protocol` but in small letters: `channels_5_to_8`.

    12-bit control frames end with `_12_bit`. UNKNOWN for a type that is not defined, or not for
    this address.
    """
    if carries_channels(address, kind):
        wide = kind & protocol.TYPE_12_BIT
        base = kind - wide
        found = _TYPES.get(base, PRIMARIES_ONLY)
        if wide and base == protocol.TYPE_VTX_CONTROL:
            found = PRIMARIES_ONLY  # 0x34 is not defined
        return found + ("_12_bit" if wide else "")
    known = {
        protocol.ADDRESS_FC: _MSP,
        protocol.ADDRESS_RX: _DOWNLINK,
        protocol.ADDRESS_RADIO: {protocol.TYPE_VTX_SETUP},
        protocol.ADDRESS_GOGGLES: {protocol.TYPE_VTX_SETUP},
    }
    return _TYPES[kind] if kind in known.get(address, ()) else UNKNOWN


def title(name: str) -> str:
    """A name for people: `channels_5_to_8_12_bit` as "channels 5-8, 12-bit"."""
    text = name.replace("_12_bit", ", 12-bit").replace("_to_", "-")
    return " ".join(word.upper() if word in _ABBREVIATIONS else word for word in text.split("_"))
