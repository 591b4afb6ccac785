"""NAV-PVT becomes a solution, and the messages that set a u-blox up are what it expects."""

import struct

from firmware.sensors import ubx
from firmware.sensors.gps_solution import UNKNOWN, empty

from behaviour import gps_support
from behaviour.support import equal, sample

GOOD = [3, 473_769_052, 85_417_231, 432, 1234, 2713, 14, 137, 1]
NAMES = (
    "FIX",
    "LAT_E7",
    "LON_E7",
    "ALT_M",
    "SPEED_CM_S",
    "COURSE_DECIDEG",
    "SATELLITES",
    "PDOP_CENTI",
    "GOOD",
)


def _read(solution, length=92, **values):
    # As it comes from a stream: without its first two bytes.
    frame = bytearray(128)
    data = gps_support.pvt(length, **values)[2:-2]
    frame[: len(data)] = data
    return ubx.read_pvt(frame, length, solution)


def _expect(values, **wanted):
    solution = empty()
    equal(_read(solution, **values), 1, "result")
    equal(list(solution), gps_support.changed(NAMES, GOOD, wanted), NAMES)


def a_good_solution():
    _expect({})
    # As series 7 sends it.
    _expect({"length": 84})


def the_name_of_a_frame():
    for group, number, name in ((1, 7, ubx.NAV_PVT), (5, 1, ubx.ACK_ACK), (0xFF, 0x80, 0x80FF)):
        equal(ubx.name(gps_support.ubx(group, number)[2:]), name)


def positions_all_over_the_earth():
    for lat_e7, lon_e7 in (
        (0, 0),
        (-1, -1),
        (900_000_000, 1_800_000_000),
        (-900_000_000, -1_800_000_000),
        (-338_593_333, 1_512_090_000),
        (340_522_000, -1_182_437_000),
        (255, 1 << 30),
        (-256, -(1 << 30) - 1),
    ):
        _expect({"lat_e7": lat_e7, "lon_e7": lon_e7}, LAT_E7=lat_e7, LON_E7=lon_e7)


def altitudes():
    for alt_mm, alt_m in (
        (499, 0),
        (500, 1),
        (-500, 0),
        (-501, -1),
        (-417_250, -417),
        (8_848_860, 8849),
        (-10_000_500, -10_000),
        (100_000_499, 100_000),
    ):
        _expect({"alt_mm": alt_mm}, ALT_M=alt_m)


def speeds_and_courses():
    for mm_s, cm_s in ((0, 0), (4, 0), (5, 1), (999_994, 99_999), (1_000_000, 100_000)):
        _expect({"speed_mm_s": mm_s}, SPEED_CM_S=cm_s)
    for e5, decideg in ((0, 0), (4999, 0), (5000, 1), (35_994_999, 3599), (35_995_000, 0)):
        _expect({"course_e5": e5}, COURSE_DECIDEG=decideg)
    _expect({"course_e5": 36_000_000}, COURSE_DECIDEG=0)


def satellites_and_pdop():
    for satellites in (0, 255):
        _expect({"satellites": satellites}, SATELLITES=satellites)
    for pdop_centi, good in ((0, 1), (500, 1), (501, 0), (9999, 0), (65535, 0)):
        _expect({"pdop_centi": pdop_centi}, PDOP_CENTI=pdop_centi, GOOD=good)


def how_exact_it_takes_itself_to_be():
    limits = (0, 1), (10_000, 1), (10_001, 0), (0x10000, 0), (0x1000000, 0), ((1 << 32) - 1, 0)
    for h_acc_mm, good in limits:
        _expect({"h_acc_mm": h_acc_mm}, GOOD=good)


def two_dimensions_and_dead_reckoning():
    _expect({"fix": 2}, FIX=2, GOOD=0)
    _expect({"fix": 4}, FIX=3)
    # Other flags make no difference.
    _expect({"flags": 0xFF})


