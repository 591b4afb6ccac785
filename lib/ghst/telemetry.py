"""Builds the downlink frames: what a flight controller tells the pilot's radio.

    frame = bytearray(14)
    telemetry.pack_status(frame, 16800, 29600, 1230, True)

Every builder fills the whole of a caller's 14 bytes, a `bytearray` or a writable `memoryview` of
bytes, and allocates nothing. Numbers are integers. They are rounded to the nearest step of their
field, halves up, and clamped to its range, never wrapped; only fields without a sign have a step
of more than one, and what is negative becomes 0 there. A buffer that is shorter raises
`IndexError`, one that cannot be written or a number that is no integer `TypeError`.

For the main loop only: `ghst.crc.crc8` must not be interrupted by another use of itself.
"""

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython, ptr8

from ghst.crc import crc8
from ghst.protocol import (
    ADDRESS_RX,
    FRAME_LENGTH,
    TYPE_GPS_PRIMARY,
    TYPE_GPS_SECONDARY,
    TYPE_MAG_BARO,
    TYPE_MSP_RESPONSE,
    TYPE_PACK_STATUS,
)

# Flags behind the values (description: GPS_FLAGS, MISC_FLAGS). The description has none for the
# pack; radios and other firmware know this one.
PACK_DISARMED = const(1)
GPS_FIX = const(1)
GPS_HOME_FIX = const(2)
VALID_HEADING = const(1)
VALID_ALTITUDE = const(2)
VALID_VARIO = const(4)
VALID_ALL = const(7)

MSP_CHUNK_SIZE = const(6)

_CRC_AT = const(13)

# The builders are native because the bytecode interpreter takes the locals of a function from the
# heap where there are more than a few; native code has them on the stack.


def _begin(frame, kind):
    # Byte by byte: this is what checks the buffer before viper writes to it unchecked.
    for at in range(3, 14):
        frame[at] = 0
    frame[0] = ADDRESS_RX
    frame[1] = FRAME_LENGTH
    frame[2] = kind


def _end(frame):
    frame[_CRC_AT] = crc8(frame, 2, _CRC_AT)


def _put_16(frame, at, value):
    frame[at] = value & 0xFF
    frame[at + 1] = (value >> 8) & 0xFF


@micropython.viper
def _put_32(frame: ptr8, at: int, value: int):
    # Shifting a Python integer of more than 31 bits would make another one.
    frame[at] = value & 0xFF
    frame[at + 1] = (value >> 8) & 0xFF
    frame[at + 2] = (value >> 16) & 0xFF
    frame[at + 3] = (value >> 24) & 0xFF


def _clamp(value, low, high):
    return max(low, min(high, value))


def _tens(value):
    # Clamped first: an integer near 2^30 would become an object when 5 is added.
    return (_clamp(value, 0, 655350) + 5) // 10


@micropython.native
def pack_status(frame, voltage_mv, current_ma, consumed_mah, armed):
    """Fills in the battery (0x23; description: GHST_DL_PACK_STAT).

    `voltage_mv` 0..655350 mV, `current_ma` 0..655350 mA and `consumed_mah` 0..655350 mAh, each in
    steps of 10; `armed`: whether motors may turn. The receiver adds its own voltage.
    """
    _begin(frame, TYPE_PACK_STATUS)
    _put_16(frame, 3, _tens(voltage_mv))
    _put_16(frame, 5, _tens(current_ma))
    _put_16(frame, 7, _tens(consumed_mah))
    if not armed:
        frame[10] = PACK_DISARMED
    _end(frame)


@micropython.native
def gps_primary(frame, lat_e7, lon_e7, alt_m):
    """Fills in the position (0x25; description: GHST_DL_GPS_PRIMARY); only for a GPS with a fix.

    `lat_e7` -900000000..900000000 and `lon_e7` -1800000000..1800000000 in 1e-7 degrees, north and
    east positive; `alt_m` -32768..32767 m. Beyond 107 degrees (2^30) an integer is an object on a
    32-bit port: whoever made it has allocated it, this function makes no other.
    """
    _begin(frame, TYPE_GPS_PRIMARY)
    _put_32(frame, 3, _clamp(lat_e7, -900000000, 900000000))
    _put_32(frame, 7, _clamp(lon_e7, -1800000000, 1800000000))
    _put_16(frame, 11, _clamp(alt_m, -32768, 32767))
    _end(frame)


@micropython.native
def gps_secondary(
    frame,
    speed_cm_s,
    course_decideg,
    satellites,
    home_dist_m,
    home_dir_decideg,
    fix,
    home_fix,
):
    """Fills in motion and home (0x26; description: GHST_DL_GPS_SECONDARY).

    `speed_cm_s` over ground 0..65535 cm/s; `course_decideg` and `home_dir_decideg`, where the
    aircraft goes and where home lies, 0..3600 in 0.1 degrees; `satellites` 0..255; `home_dist_m`
    0..655350 m in steps of 10; `fix`: whether there is one, `home_fix`: whether home is known.
    """
    _begin(frame, TYPE_GPS_SECONDARY)
    _put_16(frame, 3, _clamp(speed_cm_s, 0, 65535))
    _put_16(frame, 5, _clamp(course_decideg, 0, 3600))
    frame[7] = _clamp(satellites, 0, 255)
    _put_16(frame, 8, _tens(home_dist_m))
    _put_16(frame, 10, _clamp(home_dir_decideg, 0, 3600))
    frame[12] = (GPS_FIX if fix else 0) | (GPS_HOME_FIX if home_fix else 0)
    _end(frame)


@micropython.native
def mag_baro(frame, heading_decideg, alt_m, vario_cm_s, valid=VALID_ALL):
    """Fills in magnetometer, barometer and vario (0x27; description: GHST_DL_MAGBARO).

    `heading_decideg` -1800..1800 in 0.1 degrees (a compass that counts to 3599 subtracts 3600
    above 1800), `alt_m` -32000..32000 m, `vario_cm_s` -32767..32767 cm/s, up positive. A value is
    sent as not valid, and as 0, where it is None or its bit is missing in `valid`, a sum of
    VALID_HEADING, VALID_ALTITUDE and VALID_VARIO.
    """
    _begin(frame, TYPE_MAG_BARO)
    flags = 0
    if heading_decideg is not None and valid & VALID_HEADING:
        _put_16(frame, 3, _clamp(heading_decideg, -1800, 1800))
        flags |= VALID_HEADING
    if alt_m is not None and valid & VALID_ALTITUDE:
        _put_16(frame, 5, _clamp(alt_m, -32000, 32000))
        flags |= VALID_ALTITUDE
    if vario_cm_s is not None and valid & VALID_VARIO:
        _put_16(frame, 7, _clamp(vario_cm_s, -32767, 32767))
        flags |= VALID_VARIO
    frame[12] = flags
    _end(frame)


@micropython.native
def msp_response(frame, chunk):
    """Fills in a piece of an MSP response (0x28; description: GHST_DL_MSP_RESP).

    `chunk`: up to 6 bytes, the rest becomes 0; more raise `ValueError`. The first is the status
    byte, see the MSP protocol inside GHST.
    """
    size = len(chunk)
    if size > MSP_CHUNK_SIZE:
        raise ValueError(f"chunk has {size} bytes, at most {MSP_CHUNK_SIZE} fit")
    _begin(frame, TYPE_MSP_RESPONSE)
    for at in range(size):
        frame[3 + at] = chunk[at]
    _end(frame)
