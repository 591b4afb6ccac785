"""What GPS receivers send of one moment: NMEA sentences, and the UBX-NAV-PVT frame of a u-blox."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from typing import NamedTuple

_DAY_MS = 86_400_000
_NAV, _NAV_PVT = 0x01, 0x07
_WORST_MM = 0xFFFFFFFF


class Place(NamedTuple):
    """Where the receiver is and what it sees.

    `fix`: 0, or 2 or 3 dimensions. `h_acc_m`: how exact it takes itself to be; `valid`: whether it
    takes the position to be one, which a u-blox says apart from the fix.
    """

    lat_deg: float
    lon_deg: float
    alt_m: float = 0.0
    speed_m_s: float = 0.0
    course_deg: float = 0.0
    satellites: int = 12
    fix: int = 3
    pdop: float = 1.4
    hdop: float = 0.9
    h_acc_m: float = 1.6
    valid: bool = True


def sentence(text: str) -> bytes:
    """The NMEA sentence with `text` between $ and *, checksum and line end added."""
    check = 0
    for byte in text.encode():
        check ^= byte
    return f"${text}*{check:02X}\r\n".encode()


def ubx(group: int, number: int, payload: bytes) -> bytes:
    """The UBX frame of class `group` and ID `number`."""
    body = struct.pack("<BBH", group, number, len(payload)) + payload
    first = second = 0
    for byte in body:
        first = (first + byte) & 0xFF
        second = (second + first) & 0xFF
    return b"\xb5\x62" + body + bytes((first, second))


def nmea_epoch(place: Place, time_ms: int, talker: str = "GP", *, gsa: bool = True) -> list[bytes]:
    """RMC, VTG, GGA and GSA of one moment, in the order in which a u-blox sends them.

    `time_ms`: of the day. Each GSA names up to twelve satellites of one system. With the talker
    GN there is one more, of a system that contributes nothing: such say "no position".
    """
    seconds, ms = divmod(time_ms % _DAY_MS, 1000)
    time = f"{seconds // 3600:02}{seconds // 60 % 60:02}{seconds % 60:02}.{ms // 10:02}"
    fix = place.fix > 0
    position = f"{_angle(place.lat_deg, 2, 'NS')},{_angle(place.lon_deg, 3, 'EW')}"
    where = position if fix else ",,,"
    knots = f"{place.speed_m_s * 3600 / 1852:.3f}" if fix else ""
    km_h = f"{place.speed_m_s * 3.6:.3f}" if fix else ""
    course = f"{place.course_deg:.2f}" if fix else ""
    height = f"{place.alt_m:.1f},M,47.9,M" if fix else ",,,"
    mode = "A" if fix else "N"
    dops = f"{place.pdop:.2f},{place.hdop:.2f},1.10"
    systems = [
        f"{place.fix or 1},{_twelve(range(first, min(first + 12, place.satellites)))},{dops}"
        for first in range(0, max(place.satellites, 1), 12)
    ]
    if talker == "GN":
        systems.append(f"1,{_twelve(())},{dops}")
    return [
        sentence(
            f"{talker}RMC,{time},{'A' if fix else 'V'},{where},{knots},{course},130726,,,{mode}"
        ),
        sentence(f"{talker}VTG,{course},T,,M,{knots},N,{km_h},K,{mode}"),
        sentence(
            f"{talker}GGA,{time},{where},{int(fix)},{place.satellites:02},"
            f"{place.hdop:.2f},{height},,"
        ),
        *[sentence(f"{talker}GSA,A,{system}") for system in systems if gsa],
    ]


def nav_pvt(place: Place, time_ms: int) -> bytes:
    """The UBX-NAV-PVT frame of one moment."""
    payload = bytearray(92)
    struct.pack_into("<I", payload, 0, time_ms)
    fix_ok = int(place.fix > 0)
    struct.pack_into("<BBBB", payload, 20, place.fix, fix_ok, 0, place.satellites)
    struct.pack_into("<ii", payload, 24, round(place.lon_deg * 1e7), round(place.lat_deg * 1e7))
    alt_mm = round(place.alt_m * 1000)
    struct.pack_into("<ii", payload, 32, alt_mm + 47_900, alt_mm)
    # Without a position the accuracy is as bad as it can be said.
    acc_mm = min(round(place.h_acc_m * 1000) if place.fix else _WORST_MM, _WORST_MM)
    struct.pack_into("<II", payload, 40, acc_mm, min(acc_mm * 3 // 2, _WORST_MM))
    course_e5 = round(place.course_deg * 1e5)
    struct.pack_into("<ii", payload, 60, round(place.speed_m_s * 1000), course_e5)
    struct.pack_into("<HB", payload, 76, round(place.pdop * 100), int(not place.valid))
    return ubx(_NAV, _NAV_PVT, bytes(payload))


def _twelve(satellites: Iterable[int]) -> str:
    """The twelve fields of a GSA that name satellites."""
    numbers = [f"{n + 1:02}" for n in satellites]
    return ",".join(numbers + [""] * (12 - len(numbers)))


def _angle(degrees: float, digits: int, letters: str) -> str:
    minutes_e5 = round(abs(degrees) * 60e5)
    whole, rest = divmod(minutes_e5, 60 * 100_000)
    letter = letters[degrees < 0]
    return f"{whole:0{digits}}{rest // 100_000:02}.{rest % 100_000:05},{letter}"
