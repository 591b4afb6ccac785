"""The builders of downlink frames: every field, its steps, its limits, its flags."""

import struct

from behaviour.support import equal, frame, sample
from ghst import telemetry

_RX = 0x89


def _built(build, *arguments, **keywords):
    """The frame that `build` makes of a buffer full of something else."""
    data = bytearray(b"\xa5" * 14)
    equal(build(data, *arguments, **keywords), None)
    return bytes(data)


def _expect(kind, payload, build, *arguments, **keywords):
    wanted = frame(kind, payload, _RX)
    equal(_built(build, *arguments, **keywords), wanted, (arguments, keywords))


def _error(build, *arguments):
    """What a call raises, and what it says."""
    try:
        build(*arguments)
    except Exception as error:
        return type(error), error.args[0] if error.args else None
    raise AssertionError("nothing was raised")


def _pack(*arguments):
    volts, amps, charge, zero, flags, rest = struct.unpack_from(
        "<HHHBBH", _built(telemetry.pack_status, *arguments), 3
    )
    equal((zero, rest), (0, 0), arguments)
    return volts, amps, charge, flags


def _primary(*arguments):
    return struct.unpack_from("<iih", _built(telemetry.gps_primary, *arguments), 3)


def _secondary(*arguments):
    return struct.unpack_from("<HHBHHB", _built(telemetry.gps_secondary, *arguments), 3)


def _baro(*arguments):
    data = _built(telemetry.mag_baro, *arguments)
    equal(data[9:12], bytes(3), arguments)
    heading, altitude, vario = struct.unpack_from("<hhh", data, 3)
    return heading, altitude, vario, data[12]


def sample_pack_status():
    wanted = bytes.fromhex("890c239006900b7b000000000069")
    equal(_built(telemetry.pack_status, 16800, 29600, 1230, True), wanted)


def sample_gps_primary():
    wanted = bytes.fromhex("890c258e0b3a1ca319ecfa98019b")
    equal(_built(telemetry.gps_primary, 473566094, -85190237, 408), wanted)


def sample_gps_secondary():
    wanted = bytes.fromhex("890c26d204910a117b000d070361")
    found = _built(telemetry.gps_secondary, 1234, 2705, 17, 1230, 1805, True, True)
    equal(found, wanted)


def sample_mag_baro():
    wanted = bytes.fromhex("890c2777fcf4ffceff0000000761")
    equal(_built(telemetry.mag_baro, -905, -12, -50), wanted)


def sample_msp_response():
    wanted = bytes.fromhex("890c283007010102030000000056")
    equal(_built(telemetry.msp_response, b"\x30\x07\x01\x01\x02\x03"), wanted)


_TENS = (
    (0, 0),
    (4, 0),
    (5, 1),
    (14, 1),
    (15, 2),
    (25, 3),
    (16804, 1680),
    (16805, 1681),
    (655344, 65534),
    (655345, 65535),
    (655350, 65535),
    (655355, 65535),
    (655360, 65535),
    ((1 << 30) - 1, 65535),
    (1 << 30, 65535),
    ((1 << 31) + 5, 65535),
    ((1 << 32) + 5, 65535),
    (1 << 70, 65535),
    (-1, 0),
    (-5, 0),
    (-15, 0),
    (-655360, 0),
    (-(1 << 30) - 1, 0),
    (-(1 << 32) + 5, 0),
)


def fields_in_steps_of_ten_are_rounded_half_up_and_clamped():
    for value, wanted in _TENS:
        equal(_pack(value, 0, 0, True), (wanted, 0, 0, 0), value)
        equal(_pack(0, value, 0, True), (0, wanted, 0, 0), value)
        equal(_pack(0, 0, value, True), (0, 0, wanted, 0), value)
        equal(_secondary(0, 0, 0, value, 0, False, False), (0, 0, 0, wanted, 0, 0), value)


def every_step_of_ten_is_the_nearest():
    for step in sample(range(1, 65535), 10):
        found = _pack(10 * step - 5, 10 * step, 10 * step + 4, True)
        equal(found, (step, step, step, 0))


