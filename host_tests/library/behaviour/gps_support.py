"""What the GPS tests share: sentences and frames as receivers send them, written by us."""

import struct

from firmware.sensors.gps_stream import ALWAYS_FREE, NONE, SENTENCE, Stream


def sentence(text):
    """`text` with $ before it, checksum and line end behind it."""
    check = 0
    for byte in text.encode():
        check ^= byte
    return b"$%s*%02X\r\n" % (text.encode(), check)


def ubx(group, number, payload=b""):
    """A UBX frame."""
    body = struct.pack("<BBH", group, number, len(payload)) + payload
    first = second = 0
    for byte in body:
        first += byte
        second += first
    first &= 255
    second &= 255
    return b"\xb5\x62" + body + bytes((first, second))


PVT = {
    "fix": 3,
    "flags": 1,
    "satellites": 14,
    "lon_e7": 85_417_231,
    "lat_e7": 473_769_052,
    "alt_mm": 431_987,
    "speed_mm_s": 12_344,
    "course_e5": 271_26000,
    "pdop_centi": 137,
    "h_acc_mm": 1600,
    "flags_3": 0,
}


def changed(names, values, changes):
    """A copy of the list `values`, with `changes` ({name: value}) where `names` says."""
    values = values[:]
    for name in changes:
        values[names.index(name)] = changes[name]
    return values


def pvt(length=92, **values):
    """A NAV-PVT frame; what `values` do not name is as in PVT."""
    value = PVT.copy()
    value.update(values)
    assert len(value) == len(PVT), f"misspelt value in {values}"
    payload = bytearray(92)
    payload[20] = value["fix"]
    payload[21] = value["flags"]
    payload[23] = value["satellites"]
    struct.pack_into("<ii", payload, 24, value["lon_e7"], value["lat_e7"])
    # Above the ellipsoid, where it stands beside the one above mean sea level.
    struct.pack_into("<ii", payload, 32, value["alt_mm"] + 48_000, value["alt_mm"])
    struct.pack_into("<ii", payload, 60, value["speed_mm_s"], value["course_e5"])
    struct.pack_into("<I", payload, 40, value["h_acc_mm"])
    struct.pack_into("<HB", payload, 76, value["pdop_centi"], value["flags_3"])
    return ubx(0x01, 0x07, bytes(payload[:length]))


def found(data, piece=None, stream=None):
    """What a stream finds in `data`, fed in pieces: sentences as str, frames as bytes.

    Of a frame: class, ID, two bytes of length, payload. Returns them and the number of errors.
    """
    stream = stream or Stream()
    results = []
    at = 0
    while at < len(data):
        part = data[at : at + (piece or ALWAYS_FREE)]
        stream.feed(part, len(part))
        at += len(part)
        while True:
            kind = stream.next()
            if kind == NONE:
                break
            if kind == SENTENCE:
                results.append(bytes(stream.frame[: stream.length]).decode())
            else:
                results.append(bytes(stream.frame[: stream.length + 4]))
    return results, stream.take_errors()
