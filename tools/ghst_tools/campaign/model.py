"""An independent model of the receive half of GHST, written from the protocol's description.

It shares no code, constant or structure with `lib/ghst`: the CRC is a polynomial division of one
big integer, scaling is done in fractions of a microsecond, frames are found by a regular
expression over everything that is not decoded yet. Slow and obvious.
"""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields
from fractions import Fraction

DVB_S2 = 0b1_1101_0101
"""x^8 + x^7 + x^6 + x^4 + x^2 + 1."""

FC = 0x82
CONTROL_TYPES = (*range(0x10, 0x20), *range(0x30, 0x40))

_FRAME_START = re.compile(rb"[\x80-\x89][\x02-\x0c]", re.DOTALL)
_BAD_LENGTH = re.compile(rb"[\x80-\x89](?=[^\x02-\x0c])", re.DOTALL)


def crc(message: bytes) -> int:
    """Remainder of the message times x^8 divided by the polynomial, over GF(2)."""
    remainder = int.from_bytes(message, "big") << 8
    while (excess := remainder.bit_length() - DVB_S2.bit_length()) >= 0:
        remainder ^= DVB_S2 << excess
    return remainder


def frame(address: int, kind: int, payload: bytes) -> bytes:
    """A whole frame with a right length byte and CRC."""
    body = bytes([kind]) + payload
    return bytes([address, len(body) + 1]) + body + bytes([crc(body)])


def control(kind: int, primaries: Sequence[int], tail: Iterable[int]) -> bytes:
    """A control frame from four raw primaries and the four raw bytes behind them."""
    digits = "".join(f"{raw:03x}" for raw in reversed(primaries))
    return frame(FC, kind, bytes.fromhex(digits)[::-1] + bytes(tail))


def quarter_us(kind: int, raw: int, *, primary: bool) -> int:
    """Pulse width of a raw value: 1500 us plus steps from the centre, down to a quarter us."""
    twelve_bit = kind >= 0x30
    if primary:
        centre, step_us = (2048, Fraction(1, 4)) if twelve_bit else (1984, Fraction(5, 16))
    else:
        centre, step_us = (128, Fraction(4)) if twelve_bit else (124, Fraction(5))
    return math.floor(4 * (1500 + (raw - centre) * step_us))


def percent(rssi_dbm: int) -> int:
    """-117 dBm is 0 %, -60 dBm 100 %, linear between, clamped, half a percent rounds up."""
    share = Fraction(rssi_dbm + 117, 117 - 60)
    return math.floor(100 * min(max(share, Fraction(0)), Fraction(1)) + Fraction(1, 2))