def the_pack_s_flag_says_disarmed():
    equal(_pack(1, 2, 3, True), (0, 0, 0, 0))
    equal(_pack(1, 2, 3, False), (0, 0, 0, 1))
    equal(_pack(1, 2, 3, 1), (0, 0, 0, 0))
    equal(_pack(1, 2, 3, 0), (0, 0, 0, 1))


def positions_over_the_whole_globe():
    for lat_e7, lon_e7 in (
        (0, 0),
        (1, -1),
        (-1, 1),
        (900000000, 1800000000),
        (-900000000, -1800000000),
        (1 << 24, 1 << 30),
        (-(1 << 24), -(1 << 30)),
        ((1 << 24) - 1, (1 << 30) - 1),
        (0x12345678, 0x6789ABCD - (1 << 30)),
        (-0x12345678, -0x6789ABCD),
        (1, 0x6789ABCD),
    ):
        equal(_primary(lat_e7, lon_e7, 0), (lat_e7, lon_e7, 0))


def positions_beyond_the_globe_are_clamped():
    for excess in (1, 1000, 1 << 31, 1 << 32, (1 << 32) + 1, 1 << 80):
        above = _primary(900000000 + excess, 1800000000 + excess, 0)
        equal(above, (900000000, 1800000000, 0), excess)
        below = _primary(-900000000 - excess, -1800000000 - excess, 0)
        equal(below, (-900000000, -1800000000, 0), excess)


def _expect_clamped(read, low, high):
    """`read` gives back what it was given, but nothing outside `low`..`high`."""
    inside = [low, low + 1, 0, 1, 255, 256, high - 1, high]
    for value in inside:
        if low <= value <= high:
            equal(read(value), value)
    for excess in (1, 255, 256, 65536, 1 << 30, 1 << 32, 1 << 70):
        equal(read(low - excess), low, excess)
        equal(read(high + excess), high, excess)


def gps_altitude_is_signed_and_clamped():
    _expect_clamped(lambda value: _primary(0, 0, value)[2], -32768, 32767)


def ground_speed_is_clamped():
    _expect_clamped(lambda value: _secondary(value, 0, 0, 0, 0, 0, 0)[0], 0, 65535)


def course_and_direction_home_end_at_3600():
    _expect_clamped(lambda value: _secondary(0, value, 0, 0, 0, 0, 0)[1], 0, 3600)
    _expect_clamped(lambda value: _secondary(0, 0, 0, 0, value, 0, 0)[4], 0, 3600)


def satellites_are_clamped():
    _expect_clamped(lambda value: _secondary(0, 0, value, 0, 0, 0, 0)[2], 0, 255)


def heading_is_clamped():
    _expect_clamped(lambda value: _baro(value, 0, 0)[0], -1800, 1800)


def barometric_altitude_is_clamped():
    _expect_clamped(lambda value: _baro(0, value, 0)[1], -32000, 32000)


def vario_is_clamped():
    _expect_clamped(lambda value: _baro(0, 0, value)[2], -32767, 32767)


def fix_and_home_have_a_flag_each():
    for fix in (False, True):
        for home_fix in (False, True):
            found = _secondary(1, 2, 3, 40, 5, fix, home_fix)
            equal(found, (1, 2, 3, 4, 5, fix * 1 + home_fix * 2))


def what_is_none_is_not_valid():
    values = (-905, -12, -50)
    for present in range(8):
        wanted = [values[at] if present >> at & 1 else 0 for at in range(3)]
        given = [values[at] if present >> at & 1 else None for at in range(3)]
        wanted.append(present)
        equal(_baro(*given), tuple(wanted))


def valid_takes_values_out_as_none_does():
    values = (-905, -12, -50)
    for valid in range(8):
        wanted = [values[at] if valid >> at & 1 else 0 for at in range(3)]
        wanted.append(valid)
        equal(_baro(*values, valid), tuple(wanted))
    bits = telemetry.VALID_HEADING, telemetry.VALID_ALTITUDE, telemetry.VALID_VARIO
    equal((bits, telemetry.VALID_ALL), ((1, 2, 4), 7))
    equal(_baro(None, 7, 8, telemetry.VALID_HEADING | telemetry.VALID_VARIO), (0, 0, 8, 4))
    equal(_baro(1, 2, 3, 0xF8), (0, 0, 0, 0))


