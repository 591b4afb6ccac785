"""Downlink frames against an independent model, and as the pilot's radio shows them."""

import struct
from collections.abc import Callable
from decimal import ROUND_HALF_UP, Decimal

import downlink_model
import pytest
from behaviour import random_telemetry
from hypothesis import given, settings
from hypothesis import strategies as st
from targets import Target

from ghst import downlink, telemetry

thorough = settings(max_examples=500, deadline=None, derandomize=True)

# Within and far beyond every field, with the edges more often than chance would have them.
_EDGES = (0, 255, 1800, 3600, 32000, 32767, 65535, 655350, 9 * 10**8, 2**30, 18 * 10**8, 2**31)
numbers = st.one_of(
    st.integers(-40_000, 700_000),
    st.integers(-(2**33), 2**33),
    st.builds(
        lambda edge, sign, offset: sign * edge + offset,
        st.sampled_from(_EDGES),
        st.sampled_from((-1, 1)),
        st.integers(-6, 6),
    ),
)
optional = st.none() | numbers


def built(name: str, *arguments: object) -> bytes:
    data = bytearray(b"\xff" * 14)
    getattr(telemetry, name)(data, *arguments)
    return bytes(data)


@pytest.mark.parametrize(
    ("name", "arguments", "sample"),
    [
        ("pack_status", (16800, 29600, 1230, True), "890c239006900b7b000000000069"),
        ("gps_primary", (473566094, -85190237, 408), "890c258e0b3a1ca319ecfa98019b"),
        (
            "gps_secondary",
            (1234, 2705, 17, 1230, 1805, True, True),
            "890c26d204910a117b000d070361",
        ),
        ("mag_baro", (-905, -12, -50), "890c2777fcf4ffceff0000000761"),
        ("msp_response", (b"\x30\x07\x01\x01\x02\x03",), "890c283007010102030000000056"),
    ],
)
def test_the_model_builds_the_sample_frames(
    name: str, arguments: tuple[object, ...], sample: str
) -> None:
    assert downlink_model.BUILDERS[name](*arguments).hex() == sample


@thorough
@given(volts=numbers, amps=numbers, charge=numbers, armed=st.booleans())
def test_pack_status(volts: int, amps: int, charge: int, armed: bool) -> None:
    data = built("pack_status", volts, amps, charge, armed)
    assert data == downlink_model.pack_status(volts, amps, charge, armed)
    found = downlink.decode(data)
    for value, read in zip((volts, amps, charge), found, strict=False):
        assert read == min(655350, max(0, value)) // 10 * 10 or abs(read - value) <= 5
    assert found[3:] == (armed, 0)


@thorough
@given(lat_e7=numbers, lon_e7=numbers, alt_m=numbers)
def test_gps_primary(lat_e7: int, lon_e7: int, alt_m: int) -> None:
    data = built("gps_primary", lat_e7, lon_e7, alt_m)
    assert data == downlink_model.gps_primary(lat_e7, lon_e7, alt_m)
    assert struct.pack("<iih", *downlink.decode(data)) == data[3:13]


@thorough
@given(
    speed=numbers,
    course=numbers,
    satellites=numbers,
    distance=numbers,
    direction=numbers,
    fix=st.booleans(),
    home_fix=st.booleans(),
)
def test_gps_secondary(
    speed: int,
    course: int,
    satellites: int,
    distance: int,
    direction: int,
    fix: bool,
    home_fix: bool,
) -> None:
    values = (speed, course, satellites, distance, direction, fix, home_fix)
    data = built("gps_secondary", *values)
    assert data == downlink_model.gps_secondary(*values)
    assert downlink.decode(data)[5:] == (fix, home_fix)


