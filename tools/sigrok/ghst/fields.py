# Copyright (c) 2026 the micropython-ghst authors
# SPDX-License-Identifier: MIT
"""What the bits of a GHST frame say. Facts of the protocol only: nothing in here knows sigrok.

Everything stands here once more, since a decoder has to be one folder that can be copied; the
tests of micropython-ghst compare it with the library.
"""

ADDRESSES = range(0x80, 0x8A)
LENGTHS = range(2, 13)
FC, RX = 0x82, 0x89
WHOLE = 12  # the length byte of every defined frame

ADDRESS_NAMES = {
    0x80: "radio",
    0x81: "module",
    0x82: "flight controller",
    0x83: "goggles",
    0x88: "module",
    0x89: "receiver",
}
RF_MODES = {
    5: "Normal",
    6: "Race",
    7: "PureRace",
    8: "Long Range",
    10: "Race250",
    11: "Race500",
    12: "Solid150",
    13: "Solid250",
}

FIELD, CHANNEL = 0, 1  # kinds of fields

_CONTROL_NAMES = {
    0x10: "channels 5-8",
    0x11: "channels 9-12",
    0x12: "channels 13-16",
    0x13: "link data",
    0x14: "VTX control",
}
_FIRST_AUXILIARY = {0x10: 5, 0x11: 9, 0x12: 13}
_DOWNLINK_NAMES = {
    0x23: "pack status",
    0x25: "GPS primary",
    0x26: "GPS secondary",
    0x27: "mag baro",
    0x28: "MSP response",
}
_MSP_NAMES = {0x21: "MSP request", 0x22: "MSP write"}


