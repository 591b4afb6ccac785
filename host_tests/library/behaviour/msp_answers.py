"""What each message answers, byte by byte."""

from array import array

from behaviour.msp_support import V2, answer_to, chunks_of, payloads, v1, v2
from behaviour.support import equal, sample
from ghst.msp import Responder
from ghst.msp_commands import answer
from ghst.msp_state import State

_NUMBERS = (1, 2, 3, 4, 5, 10, 88, 89, 101, 105, 106, 107, 108, 109, 110, 130, 160, 250)


def _asked(number, data=b"", **values):
    """The answer to `number`, in MSP v1 and v2 alike, when `values` are the state's."""
    state = State()
    for name, value in values.items():
        assert hasattr(state, name), name
        setattr(state, name, value)
    responder = Responder()
    answer(responder, state)
    first = answer_to(responder, v1(number, data))
    equal(answer_to(responder, v2(number, data), V2), first)
    equal((responder.errors, responder.last_error), (0, None))
    return first


def _expect(found, wanted):
    equal(found, bytes.fromhex(wanted))


def everything_is_answered_when_nothing_is_known():
    responder = Responder()
    answer(responder, State(), None, lambda: True)
    for number in list(sample(range(256), 3)) + list(sample(_NUMBERS, 5)):
        data = b"\x1f\x01" if number == 89 else b""
        responder.feed(payloads(v1(number, data))[0])
        error = chunks_of(responder)[0][0] & 0x80
        equal(error == 0, number in _NUMBERS, number)
    equal(responder.last_error, None)


def api_version():
    _expect(_asked(1), "00 01 2c")


def fc_variant():
    equal(_asked(2), b"GHMP")


def fc_version():
    equal(_asked(3, version=(1, 22, 3)), b"\x01\x16\x03")


def board_info():
    found = _asked(
        4,
        board_identifier=b"RP20",
        target_name=b"RPI_PICO",
        board_name=b"Pico",
        manufacturer_id=b"RPI",
    )
    names = b"\x08RPI_PICO\x04Pico\x03RPI"
    equal(found, b"RP20\0\0\0\x01" + names + bytes(32) + b"\xff\x02" + bytes(8))
    equal(_asked(4), b"    \0\0\0\x01\0\0\0" + bytes(32) + b"\xff\x02" + bytes(8))


def build_info():
    found = _asked(5, build_date=b"Jan 31 2025", build_time=b"23:59:58", build_revision=b"0123abc")
    equal(found, b"Jan 31 202523:59:580123abc")
    equal(_asked(5), b" " * 26)


def name():
    equal(_asked(10, craft_name=b"Kestrel"), b"Kestrel")
    equal(_asked(10, craft_name="Kestrel"), b"Kestrel")
    equal(_asked(10), b"")


def uid():
    equal(_asked(160, uid=bytes(range(1, 13))), bytes(range(1, 13)))
    equal(_asked(160, uid=b"\x01\x02\x03\x04\x05\x06\x07\x08"), bytes(range(1, 9)) + bytes(4))


def status():
    _expect(_asked(101), "0000 0000 0000 00000000 00 0000 0000 00 00 00000000 00")
    found = _asked(
        101,
        cycle_time_us=1000,
        i2c_errors=258,
        load_percent=37,
        armed=True,
        altitude_cm=0,
        heading_decideg=0,
        satellites=0,
    )
    _expect(found, "e803 0201 0e00 01000000 00 2500 0000 00 00 00000000 00")
    for values, sensors in (
        ({"altitude_cm": -5}, 2),
        ({"heading_decideg": -5}, 4),
        ({"satellites": 9}, 8),
    ):
        equal(_asked(101, **values)[4], sensors)


def rc():
    pulses = array("H", [0, 3520, 4000, 5999, 6000, 6001, 6002, 8639] + [0] * 8)
    _expect(_asked(105, pulses=pulses)[:16], "0000 7003 e803 dc05 dc05 dc05 dd05 7008")
    equal(len(_asked(105, pulses=pulses)), 32)
    equal(_asked(105), b"")
    equal(_asked(105, pulses=(6000, 4000)), b"\xdc\x05\xe8\x03")
    equal(len(_asked(105, pulses=[6000] * 18)), 32)