@thorough
@given(heading=optional, alt_m=optional, vario=optional, valid=st.integers(0, 7))
def test_mag_baro(heading: int | None, alt_m: int | None, vario: int | None, valid: int) -> None:
    values = (heading, alt_m, vario)
    data = built("mag_baro", *values, valid)
    assert data == downlink_model.mag_baro(*values, valid)
    sent = [value is not None and bool(valid >> place & 1) for place, value in enumerate(values)]
    assert [value is not None for value in downlink.decode(data)] == sent


@thorough
@given(chunk=st.binary(max_size=6))
def test_msp_response(chunk: bytes) -> None:
    data = built("msp_response", chunk)
    assert data == downlink_model.msp_response(chunk)
    assert downlink.decode(data) == (chunk.ljust(6, b"\0"),)


@thorough
@given(
    kind=st.sampled_from((0x23, 0x25, 0x26, 0x27, 0x28)),
    payload=st.binary(min_size=10, max_size=10),
)
def test_what_is_read_is_what_was_built(kind: int, payload: bytes) -> None:
    """Any payload, read and built again, reads the same: the builders clamp nothing in range."""
    data = downlink_model.frame(downlink_model.RX, kind, payload)
    found = downlink.decode(data)
    again = bytearray(14)
    match found:
        case downlink.PackStatus():
            telemetry.pack_status(again, *found[:4])
            assert downlink.decode(again) == found._replace(rx_voltage_mv=0)
        case downlink.GpsPrimary():
            telemetry.gps_primary(again, *found)
            assert downlink.decode(again).alt_m == found.alt_m
        case downlink.GpsSecondary():
            telemetry.gps_secondary(again, *found)
            course, direction = min(3600, found[1]), min(3600, found[4])
            clamped = found._replace(course_decideg=course, home_dir_decideg=direction)
            assert downlink.decode(again) == clamped
        case downlink.MagBaro():
            telemetry.mag_baro(again, *found)
            assert again[12] == data[12] & 7
        case downlink.MspResponse():
            telemetry.msp_response(again, found.chunk)
            assert again[3:9] == payload[:6]


RADIO = [
    ("pack_status", (16800, 29600, 1230, True), "V 16.80 A 29.60 mAh 1230"),
    ("pack_status", (0, 0, 0, False), "V 0.00 A 0.00 mAh 0"),
    ("pack_status", (3704, 4, 4, True), "V 3.70 A 0.00 mAh 0"),
    ("pack_status", (3705, 5, 5, True), "V 3.71 A 0.01 mAh 10"),
    ("pack_status", (25199, 104995, 1234, True), "V 25.20 A 105.00 mAh 1230"),
    ("pack_status", (11114, 11115, 1235, True), "V 11.11 A 11.12 mAh 1240"),
    ("pack_status", (-1, -2000, -7, True), "V 0.00 A 0.00 mAh 0"),
    ("pack_status", (700000, 655344, 655345, True), "V 655.35 A 655.34 mAh 655350"),
    ("gps_primary", (473566094, -85190237, 408), "lat 47.356609 lon -8.519023 m 408"),
    ("gps_primary", (0, 0, 0), "lat 0.000000 lon 0.000000 m 0"),
    ("gps_primary", (9, -9, -1), "lat 0.000000 lon 0.000000 m -1"),
    ("gps_primary", (10, -10, -428), "lat 0.000001 lon -0.000001 m -428"),
    ("gps_primary", (-337654321, 1512345678, 8849), "lat -33.765432 lon 151.234567 m 8849"),
    ("gps_primary", (900000000, 1800000000, 40000), "lat 90.000000 lon 180.000000 m 32767"),
    ("gps_primary", (-900000000, -1799999999, -40000), "lat -90.000000 lon -179.999999 m -32768"),
    ("gps_secondary", (1234, 2705, 17, 1230, 1805, 1, 1), "km/h 44.4 deg 270 satellites 17"),
    ("gps_secondary", (0, 0, 0, 0, 0, 0, 0), "km/h 0.0 deg 0 satellites 0"),
    ("gps_secondary", (1, 9, 1, 0, 0, 1, 0), "km/h 0.0 deg 0 satellites 1"),
    ("gps_secondary", (2, 10, 4, 0, 0, 1, 0), "km/h 0.1 deg 1 satellites 4"),
    ("gps_secondary", (1389, 3599, 30, 0, 0, 1, 0), "km/h 50.0 deg 359 satellites 30"),
    ("gps_secondary", (2778, 3600, 99, 0, 0, 1, 0), "km/h 100.0 deg 360 satellites 99"),
    ("gps_secondary", (70000, 4000, 300, 0, 0, 1, 0), "km/h 2359.3 deg 360 satellites 255"),
]


