"""Reads downlink frames, what a flight controller sends: for the host side, tests and displays.

`decode` is the inverse of the builders in `ghst.telemetry`: the values it returns have their
names and units, and their order.
"""

import struct
from collections import namedtuple

from ghst.crc import crc8
from ghst.protocol import (
    ADDRESS_RX,
    FRAME_LENGTH,
    FRAME_SIZE,
    TYPE_GPS_PRIMARY,
    TYPE_GPS_SECONDARY,
    TYPE_MAG_BARO,
    TYPE_MSP_RESPONSE,
    TYPE_PACK_STATUS,
)
from ghst.telemetry import (
    GPS_FIX,
    GPS_HOME_FIX,
    MSP_CHUNK_SIZE,
    PACK_DISARMED,
    VALID_ALTITUDE,
    VALID_HEADING,
    VALID_VARIO,
)

PackStatus = namedtuple(
    "PackStatus", ("voltage_mv", "current_ma", "consumed_mah", "armed", "rx_voltage_mv")
)
GpsPrimary = namedtuple("GpsPrimary", ("lat_e7", "lon_e7", "alt_m"))
GpsSecondary = namedtuple(
    "GpsSecondary",
    (
        "speed_cm_s",
        "course_decideg",
        "satellites",
        "home_dist_m",
        "home_dir_decideg",
        "fix",
        "home_fix",
    ),
)
MagBaro = namedtuple("MagBaro", ("heading_decideg", "alt_m", "vario_cm_s"))
MspResponse = namedtuple("MspResponse", ("chunk",))


def _pack_status(frame):
    volts, amps, charge, rx_volts, flags = struct.unpack_from("<HHHBB", frame, 3)
    armed = not flags & PACK_DISARMED
    return PackStatus(10 * volts, 10 * amps, 10 * charge, armed, 100 * rx_volts)


def _gps_primary(frame):
    return GpsPrimary(*struct.unpack_from("<iih", frame, 3))


def _gps_secondary(frame):
    speed, course, satellites, distance, direction, flags = struct.unpack_from("<HHBHHB", frame, 3)
    fix = bool(flags & GPS_FIX)
    home_fix = bool(flags & GPS_HOME_FIX)
    return GpsSecondary(speed, course, satellites, 10 * distance, direction, fix, home_fix)


def _mag_baro(frame):
    heading, altitude, vario = struct.unpack_from("<hhh", frame, 3)
    flags = frame[12]
    return MagBaro(
        heading if flags & VALID_HEADING else None,
        altitude if flags & VALID_ALTITUDE else None,
        vario if flags & VALID_VARIO else None,
    )


def _msp_response(frame):
    return MspResponse(bytes(frame[3 : 3 + MSP_CHUNK_SIZE]))


_READERS = {
    TYPE_PACK_STATUS: _pack_status,
    TYPE_GPS_PRIMARY: _gps_primary,
    TYPE_GPS_SECONDARY: _gps_secondary,
    TYPE_MAG_BARO: _mag_baro,
    TYPE_MSP_RESPONSE: _msp_response,
}


def _expect(name, found, wanted):
    if found != wanted:
        raise ValueError(f"{name} is 0x{found:02x}, must be 0x{wanted:02x}")


def decode(frame):
    """Returns the values of a downlink frame, 14 bytes, as the named tuple of its type.

    `PackStatus` (0x23), `GpsPrimary` (0x25), `GpsSecondary` (0x26), `MagBaro` (0x27; None = not
    valid) or `MspResponse` (0x28; `chunk` = six bytes). Raises `ValueError` for anything that is
    no intact downlink frame (description: Telemetry Packets).
    """
    if len(frame) != FRAME_SIZE:
        raise ValueError(f"frame has {len(frame)} bytes, must be {FRAME_SIZE}")
    _expect("address", frame[0], ADDRESS_RX)
    _expect("length", frame[1], FRAME_LENGTH)
    _expect("CRC", frame[13], crc8(frame, 2, 13))
    return read(frame)


def read(frame):
    """Returns what `decode` does, of a frame whose address, length and CRC are known to be right.

    For a caller that has found the frame among other bytes and so has checked it. Raises
    `ValueError` for a type that is no downlink frame.
    """
    if frame[2] not in _READERS:
        raise ValueError(f"type 0x{frame[2]:02x} is no downlink frame (0x23, 0x25-0x28)")
    return _READERS[frame[2]](frame)
