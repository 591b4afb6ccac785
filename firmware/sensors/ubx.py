"""UBX, the binary protocol of u-blox receivers: their navigation solution, and how to set them up.

Sources: u-blox interface descriptions, "UBX-NAV-PVT", "UBX-CFG-PRT", "UBX-CFG-MSG",
"UBX-CFG-RATE" (up to series 8, and still understood by series 9), "UBX-CFG-VALSET" and
"Configuration items" (from series 9 on).
"""

import struct

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython, ptr8, ptr32

from firmware.sensors.gps_solution import (
    ALT_M,
    COURSE_DECIDEG,
    FIX,
    GOOD,
    HIGHEST_ALT_M,
    HIGHEST_PDOP_CENTI,
    HIGHEST_SPEED_CM_S,
    LAT_E7,
    LON_E7,
    LOWEST_ALT_M,
    PDOP_CENTI,
    SATELLITES,
    SPEED_CM_S,
    UNKNOWN,
)

# Class and ID as a frame has them, lower byte first.
NAV_PVT = const(0x0701)
ACK_ACK = const(0x0105)

_CFG = const(0x06)
_CFG_PRT = const(0x00)
_CFG_MSG = const(0x01)
_CFG_RATE = const(0x08)
_CFG_VALSET = const(0x8A)

# Protocols of a port.
PROTOCOL_UBX = const(1)
PROTOCOL_NMEA = const(2)
_RTCM_2_AND_3 = const(0x24)

# Configuration items; the top digit of the key tells the size of the value.
UART1_BAUDRATE = const(0x40520001)
UART1_OUT_UBX = const(0x10740001)
UART1_OUT_NMEA = const(0x10740002)
NAV_PVT_ON_UART1 = const(0x20910007)
RATE_MEASUREMENT_MS = const(0x30210001)
RATE_NAVIGATION = const(0x30210002)
_VALUE_FORMATS = {1: "B", 2: "B", 3: "H", 4: "I"}
_RAM_LAYER = const(1)

_UART1 = const(1)
_MODE_8N1 = const(0x8D0)
# Series 7 sends 84 bytes, later ones 92.
_SHORTEST_PVT = const(84)
_LONG_PVT = const(92)
_WITH_DEAD_RECKONING = const(4)
_FIX_OK = const(1)  # within the limits of accuracy that the receiver was given
_INVALID_POSITION = const(1)
# hAcc of a position for home. The distance home is sent in steps of 10 m: home is right to a step.
# Under an open sky receivers say 1 to 3 m, in their first seconds 20 m and more.
_WORST_ACCURACY_MM = const(10_000)


@micropython.viper
def _checksum(body: ptr8, length: int) -> int:
    first = second = at = 0
    while at < length:
        first += body[at]
        second += first
        at += 1
    return (first & 0xFF) | (second & 0xFF) << 8


def message(group, number, payload):
    """Returns the frame of class `group` and ID `number`; allocates, as all builders here do."""
    body = struct.pack("<BBH", group, number, len(payload)) + payload
    return b"\xb5\x62" + body + struct.pack("<H", _checksum(body, len(body)))


def set_port(baudrate, protocols):
    """Returns CFG-PRT: UART 1 at `baudrate`, sends `protocols` and takes all."""
    inputs = PROTOCOL_UBX | PROTOCOL_NMEA | _RTCM_2_AND_3
    return message(
        _CFG,
        _CFG_PRT,
        struct.pack("<BBHIIHHHH", _UART1, 0, 0, _MODE_8N1, baudrate, inputs, protocols, 0, 0),
    )


def set_pvt_on():
    """Returns CFG-MSG: NAV-PVT with every solution, on the port where this comes in."""
    return message(_CFG, _CFG_MSG, bytes((NAV_PVT & 0xFF, NAV_PVT >> 8, 1)))


def set_rate(period_ms):
    """Returns CFG-RATE: a measurement every `period_ms`, each makes a solution, in UTC."""
    return message(_CFG, _CFG_RATE, struct.pack("<HHH", period_ms, 1, 0))