@pytest.mark.parametrize(("name", "arguments", "shown"), RADIO)
def test_what_the_radio_shows(name: str, arguments: tuple[int, ...], shown: str) -> None:
    found = downlink_model.radio_shows(built(name, *arguments))
    assert " ".join(f"{unit} {text}" for unit, text in found.items()) == shown


def _rounded(value: Decimal, places: str) -> str:
    return str(value.quantize(Decimal(places), ROUND_HALF_UP))


@thorough
@given(volts=st.integers(0, 655350), speed=st.integers(0, 65535))
def test_the_radio_shows_the_nearest_value(volts: int, speed: int) -> None:
    pack = downlink_model.radio_shows(built("pack_status", volts, volts, 0, True))
    assert pack["V"] == pack["A"] == _rounded(Decimal(volts) / 1000, "0.01")
    motion = downlink_model.radio_shows(built("gps_secondary", speed, 0, 0, 0, 0, True, False))
    assert motion["km/h"] == _rounded(Decimal(speed) * 36 / 1000, "0.1")


@thorough
@given(lat_e7=st.integers(-9 * 10**8, 9 * 10**8), lon_e7=st.integers(-18 * 10**8, 18 * 10**8))
def test_the_radio_shows_a_millionth_of_a_degree(lat_e7: int, lon_e7: int) -> None:
    shown = downlink_model.radio_shows(built("gps_primary", lat_e7, lon_e7, 0))
    step = Decimal("0.000001")
    assert abs(Decimal(shown["lat"]) - Decimal(lat_e7).scaleb(-7)) < step
    assert abs(Decimal(shown["lon"]) - Decimal(lon_e7).scaleb(-7)) < step


BATCH = 50
"""Random calls at once: a board has room for no more results."""

BATCHES = {"cpython": 60, "unix": 10, "rp2040": 3}


def test_random_values_on_every_target(target: Target, request: pytest.FixtureRequest) -> None:
    for seed in range(BATCHES[request.node.callspec.params["target"]]):
        found = target.evaluate("random_telemetry", f"list(run({BATCH}, {seed}))")
        calls = random_telemetry.calls(BATCH, seed)
        frames = [downlink_model.BUILDERS[name](*arguments) for name, arguments in calls]
        assert found == [(data.hex(), tuple(downlink.decode(data))) for data in frames]


def test_the_random_values_reach_both_ends_of_every_field() -> None:
    calls = [
        call for seed in range(BATCHES["rp2040"]) for call in random_telemetry.calls(BATCH, seed)
    ]
    limits: dict[str, Callable[[tuple[int, ...]], bool]] = {
        "pack_status": lambda values: max(values[:3]) > 655350 and min(values[:3]) < 0,
        "gps_primary": lambda values: abs(values[1]) > 18 * 10**8 and abs(values[2]) < 32768,
        "gps_secondary": lambda values: max(values[:5]) > 2**31 and min(values[:5]) < 0,
        "mag_baro": lambda values: None in values[:3] and values[3] not in (0, 7),
        "msp_response": lambda values: len(values[0]) == 6,
    }
    counts = dict.fromkeys(limits, 0)
    for name, arguments in calls:
        counts[name] += limits[name](arguments)
    assert min(counts.values()) > 0, counts