@dataclass
class Model:
    """What a `ghst.Receiver` has to show after the same bytes, under the same names."""

    pulses: list[int] = field(default_factory=lambda: [0] * 16)
    lq: int = 0
    rssi_dbm: int = 0
    rssi_percent: int = 0
    rf_mode: int = 0
    telemetry_requested: bool = False
    alt_scale: bool = False
    tx_power_dbm: int = 0
    vtx_flags: int = 0
    vtx_freq_mhz: int = 0
    vtx_power_mw: int = 0
    vtx_band_channel: int = 0
    vtx_control: bytes = bytes(4)
    frames: int = 0
    crc_errors: int = 0
    length_errors: int = 0
    unknown_frames: int = 0
    foreign_frames: int = 0
    msp_frames: int = 0
    vtx_setups: int = 0
    vtx_controls: int = 0
    skipped_bytes: int = 0
    msp_lost: int = 0
    msp_waiting: list[bytes] = field(default_factory=list)
    pending: bytes = b""
    frame_bytes: int = 0

    def feed(self, data: bytes) -> int:
        """Takes received bytes; returns how many control frames they completed."""
        before = self.frames
        self.pending += data
        while (start := _FRAME_START.search(self.pending)) is not None:
            self._skip(start.start())
            size = self.pending[1] + 2
            if len(self.pending) < size:
                return self.frames - before
            if crc(self.pending[2 : size - 1]) == self.pending[size - 1]:
                found, self.pending = self.pending[:size], self.pending[size:]
                self.frame_bytes += size
                self._accept(found[0], found[2], found[3:-1])
            else:
                self.crc_errors += 1
                self._skip(1)
        # The last byte may be an address whose length has not come yet.
        self._skip(max(0, len(self.pending) - 1))
        return self.frames - before

    def next_msp(self, payload: bytearray) -> bool:
        """Copies the payload of the oldest MSP frame that waits; False if none does."""
        if not self.msp_waiting:
            return False
        payload[:] = self.msp_waiting[0]
        self.msp_waiting = self.msp_waiting[1:]
        return True

    def discard_partial(self) -> None:
        """Drops an unfinished frame, as a line that goes quiet inside it does."""
        self.skipped_bytes += len(self.pending)
        self.pending = b""

    def _skip(self, count: int) -> None:
        # One byte beyond what is skipped: a length byte may be the start of the next frame.
        places = _BAD_LENGTH.findall(self.pending[: count + 1])
        self.length_errors += len(places)
        self.skipped_bytes += count
        self.pending = self.pending[count:]

    def _accept(self, address: int, kind: int, payload: bytes) -> None:
        whole = len(payload) == 10
        if address != FC:
            self.foreign_frames += 1
            if kind == 0x20 and whole and address in (0x80, 0x83):
                self.vtx_setups += 1
                self.vtx_flags = payload[0]
                self.vtx_freq_mhz = int.from_bytes(payload[1:3], "little")
                self.vtx_power_mw = int.from_bytes(payload[3:5], "little")
                self.vtx_band_channel = payload[5]
        elif kind in CONTROL_TYPES:
            if whole:
                self._control(kind, payload)
            else:
                self.length_errors += 1
        elif kind in (0x21, 0x22):
            if whole:
                self.msp_frames += 1
                self.msp_lost += len(self.msp_waiting) == 8
                self.msp_waiting = [*self.msp_waiting, payload][-8:]
            else:
                self.unknown_frames += 1
        else:
            self.unknown_frames += 1

    def _control(self, kind: int, payload: bytes) -> None:
        self.frames += 1
        digits = payload[5::-1].hex()
        primaries = [int(digits[at : at + 3], 16) for at in (9, 6, 3, 0)]
        self.pulses[:4] = [quarter_us(kind, raw, primary=True) for raw in primaries]
        tail = payload[6:]
        first = {0: 4, 1: 8, 2: 12}.get(kind % 16)
        if first is not None:
            auxiliaries = [quarter_us(kind, raw, primary=False) for raw in tail]
            self.pulses[first : first + 4] = auxiliaries
        elif kind % 16 == 3:
            self.lq = tail[0]
            self.rssi_dbm = -tail[1]
            # Nothing in both bytes: a receiver that does not know its link yet.
            self.rssi_percent = percent(-tail[1]) if tail[1] or tail[2] else 0
            bits = f"{tail[2]:08b}"
            self.rf_mode = int(bits[3:], 2)
            self.telemetry_requested = bits[2] == "1"
            self.alt_scale = bits[1] == "1"
            self.tx_power_dbm = int.from_bytes(tail[3:], "big", signed=True)
        elif kind == 0x14:
            self.vtx_controls += 1
            self.vtx_control = tail


VALUES = tuple(
    entry.name
    for entry in fields(Model)
    if entry.name not in ("pending", "frame_bytes", "msp_waiting", "msp_lost")
)
"""What a `ghst.Receiver` has at any time; `msp_lost` it counts when `next_msp` is called."""


def differences(model: Model, receiver: object) -> list[str]:
    """One line for each value in which a `ghst.Receiver` is not as the model."""
    lines = []
    for name in VALUES:
        wanted, found = getattr(model, name), getattr(receiver, name)
        if name == "pulses":
            found = list(found)
        if found != wanted:
            lines.append(f"{name}: {found!r}, the model has {wanted!r}")
    return lines