def set_values(*items):
    """Returns CFG-VALSET, in RAM only; `items`: pairs of a key and its value.

    A receiver that does not know one of the keys takes none of them.
    """
    payload = struct.pack("<BBH", 0, _RAM_LAYER, 0)
    for key, value in items:
        payload += struct.pack("<I" + _VALUE_FORMATS[key >> 28], key, value)
    return message(_CFG, _CFG_VALSET, payload)


@micropython.viper
def name(frame: ptr8) -> int:
    """Returns class and ID of a frame from `gps_stream`: NAV_PVT, ACK_ACK, ..."""
    return frame[0] | frame[1] << 8


@micropython.viper
def read_pvt(frame: ptr8, length: int, solution: ptr32) -> int:
    """Writes a NAV-PVT frame from `gps_stream` to `solution` (`gps_solution`).

    `length`: bytes of payload. Returns 1; 0, and leaves `solution` alone, if the frame is too
    short or says what cannot be.
    """
    if length < _SHORTEST_PVT:
        return 0
    # The top byte has the sign, on ports of more than 32 bits as well. All offsets are those of
    # the payload plus four.
    longitude_e7 = frame[28] | frame[29] << 8 | frame[30] << 16
    longitude_e7 |= ((frame[31] ^ 0x80) - 0x80) << 24
    latitude_e7 = frame[32] | frame[33] << 8 | frame[34] << 16
    latitude_e7 |= ((frame[35] ^ 0x80) - 0x80) << 24
    alt_mm = frame[40] | frame[41] << 8 | frame[42] << 16
    alt_mm |= ((frame[43] ^ 0x80) - 0x80) << 24
    alt_m = (alt_mm + 500) // 1000
    speed_mm_s = frame[64] | frame[65] << 8 | frame[66] << 16
    speed_mm_s |= ((frame[67] ^ 0x80) - 0x80) << 24
    course_e5 = frame[68] | frame[69] << 8 | frame[70] << 16
    course_e5 |= ((frame[71] ^ 0x80) - 0x80) << 24

    fix = int(frame[24])
    if fix == _WITH_DEAD_RECKONING:
        fix = 3
    if not frame[25] & _FIX_OK or fix < 2 or fix > 3:
        fix = 0
    # What is reserved in the short one.
    if length >= _LONG_PVT and frame[82] & _INVALID_POSITION:
        fix = 0
    quarter = 900000000  # 1.8e9 would be no small integer
    from_greenwich = longitude_e7 if longitude_e7 >= 0 else 0 - longitude_e7
    if fix and (
        latitude_e7 > quarter
        or latitude_e7 < 0 - quarter
        or from_greenwich - quarter > quarter
        or alt_m < int(LOWEST_ALT_M)
        or alt_m > int(HIGHEST_ALT_M)
        or speed_mm_s < 0
        or speed_mm_s > 10 * int(HIGHEST_SPEED_CM_S)
        or course_e5 < 0
        or course_e5 > 36000000
    ):
        return 0
    solution[int(FIX)] = fix
    if fix:
        solution[int(LAT_E7)] = latitude_e7
        solution[int(LON_E7)] = longitude_e7
        solution[int(ALT_M)] = alt_m
        solution[int(SPEED_CM_S)] = (speed_mm_s + 5) // 10
        solution[int(COURSE_DECIDEG)] = (course_e5 + 5000) // 10000 % 3600
    else:
        unknown = int(UNKNOWN)
        solution[int(ALT_M)] = unknown
        solution[int(SPEED_CM_S)] = unknown
        solution[int(COURSE_DECIDEG)] = unknown
    solution[int(SATELLITES)] = frame[27]
    pdop_centi = frame[80] | frame[81] << 8
    solution[int(PDOP_CENTI)] = pdop_centi
    accuracy_mm = frame[44] | frame[45] << 8 | frame[46] << 16
    good = 0
    if (
        fix == 3
        and pdop_centi <= int(HIGHEST_PDOP_CENTI)
        and frame[47] == 0
        and accuracy_mm <= _WORST_ACCURACY_MM
    ):
        good = 1
    solution[int(GOOD)] = good
    return 1