def raw_gps():
    _expect(_asked(106), "00 00 00000000 00000000 0000 0000 0000 0000")
    found = _asked(
        106,
        gps_fix=True,
        satellites=17,
        latitude_e7=473566094,
        longitude_e7=-85190237,
        gps_alt_m=408,
        speed_cm_s=1234,
        course_decideg=2705,
        pdop_centi=145,
    )
    _expect(found, "01 11 8e0b3a1c a319ecfa 9801 d204 910a 9100")
    found = _asked(106, latitude_e7=-900000000, longitude_e7=1800000000, gps_alt_m=-12)
    _expect(found, "00 00 00175bca 00d2496b 0000 0000 0000 0000")


def comp_gps():
    _expect(_asked(107), "0000 0000 00")
    found = _asked(107, home_distance_m=1230, home_direction_decideg=1805, gps_updates=7)
    _expect(found, "ce04 b400 01")
    found = _asked(107, home_distance_m=70000, home_direction_decideg=-10, gps_updates=6)
    _expect(found, "ffff 6701 00")


def attitude():
    _expect(_asked(108), "0000 0000 0000")
    _expect(
        _asked(108, roll_decideg=-1799, pitch_decideg=900, heading_decideg=3599), "f9f8 8403 6701"
    )
    for heading, degrees in ((-905, 269), (-1, 359), (0, 0), (9, 0), (10, 1), (1800, 180)):
        found = _asked(108, heading_decideg=heading)
        equal(found[4] | found[5] << 8, degrees, heading)


def altitude():
    _expect(_asked(109), "00000000 0000")
    _expect(_asked(109, altitude_cm=-1234, vario_cm_s=-50), "2efbffff ceff")
    _expect(_asked(109, altitude_cm=123456, vario_cm_s=40000), "40e20100 ff7f")


def analog():
    _expect(_asked(110), "00 0000 0000 0000 0000")
    found = _asked(110, voltage_mv=16795, current_ma=29604, consumed_mah=1230, rssi_percent=100)
    _expect(found, "a8 ce04 ff03 900b 9006")
    found = _asked(110, voltage_mv=30000, current_ma=-1234, consumed_mah=70000, rssi_percent=37)
    _expect(found, "ff ffff 7b01 85ff b80b")


def battery_state():
    _expect(_asked(130), "00 0000 00 0000 0000 03 0000")
    found = _asked(
        130,
        cell_count=4,
        capacity_mah=2200,
        voltage_mv=14344,
        consumed_mah=1999,
        current_ma=400000,
        battery_state=1,
    )
    _expect(found, "04 9808 8f cf07 ff7f 01 9a05")


def vtx_config():
    _expect(_asked(88), "05 00 00 00 00 0000 00 00 0000 00 00 00 00")
    found = _asked(
        88,
        vtx_type=3,
        vtx_band=5,
        vtx_channel=8,
        vtx_power=2,
        vtx_pit_mode=True,
        vtx_freq_mhz=5917,
        vtx_ready=True,
        vtx_low_power_disarm=1,
        vtx_pit_freq_mhz=5584,
    )
    _expect(found, "03 05 08 02 01 1d17 01 01 d015 00 00 00 00")


def saving():
    for on_save, status in ((None, 0xB0), (lambda: False, 0xB0), (lambda: True, 0x30)):
        responder = Responder()
        answer(responder, State(), None, on_save)
        responder.feed(payloads(v1(250))[0])
        equal(chunks_of(responder), [bytes((status, 0, 250, 0, 0, 0))])


def an_application_may_replace_an_answer():
    responder = Responder()
    answer(responder, State())
    responder.command(2, lambda request, reply: reply.text(b"MINE"))
    equal(answer_to(responder, v1(2)), b"MINE")
