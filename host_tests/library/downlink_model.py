"""An independent model of the downlink: frames, the radio's arithmetic, and whose turn it is.

Written from the protocol's description and from what radios do with the values; it shares no code
with `lib/ghst`. Fields are rounded as fractions and then cut off, bytes come from
`int.to_bytes`, times are integers without an end.
"""

import math
from dataclasses import dataclass, field
from fractions import Fraction

from ghst_tools.campaign.model import frame

RX = 0x89


def _unsigned(value: int, step: int = 1, highest: int = 0xFFFF, size: int = 2) -> bytes:
    steps = math.floor(Fraction(value, step) + Fraction(1, 2))
    return min(max(steps, 0), highest).to_bytes(size, "little")


def _signed(value: int, lowest: int, highest: int, size: int = 2) -> bytes:
    return sorted((lowest, value, highest))[1].to_bytes(size, "little", signed=True)


def pack_status(voltage_mv: int, current_ma: int, consumed_mah: int, armed: bool) -> bytes:
    fields = [_unsigned(value, step=10) for value in (voltage_mv, current_ma, consumed_mah)]
    return frame(RX, 0x23, b"".join(fields) + bytes([0, 0 if armed else 1, 0, 0]))


def gps_primary(lat_e7: int, lon_e7: int, alt_m: int) -> bytes:
    latitude = _signed(lat_e7, -90 * 10**7, 90 * 10**7, size=4)
    longitude = _signed(lon_e7, -180 * 10**7, 180 * 10**7, size=4)
    return frame(RX, 0x25, latitude + longitude + _signed(alt_m, -32768, 32767))


def gps_secondary(
    speed_cm_s: int,
    course_decideg: int,
    satellites: int,
    home_dist_m: int,
    home_dir_decideg: int,
    fix: bool,
    home_fix: bool,
) -> bytes:
    payload = _unsigned(speed_cm_s) + _unsigned(course_decideg, highest=3600)
    payload += _unsigned(satellites, highest=0xFF, size=1) + _unsigned(home_dist_m, step=10)
    payload += _unsigned(home_dir_decideg, highest=3600)
    return frame(RX, 0x26, payload + bytes([0b01 * fix + 0b10 * home_fix]))


def mag_baro(
    heading_decideg: int | None, alt_m: int | None, vario_cm_s: int | None, valid: int = 0b111
) -> bytes:
    payload, flags = b"", 0
    ranges = ((heading_decideg, 1800), (alt_m, 32000), (vario_cm_s, 32767))
    for place, (value, limit) in enumerate(ranges):
        if value is None or not valid >> place & 1:
            payload += bytes(2)
        else:
            payload += _signed(value, -limit, limit)
            flags += 2**place
    return frame(RX, 0x27, payload + bytes(3) + bytes([flags]))


def msp_response(chunk: bytes) -> bytes:
    return frame(RX, 0x28, chunk.ljust(10, b"\0"))


BUILDERS = {
    builder.__name__: builder
    for builder in (pack_status, gps_primary, gps_secondary, mag_baro, msp_response)
}


def _trunc(value: int, divisor: int) -> int:
    """Division as the radio's C does it: towards zero."""
    return abs(value) // divisor * (1 if value >= 0 else -1)


def _fixed(value: int, digits: int) -> str:
    sign = "-" if value < 0 else ""
    whole, rest = divmod(abs(value), 10**digits)
    return f"{sign}{whole}.{rest:0{digits}d}"


def radio_shows(data: bytes) -> dict[str, str]:
    """What the sensors of a pilot's radio show after a frame, by the arithmetic of its firmware.

    The radio shows nothing of home, and nothing of 0x27 yet.
    """

    def number(at: int, size: int = 2, *, signed: bool = False) -> int:
        return int.from_bytes(data[at : at + size], "little", signed=signed)

    match data[2]:
        case 0x23:
            return {
                "V": _fixed(number(3), 2),
                "A": _fixed(number(5), 2),
                "mAh": str(number(7) * 10),
            }
        case 0x25:
            return {
                "lat": _fixed(_trunc(number(3, 4, signed=True), 10), 6),
                "lon": _fixed(_trunc(number(7, 4, signed=True), 10), 6),
                "m": str(number(11, signed=True)),
            }
        case 0x26:
            return {
                "km/h": _fixed((number(3) * 36 + 50) // 100, 1),
                "deg": str(number(5) // 10),
                "satellites": str(data[7]),
            }
    return {}


@dataclass
class Turn:
    """One kind of frame: when it is due, and until when its values are good."""

    kind: int
    timeout_ms: int
    period_ms: int
    live: bool = False
    refreshed_ms: int = 0
    due_ms: int = 0


@dataclass
class Turns:
    """The scheduler, for a clock that starts anywhere and never wraps."""

    turns: list[Turn] = field(default_factory=list)

    def refresh(self, place: int, now_ms: int) -> None:
        turn = self.turns[place]
        if not turn.live:
            turn.live, turn.due_ms = True, now_ms
        turn.refreshed_ms = now_ms

    def next(self, now_ms: int) -> int:
        for turn in self.turns:
            turn.live &= now_ms <= turn.refreshed_ms + turn.timeout_ms
        due = [turn for turn in self.turns if turn.live and turn.due_ms <= now_ms]
        if not due:
            return 0
        first = min(due, key=lambda turn: turn.due_ms)
        first.due_ms = max(now_ms, first.due_ms + first.period_ms)
        return first.kind