def without_a_fix():
    nothing = {name: UNKNOWN for name in ("ALT_M", "SPEED_CM_S", "COURSE_DECIDEG")}
    nothing.update({"FIX": 0, "LAT_E7": 0, "LON_E7": 0, "GOOD": 0})
    for fix, flags in sample(((0, 1), (1, 1), (5, 1), (6, 1), (255, 1), (3, 0), (2, 0xFE)), 4):
        _expect({"fix": fix, "flags": flags}, **nothing)
    _expect({"flags_3": 1}, **nothing)
    # Other flags make no difference there, and series 7 has none.
    _expect({"flags_3": 0xFE})
    _expect({"flags_3": 1, "length": 84})
    # Whatever stands in the other fields then.
    _expect({"fix": 0, "lat_e7": 1 << 30, "speed_mm_s": -1, "course_e5": 1 << 30}, **nothing)


def what_cannot_be_is_left_out():
    for values in sample(
        (
            {"lat_e7": 900_000_001},
            {"lat_e7": -900_000_001},
            {"lat_e7": (1 << 31) - 1},
            {"lat_e7": -1 << 31},
            {"lon_e7": 1_800_000_001},
            {"lon_e7": -1_800_000_001},
            {"lon_e7": (1 << 31) - 1},
            {"lon_e7": -1 << 31},
            {"alt_mm": 100_000_500},
            {"alt_mm": -10_000_501},
            {"alt_mm": -(1 << 31) + 48_000},
            {"speed_mm_s": -1},
            {"speed_mm_s": 1_000_001},
            {"speed_mm_s": -1 << 31},
            {"course_e5": -1},
            {"course_e5": 36_000_001},
            {"length": 83},
            {"length": 0},
        ),
        18,
    ):
        solution = empty()
        equal(_read(solution, **values), 0, values)
        equal(solution, empty(), values)


def a_message():
    # UBX-CFG-PRT, the poll, as the description prints it.
    equal(ubx.message(0x06, 0x00, b""), b"\xb5\x62\x06\x00\x00\x00\x06\x18")
    payload = bytes(range(200))
    equal(ubx.message(0x06, 0x8A, payload), gps_support.ubx(0x06, 0x8A, payload))


def the_port():
    # UART 1, no pin, 8N1, the rate, in UBX + NMEA + RTCM 2 + RTCM 3, out as wanted.
    payload = struct.pack("<BBHIIHHHH", 1, 0, 0, 0x8D0, 115200, 0x27, 3, 0, 0)
    equal(ubx.set_port(115200, 3), gps_support.ubx(0x06, 0x00, payload))
    equal(ubx.set_port(9600, 1)[14:18], b"\x80\x25\x00\x00")


def the_messages_and_the_rate():
    equal(ubx.set_pvt_on(), gps_support.ubx(0x06, 0x01, b"\x01\x07\x01"))
    equal(ubx.set_rate(100), gps_support.ubx(0x06, 0x08, b"\x64\x00\x01\x00\x00\x00"))


def the_values():
    payload = b"\x00\x01\x00\x00" + b"\x01\x00\x52\x40\x00\xc2\x01\x00"
    equal(ubx.set_values((ubx.UART1_BAUDRATE, 115200)), gps_support.ubx(0x06, 0x8A, payload))
    payload = b"\x00\x01\x00\x00" + b"\x01\x00\x21\x30\x64\x00" + b"\x02\x00\x74\x10\x00"
    equal(
        ubx.set_values((ubx.RATE_MEASUREMENT_MS, 100), (ubx.UART1_OUT_NMEA, 0)),
        gps_support.ubx(0x06, 0x8A, payload),
    )
    payload = b"\x00\x01\x00\x00" + b"\x07\x00\x91\x20\x01" + b"\x02\x00\x21\x30\x01\x00"
    equal(
        ubx.set_values((ubx.NAV_PVT_ON_UART1, 1), (ubx.RATE_NAVIGATION, 1)),
        gps_support.ubx(0x06, 0x8A, payload),
    )
