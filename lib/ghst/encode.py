"""Builds uplink frames, as a Ghost receiver sends them: for simulation, tests and self-tests.

Every function returns the whole frame as `bytes`. Channel values are either raw, as they stand in
the frame, or pulse widths in quarter microseconds (6000 = 1500 us). A raw value that does not fit
its field raises `ValueError`; pulse widths are clamped to what the scaling can carry.
"""

from ghst.crc import crc8

_FC = 0x82


def frame(address, kind, payload):
    """Returns `address`, length, `kind`, `payload` (0..10 bytes) and CRC (description: Frame)."""
    if len(payload) > 10:
        raise ValueError(f"payload has {len(payload)} bytes, at most 10 fit")
    body = bytes((kind,)) + bytes(payload)
    return bytes((address, len(body) + 1)) + body + bytes((crc8(body, 0, len(body)),))


def _check(name, value, low, high):
    if not low <= value <= high:
        raise ValueError(f"{name} is {value}, must be {low}..{high}")
    return value


def _primaries(raw):
    if len(raw) != 4:
        raise ValueError(f"{len(raw)} primary channels given, must be 4")
    packed = 0
    for index in range(4):
        packed |= _check("primary channel", raw[index], 0, 4095) << (12 * index)
    return packed.to_bytes(6, "little")


def _control(kind, primaries, tail):
    if kind & 0xD0 != 0x10:
        raise ValueError(f"type 0x{kind:02x} is no control frame (0x10-0x1f, 0x30-0x3f)")
    if len(tail) != 4:
        raise ValueError(f"{len(tail)} bytes follow the primaries, must be 4")
    return frame(_FC, kind, _primaries(primaries) + bytes(tail))


def raw_primary(kind, pulse):
    """Returns the raw value 0..4095 nearest to `pulse` for a primary channel of type `kind`."""
    # The legacy decoder rounds 5 raw / 4 down, so the inverse rounds up.
    raw = pulse - 3952 if kind & 0x20 else ((pulse - 3520) * 4 + 4) // 5
    return max(0, min(4095, raw))


def raw_auxiliary(kind, pulse):
    """Returns the raw value 0..255 nearest to `pulse` for an auxiliary channel of type `kind`."""
    raw = (pulse - 3944) >> 4 if kind & 0x20 else (pulse - 3510) // 20
    return max(0, min(255, raw))


def channels(kind, primaries, auxiliaries=(0, 0, 0, 0)):
    """Returns a control frame of any type from 4 raw primaries and 4 raw bytes behind them.

    Types: 0x10-0x1F legacy, 0x30-0x3F 12-bit; the four bytes are auxiliary channels in the first
    three types of each range (description: Control Packet).
    """
    return _control(kind, primaries, [_check("byte", raw, 0, 255) for raw in auxiliaries])


def channels_from_pulses(kind, pulses):
    """Returns a control frame of type 0x10-0x12 or 0x30-0x32 from 16 pulse widths.

    Carries channels 1-4 and the four auxiliaries that `kind` names; the others do not travel.
    """
    if kind & 0xDF not in (0x10, 0x11, 0x12):
        raise ValueError(f"type 0x{kind:02x} carries no auxiliary channels")
    if len(pulses) != 16:
        raise ValueError(f"{len(pulses)} pulse widths given, must be 16")
    first = 4 + 4 * (kind & 3)
    return _control(
        kind,
        [raw_primary(kind, pulse) for pulse in pulses[:4]],
        [raw_auxiliary(kind, pulse) for pulse in pulses[first : first + 4]],
    )


def link_data(
    kind,
    primaries,
    *,
    lq=100,
    rssi_dbm=-60,
    rf_mode=6,
    telemetry=False,
    alt_scale=False,
    tx_power_dbm=20,
):
    """Returns a link data frame, `kind` 0x13 or 0x33, with 4 raw primaries.

    `lq` 0..100 %, `rssi_dbm` -255..0, `rf_mode` 0..31, `tx_power_dbm` -128..127 (description:
    GHST_UL_RC_CHANS_HS4_RSSI, Protocol).
    """
    if kind & 0xDF != 0x13:
        raise ValueError(f"type 0x{kind:02x} is no link data (0x13, 0x33)")
    tail = (
        _check("lq", lq, 0, 255),
        -_check("rssi_dbm", rssi_dbm, -255, 0),
        _check("rf_mode", rf_mode, 0, 31) | bool(telemetry) << 5 | bool(alt_scale) << 6,
        _check("tx_power_dbm", tx_power_dbm, -128, 127) & 0xFF,
    )
    return _control(kind, primaries, tail)


def vtx_setup(flags, freq_mhz, power_mw, band_channel, address=0x80):
    """Returns a VTX set-up frame (0x20) for the radio (0x80) or the goggles (0x83)."""
    payload = bytes((_check("flags", flags, 0, 255),))
    payload += _check("freq_mhz", freq_mhz, 0, 65535).to_bytes(2, "little")
    payload += _check("power_mw", power_mw, 0, 65535).to_bytes(2, "little")
    payload += bytes((_check("band_channel", band_channel, 0, 255), 0, 0, 0, 0))
    return frame(address, 0x20, payload)


def msp(kind, payload):
    """Returns an MSP request (0x21) or write (0x22) with 10 bytes of payload."""
    if kind not in (0x21, 0x22):
        raise ValueError(f"type 0x{kind:02x} is no MSP frame (0x21, 0x22)")
    if len(payload) != 10:
        raise ValueError(f"payload has {len(payload)} bytes, must be 10")
    return frame(_FC, kind, payload)
