"""What the behaviour tests share: frames, and the whole state of a receiver."""

import sys

import ghst
from ghst import decoder

try:
    from micropython import heap_lock, heap_unlock
except ImportError:  # CPython has no heap to lock

    def heap_lock():
        pass

    def heap_unlock():
        pass


FC = 0x82
CENTRE = 6000
AT_CENTRE = ((1, 6000, 6000, 6000, 6000),)

_EMULATED = sys.platform == "rp2"

FRESH = {
    "frames": 0,
    "crc_errors": 0,
    "length_errors": 0,
    "unknown_frames": 0,
    "foreign_frames": 0,
    "msp_frames": 0,
    "msp_lost": 0,
    "vtx_setups": 0,
    "vtx_controls": 0,
    "skipped_bytes": 0,
    "lq": 0,
    "rssi_dbm": 0,
    "rssi_percent": 0,
    "rf_mode": 0,
    "telemetry_requested": False,
    "alt_scale": False,
    "tx_power_dbm": 0,
    "vtx_flags": 0,
    "vtx_freq_mhz": 0,
    "vtx_power_mw": 0,
    "vtx_band_channel": 0,
    "vtx_control": b"\0\0\0\0",
}


def sample(values, few):
    """All of `values`; where time is emulated only `few` of them, spread from first to last."""
    if not _EMULATED:
        return values
    if few == 1:
        return values[-1:]
    last = len(values) - 1
    return [values[last * at // (few - 1)] for at in range(few)]


def unfinished(receiver):
    """How many bytes wait for the rest of their frame."""
    head = decoder.word(receiver.memory, decoder.HEAD)
    return (head - decoder.word(receiver.memory, decoder.TAIL)) & 255


def equal(found, wanted, what="result"):
    """Asserts equality and says what was found; MicroPython's assert would not."""
    assert found == wanted, f"{what} is {found!r}, must be {wanted!r}"


def expect(receiver, channels=(), **values):
    """Asserts the whole state of a receiver.

    `channels` is a sequence of (first channel, pulse, pulse, ...), channels counted from 1; all
    others must be 0. State that `values` does not name must be as in a new receiver.
    """
    pulses = [0] * 16
    for first, *group in channels:
        pulses[first - 1 : first - 1 + len(group)] = group
    wanted = FRESH.copy()
    wanted.update(values)
    assert len(wanted) == len(FRESH), f"misspelt state in {values}"
    found = {name: getattr(receiver, name) for name in wanted}
    if found != wanted:
        for name in wanted:
            equal(found[name], wanted[name], name)
    equal(list(receiver.pulses), pulses, "pulses")


def received(data, controls=1):
    """A new receiver that was fed `data`, which completed `controls` control frames."""
    receiver = ghst.Receiver()
    equal(receiver.feed(data), controls, "control frames")
    return receiver


# Frames without a byte that could be an address, so that nothing but their first byte begins one.
CENTRED_RAW = (1984, 1984, 1984, 1984)
SWUNG_RAW = (400, 3600, 400, 3600)
SWUNG = (4020, 8020, 4020, 8020)


def frame(kind, payload=bytes(10), address=FC):
    """A frame with a right length and CRC."""
    data = bytearray(len(payload) + 4)
    data[0] = address
    data[1] = len(payload) + 2
    data[2] = kind
    data[3:-1] = payload
    data[-1] = ghst.crc8(data, 2, len(data) - 1)
    return bytes(data)


def control(kind, raw, tail=bytes(4)):
    """A control frame from four raw primaries and the four raw bytes behind them."""
    first, second, third, fourth = raw
    payload = (
        first & 255,
        first >> 8 | (second & 15) << 4,
        second >> 4,
        third & 255,
        third >> 8 | (fourth & 15) << 4,
        fourth >> 4,
    )
    return frame(kind, bytes(payload) + bytes(tail))