def crc8(data):
    """CRC-8/DVB-S2: polynomial 0xD5, initial value 0, not reflected."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0xD5 if crc & 0x80 else crc << 1) & 0xFF
    return crc


def is_control(frame):
    """Whether a valid frame carries channels."""
    return frame[0] == FC and frame[1] == WHOLE and frame[2] & 0xD0 == 0x10


def title(address, kind):
    """The name of a frame."""
    if address == FC and kind & 0xD0 == 0x10:
        name = _CONTROL_NAMES.get(kind & 0xDF, "channels 1-4")
        if kind == 0x34:  # only 0x14 is defined
            name = "channels 1-4"
        return name + (", 12-bit" if kind & 0x20 else "")
    if address == FC and kind in _MSP_NAMES:
        return _MSP_NAMES[kind]
    if address in (0x80, 0x83) and kind == 0x20:
        return "VTX setup"
    if address == RX and kind in _DOWNLINK_NAMES:
        return _DOWNLINK_NAMES[kind]
    return "unknown"


def describe(frame):
    """The fields of a valid frame: (first bit in the frame, bits, kind, texts, longest first)."""
    address, _, kind = frame[:3]
    name = title(address, kind)
    to = ADDRESS_NAMES.get(address, "0x%02x" % address)
    fields = [
        (0, 8, FIELD, ["to the %s" % to, to]),
        (8, 8, FIELD, ["length %d" % frame[1], "%d" % frame[1]]),
        (16, 8, FIELD, ["type 0x%02x %s" % (kind, name), "0x%02x" % kind]),
    ]
    payload = frame[3:-1]
    if frame[1] != WHOLE or name == "unknown":
        fields += _raw(payload, 3)
    elif is_control(frame):
        fields += _control(kind, payload)
    elif name in _READERS:
        fields += _READERS[name](payload)
    crc = (8 * len(frame) - 8, 8, FIELD, ["CRC 0x%02x" % frame[-1], "CRC"])
    return fields + [crc]


def _control(kind, payload):
    wide = bool(kind & 0x20)
    packed = int.from_bytes(payload[:6], "little")
    for index in range(4):
        raw = packed >> 12 * index & 0xFFF
        # Quarter microseconds; 6000 is 1500 us.
        quarters = 6000 + (raw - 2048 if wide else 5 * (raw - 1984) >> 2)
        yield _channel(24 + 12 * index, 12, index + 1, quarters)
    group = kind & 0xDF
    if group in _FIRST_AUXILIARY:
        for index in range(4):
            raw = payload[6 + index]
            quarters = 6000 + (16 * (raw - 128) if wide else 20 * (raw - 124))
            yield _channel(72 + 8 * index, 8, _FIRST_AUXILIARY[group] + index, quarters)
    elif group == 0x13:
        yield from _link(payload[6:])
    else:
        yield from _raw(payload[6:], 9)


def _channel(bit, size, number, quarters):
    us = "%.2f" % (quarters / 4)
    return bit, size, CHANNEL, ["ch%d %s us" % (number, us), us]


def _link(tail):
    lq, rssi, protocol, power = tail
    mode = RF_MODES.get(protocol & 0x1F, "RF mode %d" % (protocol & 0x1F))
    told = mode
    told += ", telemetry requested" if protocol & 0x20 else ""
    told += ", new scaling" if protocol & 0x40 else ""
    yield 72, 8, FIELD, ["LQ %d %%" % lq, "%d %%" % lq]
    yield 80, 8, FIELD, ["RSSI %d dBm" % -rssi, "%d dBm" % -rssi]
    yield 88, 8, FIELD, [told, mode]
    yield 96, 8, FIELD, ["%+d dBm" % _signed(bytes([power]))]


def _vtx_setup(payload):
    power = _unsigned(payload[3:5])
    yield 24, 8, FIELD, ["flags 0x%02x" % payload[0]]
    yield 32, 16, FIELD, ["%d MHz" % _unsigned(payload[1:3])]
    yield 48, 16, FIELD, ["%d mW" % power if power else "off"]
    yield 64, 8, FIELD, ["band and channel 0x%02x" % payload[5], "0x%02x" % payload[5]]


def _pack_status(payload):
    yield 24, 16, FIELD, ["%.2f V" % (_unsigned(payload[:2]) / 100)]
    yield 40, 16, FIELD, ["%.2f A" % (_unsigned(payload[2:4]) / 100)]
    yield 56, 16, FIELD, ["%d mAh" % (10 * _unsigned(payload[4:6]))]
    yield 72, 8, FIELD, ["receiver %.1f V" % (payload[6] / 10)]
    yield 80, 8, FIELD, ["disarmed" if payload[7] & 1 else "armed"]


def _gps_primary(payload):
    yield 24, 32, FIELD, ["latitude %.7f deg" % (_signed(payload[:4]) / 1e7), "latitude"]
    yield 56, 32, FIELD, ["longitude %.7f deg" % (_signed(payload[4:8]) / 1e7), "longitude"]
    yield 88, 16, FIELD, ["altitude %d m" % _signed(payload[8:])]


def _gps_secondary(payload):
    flags = payload[9]
    fix = "fix" if flags & 1 else "no fix"
    yield 24, 16, FIELD, ["%.2f m/s" % (_unsigned(payload[:2]) / 100)]
    yield 40, 16, FIELD, ["course %.1f deg" % (_unsigned(payload[2:4]) / 10)]
    yield 56, 8, FIELD, ["%d satellites" % payload[4]]
    yield 64, 16, FIELD, ["home %d m" % (10 * _unsigned(payload[5:7]))]
    yield 80, 16, FIELD, ["home at %.1f deg" % (_unsigned(payload[7:9]) / 10)]
    yield 96, 8, FIELD, [fix + (", home fix" if flags & 2 else ", no home")]


def _mag_baro(payload):
    flags = payload[9]
    heading, altitude, vario = (_signed(payload[at : at + 2]) for at in (0, 2, 4))
    yield 24, 16, FIELD, ["heading %s" % ("%.1f deg" % (heading / 10) if flags & 1 else "-")]
    yield 40, 16, FIELD, ["altitude %s" % ("%d m" % altitude if flags & 2 else "-")]
    yield 56, 16, FIELD, ["vario %s" % ("%+.2f m/s" % (vario / 100) if flags & 4 else "-")]
    yield 96, 8, FIELD, ["valid 0x%02x" % flags]


def _message(payload):
    status = payload[0]
    version = (status >> 5 & 3) or 2
    text = "sequence %d" % (status & 15)
    text += ", start" if status & 0x10 else ""
    text += ", no MSP version" if version == 3 else ", MSP v%d" % version
    yield 24, 8, FIELD, [text + (", error" if status & 0x80 else ""), "status"]
    header = 1
    if status & 0x10 and version == 1:
        jumbo = payload[1] == 0xFF
        header = 5 if jumbo else 3
        yield 32, 8, FIELD, ["jumbo" if jumbo else "%d bytes" % payload[1]]
        yield 40, 8, FIELD, ["command %d" % payload[2]]
        if jumbo:
            yield 48, 16, FIELD, ["%d bytes" % _unsigned(payload[3:5])]
    elif status & 0x10 and version == 2:
        yield 32, 8, FIELD, ["flags 0x%02x" % payload[1]]
        yield 40, 16, FIELD, ["command %d" % _unsigned(payload[2:4])]
        yield 56, 16, FIELD, ["%d bytes" % _unsigned(payload[4:6])]
        header = 6
    yield from _raw(payload[header:], 3 + header)


def _response(payload):
    # The last four bytes do not go over the air.
    return _message(payload[:6])


def _raw(octets, at):
    for index, octet in enumerate(octets):
        yield 8 * (at + index), 8, FIELD, ["0x%02x" % octet]


def _unsigned(octets):
    return int.from_bytes(octets, "little")


def _signed(octets):
    return int.from_bytes(octets, "little", signed=True)


_READERS = {
    "VTX setup": _vtx_setup,
    "MSP request": _message,
    "MSP write": _message,
    "pack status": _pack_status,
    "GPS primary": _gps_primary,
    "GPS secondary": _gps_secondary,
    "mag baro": _mag_baro,
    "MSP response": _response,
}