def zero_is_a_valid_value():
    equal(_baro(0, 0, 0), (0, 0, 0, 7))


def every_builder_takes_its_arguments_by_name():
    _expect(
        0x23,
        bytes.fromhex("01000200030000010000"),
        telemetry.pack_status,
        voltage_mv=10,
        current_ma=20,
        consumed_mah=30,
        armed=False,
    )
    _expect(
        0x25,
        bytes.fromhex("0100000002000000" + "0300"),
        telemetry.gps_primary,
        lat_e7=1,
        lon_e7=2,
        alt_m=3,
    )
    _expect(
        0x26,
        bytes.fromhex("0100020003040005" + "0002"),
        telemetry.gps_secondary,
        speed_cm_s=1,
        course_decideg=2,
        satellites=3,
        home_dist_m=40,
        home_dir_decideg=5,
        fix=False,
        home_fix=True,
    )
    _expect(
        0x27,
        bytes.fromhex("010002000000000000" + "03"),
        telemetry.mag_baro,
        heading_decideg=1,
        alt_m=2,
        vario_cm_s=3,
        valid=telemetry.VALID_HEADING | telemetry.VALID_ALTITUDE,
    )
    _expect(0x28, b"\x11\x22" + bytes(8), telemetry.msp_response, chunk=b"\x11\x22")


def msp_chunks_of_up_to_six_bytes():
    chunk = bytes(range(0xF0, 0xF6))
    for size in range(7):
        for part in (chunk[:size], bytearray(chunk[:size]), memoryview(chunk)[:size]):
            _expect(0x28, chunk[:size] + bytes(10 - size), telemetry.msp_response, part)


def an_msp_chunk_that_is_too_long_leaves_the_frame_alone():
    data = bytearray(14)
    found = _error(telemetry.msp_response, data, bytes(7))
    equal(found, (ValueError, "chunk has 7 bytes, at most 6 fit"))
    equal(data, bytearray(14))


_CALLS = (
    (telemetry.pack_status, 12340, 5670, 890, True),
    (telemetry.gps_primary, -123456789, 1234567890, -321),
    (telemetry.gps_secondary, 1111, 2222, 33, 44440, 3333, True, False),
    (telemetry.mag_baro, 111, -222, 333),
    (telemetry.msp_response, b"\x81\x02\x03\x04\x05\x06"),
)


def a_part_of_a_larger_buffer_will_do():
    for build, *arguments in _CALLS:
        buffer = bytearray(b"\x5a" * 40)
        build(memoryview(buffer)[13:27], *arguments)
        equal(buffer[:13] + buffer[27:], bytearray(b"\x5a" * 26))
        equal(bytes(buffer[13:27]), _built(build, *arguments))


def of_a_longer_buffer_the_first_14_bytes_are_the_frame():
    for build, *arguments in _CALLS:
        buffer = bytearray(b"\x5a" * 20)
        build(buffer, *arguments)
        equal(bytes(buffer), _built(build, *arguments) + b"\x5a" * 6)


def a_buffer_that_is_too_short_is_not_overrun():
    for build, *arguments in _CALLS:
        for size in (0, 3, 13):
            buffer = bytearray(b"\x5a" * 40)
            equal(_error(build, memoryview(buffer)[10 : 10 + size], *arguments)[0], IndexError)
            equal(buffer[:10] + buffer[10 + size :], bytearray(b"\x5a" * (40 - size)))


def a_buffer_that_cannot_be_written_is_not():
    for build, *arguments in _CALLS:
        data = b"\x5a\x5a" * 7
        equal(_error(build, data, *arguments)[0], TypeError)
        equal(_error(build, memoryview(data), *arguments)[0], TypeError)
        equal(data, b"\x5a\x5a" * 7)


def numbers_have_to_be_integers():
    for build, *arguments in _CALLS[:4]:
        for place in range(len(arguments)):
            if arguments[place] is True or arguments[place] is False:
                continue
            broken = list(arguments)
            for value in (1.5, "1", b"1"):
                broken[place] = value
                equal(_error(build, bytearray(14), *broken)[0], TypeError, (place, value))
            if build is not telemetry.mag_baro:
                broken[place] = None
                equal(_error(build, bytearray(14), *broken)[0], TypeError, place)
