"""Reading downlink frames: the values of the sample frames, and what is no such frame."""

from behaviour.support import equal, frame, sample
from ghst import downlink, telemetry
from ghst.downlink import GpsPrimary, GpsSecondary, MagBaro, MspResponse, PackStatus

_RX = 0x89
_PACK = bytes.fromhex("890c239006900b7b000000000069")


def _decoded(kind, text):
    return downlink.decode(frame(kind, bytes.fromhex(text), _RX))


def _expect(found, wanted):
    assert type(found) is type(wanted), f"{found!r} is no {wanted!r}"
    equal(found, wanted)


def _message(data):
    try:
        found = downlink.decode(data)
    except ValueError as error:
        return error.args[0]
    raise AssertionError(f"taken as {found!r}")


def sample_pack_status():
    _expect(downlink.decode(_PACK), PackStatus(16800, 29600, 1230, True, 0))


def sample_gps_primary():
    found = downlink.decode(bytes.fromhex("890c258e0b3a1ca319ecfa98019b"))
    _expect(found, GpsPrimary(473566094, -85190237, 408))


def sample_gps_secondary():
    found = downlink.decode(bytes.fromhex("890c26d204910a117b000d070361"))
    _expect(found, GpsSecondary(1234, 2705, 17, 1230, 1805, True, True))


def sample_mag_baro():
    found = downlink.decode(bytes.fromhex("890c2777fcf4ffceff0000000761"))
    _expect(found, MagBaro(-905, -12, -50))


def sample_msp_response():
    found = downlink.decode(bytes.fromhex("890c283007010102030000000056"))
    _expect(found, MspResponse(b"\x30\x07\x01\x01\x02\x03"))


def values_have_names_with_their_units():
    pack = _decoded(0x23, "0102030405060708" + "0000")
    found = pack.voltage_mv, pack.current_ma, pack.consumed_mah, pack.rx_voltage_mv, pack.armed
    equal(found, (0x201 * 10, 0x403 * 10, 0x605 * 10, 700, True))
    place = _decoded(0x25, "010203840506070809" + "8a")
    equal((place.lat_e7, place.lon_e7, place.alt_m), (0x84030201 - (1 << 32), 0x08070605, -30199))
    move = _decoded(0x26, "0102030405060708" + "0901")
    found = move.speed_cm_s, move.course_decideg, move.satellites, move.fix, move.home_fix
    equal(found, (0x201, 0x403, 5, True, False))
    equal((move.home_dist_m, move.home_dir_decideg), (0x706 * 10, 0x908))
    baro = _decoded(0x27, "0180028003800000" + "0007")
    equal((baro.heading_decideg, baro.alt_m, baro.vario_cm_s), (-32767, -32766, -32765))
    equal(_decoded(0x28, "01020304050607080900").chunk, b"\x01\x02\x03\x04\x05\x06")


def the_ends_of_every_field():
    _expect(_decoded(0x23, "ff" * 10), PackStatus(655350, 655350, 655350, False, 25500))
    _expect(_decoded(0x25, "ff" * 10), GpsPrimary(-1, -1, -1))
    _expect(_decoded(0x26, "ff" * 10), GpsSecondary(65535, 65535, 255, 655350, 65535, True, True))
    _expect(_decoded(0x27, "ff" * 10), MagBaro(-1, -1, -1))


def flags_one_by_one():
    for flags in sample(range(256), 16):
        tail = f"{flags:02x}"
        equal(_decoded(0x23, "00" * 7 + tail + "0000").armed, flags % 2 == 0, flags)
        gps = _decoded(0x26, "00" * 9 + tail)
        equal((gps.fix, gps.home_fix), (flags % 2 == 1, flags // 2 % 2 == 1), flags)
        wanted = [0 if flags >> bit & 1 else None for bit in range(3)]
        equal(_decoded(0x27, "00" * 9 + tail), tuple(wanted), flags)


def what_the_builders_build_is_read_back():
    data = bytearray(14)
    values = (11110, 22220, 33330, False)
    telemetry.pack_status(data, *values)
    _expect(downlink.decode(data), PackStatus(*values, 0))
    values = (-900000000, 1800000000, -32768)
    telemetry.gps_primary(data, *values)
    _expect(downlink.decode(data), GpsPrimary(*values))
    values = (65535, 3600, 255, 655350, 3599, False, True)
    telemetry.gps_secondary(data, *values)
    _expect(downlink.decode(memoryview(data)), GpsSecondary(*values))
    for values in ((1800, None, -32767), (None, -32000, None)):
        telemetry.mag_baro(data, *values)
        _expect(downlink.decode(data), MagBaro(*values))
    telemetry.msp_response(data, b"\xff\xfe")
    _expect(downlink.decode(data), MspResponse(b"\xff\xfe\0\0\0\0"))


def every_wrong_bit_is_seen():
    for bit in range(14 * 8):
        broken = bytearray(_PACK)
        broken[bit >> 3] ^= 1 << (bit & 7)
        assert _message(broken), bit


def messages_say_what_is_wrong():
    equal(_message(b""), "frame has 0 bytes, must be 14")
    equal(_message(_PACK[:13]), "frame has 13 bytes, must be 14")
    equal(_message(_PACK + b"\0"), "frame has 15 bytes, must be 14")
    equal(_message(b"\x82" + _PACK[1:]), "address is 0x82, must be 0x89")
    equal(_message(_PACK[:1] + b"\x0b" + _PACK[2:]), "length is 0x0b, must be 0x0c")
    equal(_message(_PACK[:13] + b"\x6a"), "CRC is 0x6a, must be 0x69")
    for kind in (0x00, 0x10, 0x22, 0x24, 0x29, 0xFF):
        wanted = f"type 0x{kind:02x} is no downlink frame (0x23, 0x25-0x28)"
        equal(_message(frame(kind, bytes(10), _RX)), wanted)


def read_trusts_what_was_checked():
    _expect(downlink.read(_PACK), PackStatus(16800, 29600, 1230, True, 0))
    wrong_crc = _PACK[:13] + b"\x00"
    _expect(downlink.read(wrong_crc), PackStatus(16800, 29600, 1230, True, 0))
    try:
        downlink.read(frame(0x24, bytes(10), _RX))
    except ValueError as error:
        equal(error.args[0], "type 0x24 is no downlink frame (0x23, 0x25-0x28)")
    else:
        raise AssertionError("taken")
