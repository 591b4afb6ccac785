"""The GPS parsers and the way home, compared with models of their own; and fuzzed."""

from __future__ import annotations

import math
import re
from array import array
from fractions import Fraction

from firmware.sensors.geodesy import distance_and_direction
from firmware.sensors.gps import Gps
from firmware.sensors.gps_solution import UNKNOWN, empty
from firmware.sensors.gps_stream import SENTENCE, Stream
from firmware.sensors.nmea import Nmea
from firmware.sensors.nmea_fields import WRONG, number, position, split
from hypothesis import given, settings
from hypothesis import strategies as st
from simulated_uart import Clock, SimulatedUart

from ghst_tools.emulator.gps_messages import Place, nav_pvt, nmea_epoch, sentence, ubx

RADIUS_M = 6371008.8

THOROUGH = settings(max_examples=400, deadline=None, derandomize=True)
QUICK = settings(max_examples=100, deadline=None, derandomize=True)


# -- the way home -----------------------------------------------------------------------------


def great_circle(points: tuple[int, int, int, int]) -> tuple[float, float]:
    """Distance in m and initial direction in degrees on the sphere (haversine)."""
    lat, lon, to_lat, to_lon = (math.radians(angle / 1e7) for angle in points)
    east = to_lon - lon
    half = (
        math.sin((to_lat - lat) / 2) ** 2
        + math.cos(lat) * math.cos(to_lat) * math.sin(east / 2) ** 2
    )
    direction = math.atan2(
        math.sin(east) * math.cos(to_lat),
        math.cos(lat) * math.sin(to_lat) - math.sin(lat) * math.cos(to_lat) * math.cos(east),
    )
    return 2 * RADIUS_M * math.asin(math.sqrt(half)), math.degrees(direction) % 360


def e7(degrees: float) -> int:
    return round(degrees * 1e7)


@THOROUGH
@given(
    lat=st.floats(-80, 80),
    lon=st.floats(-180, 180) | st.sampled_from((180.0, -180.0, 179.999, -179.95)),
    distance_m=st.floats(0, 20_000),
    direction=st.floats(0, 360),
)
def test_the_way_home(lat: float, lon: float, distance_m: float, direction: float) -> None:
    arc = math.degrees(distance_m / RADIUS_M)
    to_lat = lat + arc * math.cos(math.radians(direction))
    to_lon = lon + arc * math.sin(math.radians(direction)) / math.cos(math.radians(lat))
    to_lon = (to_lon + 180) % 360 - 180
    points = (e7(lat), e7(lon), e7(to_lat), e7(to_lon))
    result = array("i", (0, 0))
    distance_and_direction(array("i", points), result)
    wanted_m, wanted_direction = great_circle(points)
    assert abs(result[0] - wanted_m) <= 0.51 + 0.0005 * wanted_m
    assert 0 <= result[1] < 3600
    if wanted_m > 10:
        error = abs((result[1] / 10 - wanted_direction + 180) % 360 - 180)
        assert error <= 0.6


@THOROUGH
@given(
    st.tuples(
        *[st.integers(-900_000_000, 900_000_000), st.integers(-(18 * 10**8), 18 * 10**8)] * 2
    )
)
def test_any_two_positions_have_a_distance(points: tuple[int, int, int, int]) -> None:
    result = array("i", (-1, -1))
    distance_and_direction(array("i", points), result)
    assert 0 <= result[0] < 32_000_000
    assert 0 <= result[1] < 3600


# -- fields -----------------------------------------------------------------------------------


def half_up(value: Fraction) -> int:
    return math.floor(value + Fraction(1, 2))


DECIMAL = st.from_regex(r"-?([0-9]{1,6}(\.[0-9]{0,9})?|\.[0-9]{1,9})", fullmatch=True)


@THOROUGH
@given(text=DECIMAL, decimals=st.integers(0, 3))
def test_numbers(text: str, decimals: int) -> None:
    data = text.encode()
    found = number(data, bytes((0, len(data) + 1)), 0, decimals)
    digits, _, places = text.lstrip("-").partition(".")
    value = Fraction(int((digits + places) or 0), 10 ** len(places))
    value = -value if text.startswith("-") else value
    if abs(value) * 10**decimals < 259_999_999:
        assert found == half_up(value * 10**decimals)


@THOROUGH
@given(text=st.text("0123456789.-+ eE", min_size=1, max_size=12), decimals=st.integers(0, 3))
def test_what_is_no_number(text: str, decimals: int) -> None:
    data = text.encode()
    found = number(data, bytes((0, len(data) + 1)), 0, decimals)
    assert (found == WRONG) == (
        not re.fullmatch(r"-?(\d+\.?\d*|\.\d+)", text)
        or abs(float(text)) * 10**decimals >= 259_999_999.5
        or len(text.partition(".")[0].strip("-").lstrip("0")) + decimals > 9
    )


MINUTES = st.from_regex(r"[0-5][0-9](\.[0-9]{0,10})?", fullmatch=True)


@THOROUGH
@given(
    lat=st.tuples(st.integers(0, 89), MINUTES, st.sampled_from("NS")),
    lon=st.tuples(st.integers(0, 179), MINUTES, st.sampled_from("EW")),
)
def test_positions(lat: tuple[int, str, str], lon: tuple[int, str, str]) -> None:
    text = f"GPXXX,{lat[0]:02}{lat[1]},{lat[2]},{lon[0]:03}{lon[1]},{lon[2]}".encode()
    starts = bytearray(25)
    assert split(text, len(text), starts) >> 3 == 5
    target = array("i", (0, 0))
    assert position(text, starts, 1, target) == 1
    for found, (degrees, minutes, letter) in zip(target, (lat, lon), strict=True):
        value = half_up((degrees + Fraction(minutes.rstrip(".")) / 60) * 10**7)
        assert found == (-value if letter in "SW" else value)


# -- epochs -----------------------------------------------------------------------------------


PLACES = st.builds(
    Place,
    lat_deg=st.floats(-89.9, 89.9),
    lon_deg=st.floats(-179.9, 179.9),
    alt_m=st.floats(-400, 9000),
    speed_m_s=st.floats(0, 300),
    course_deg=st.floats(0, 359.9),
    satellites=st.integers(3, 30),
    fix=st.sampled_from((2, 3)),
    pdop=st.floats(0.5, 20),
    hdop=st.floats(0.5, 20),
    h_acc_m=st.floats(0.5, 4_000_000),
)


@QUICK
@given(
    place=PLACES, time_ms=st.integers(0, 86_399_990), talker=st.sampled_from(("GP", "GN", "GL"))
)
def test_what_a_receiver_sends_is_what_it_saw(place: Place, time_ms: int, talker: str) -> None:
    solution = empty()
    nmea = Nmea(solution)
    data = b"".join(nmea_epoch(place, 0, talker) + nmea_epoch(place, time_ms, talker))
    stream = Stream()
    for at in range(0, len(data), 100):
        part = data[at : at + 100]
        stream.feed(part, len(part))
        while stream.next():
            nmea.feed(stream.frame, stream.length, 0)
    assert stream.take_errors() == nmea.take_errors() == 0
    fix, lat_e7, lon_e7, alt_m, speed_cm_s, course_decideg, satellites, pdop_centi, good = solution
    assert (fix, satellites) == (place.fix, place.satellites)
    assert good == (fix == 3 and pdop_centi <= 500)
    # It sends 1e-5 minutes, 0.1 m, thousandths of a knot, 0.01 degrees.
    assert abs(lat_e7 - place.lat_deg * 1e7) <= 1.4
    assert abs(lon_e7 - place.lon_deg * 1e7) <= 1.4
    assert abs(alt_m - place.alt_m) <= 0.551
    assert abs(speed_cm_s - place.speed_m_s * 100) <= 0.53
    assert abs((course_decideg - place.course_deg * 10 + 1800) % 3600 - 1800) <= 0.551
    assert abs(pdop_centi - place.pdop * 100) <= 0.51


# -- the stream -------------------------------------------------------------------------------

TEXT = st.text(
    st.characters(min_codepoint=0x20, max_codepoint=0x7E, exclude_characters="$*"),
    min_size=5,
    max_size=119,
)
INTACT = st.one_of(
    TEXT.map(lambda text: (text.encode(), sentence(text))),
    st.tuples(st.integers(0, 255), st.integers(0, 255), st.binary(max_size=120)).map(
        lambda frame: (ubx(*frame)[2:-2], ubx(*frame))
    ),
)
STARTS = st.sampled_from((b"$", b"\xb5", b"\xb5b", b"*", b"GPGGA,", b"\r\n", b"\0\1"))
NOISE = st.one_of(
    st.binary(max_size=40),
    st.lists(STARTS).map(b"".join),
    INTACT.flatmap(lambda item: st.integers(0, len(item[1]) - 1).map(lambda n: item[1][:n])),
)


def found(data: bytes, sizes: list[int]) -> list[bytes]:
    stream = Stream()
    results = []
    at = 0
    while at < len(data):
        sizes = sizes[1:] + sizes[:1]
        part = data[at : at + sizes[0]]
        at += len(part)
        stream.feed(part, len(part))
        while kind := stream.next():
            start = 0 if kind == SENTENCE else 4
            results.append(bytes(stream.frame[: start + stream.length]))
    return results


@THOROUGH
@given(
    parts=st.lists(st.tuples(NOISE, INTACT), max_size=6),
    sizes=st.lists(st.integers(1, 300), min_size=1, max_size=4),
)
def test_no_noise_hides_what_is_intact(
    parts: list[tuple[bytes, tuple[bytes, bytes]]], sizes: list[int]
) -> None:
    data = b"".join(noise + item[1] for noise, item in parts)
    # Whatever looks like the beginning of a frame has come to its end then.
    results = iter(found(data + bytes(200), sizes))
    for _, (wanted, _) in parts:
        assert any(result == wanted for result in results), wanted


@THOROUGH
@given(
    data=st.lists(NOISE | INTACT.map(lambda item: item[1])).map(b"".join),
    sizes=st.lists(st.integers(1, 300), min_size=1, max_size=4),
)
def test_the_pieces_make_no_difference(data: bytes, sizes: list[int]) -> None:
    assert found(data, sizes) == found(data, [300])


# -- everything -------------------------------------------------------------------------------


@QUICK
@given(
    parts=st.lists(
        st.one_of(
            NOISE,
            INTACT.map(lambda item: item[1]),
            PLACES.map(lambda place: nav_pvt(place, 5)),
            PLACES.map(lambda place: b"".join(nmea_epoch(place, 7))),
            st.binary(min_size=92, max_size=92).map(lambda payload: ubx(1, 7, payload)),
            st.from_regex(
                r"G[PN](GGA|RMC|VTG|GSA)(,[AVMNEST0-9.-]{0,6}){0,20}", fullmatch=True
            ).map(sentence),
        )
    ),
    configure=st.booleans(),
)
def test_a_gps_takes_anything(parts: list[bytes], configure: bool) -> None:
    clock = Clock()
    uart = SimulatedUart(clock)
    gps = Gps(uart, configure=configure)
    for part in parts:
        uart.send(part, gps.baudrate or 9600)
        for _ in range(20):
            clock.run_until(clock.nanos + 10e6)
            before = gps.updates
            new = gps.update(round(clock.nanos / 1e6))
            assert gps.updates - before == int(new)
            check(gps)


def check(gps: Gps) -> None:
    """What holds whatever comes."""
    assert gps.fix or not gps.fix_3d
    for value, low, high in (
        (gps.lat_e7, -900_000_000, 900_000_000),
        (gps.lon_e7, -1_800_000_000, 1_800_000_000),
        (gps.alt_m, -10_000, 100_000),
        (gps.speed_cm_s, 0, 100_000),
        (gps.course_decideg, 0, 3599),
        (gps.satellites, 0, 255),
        (gps.pdop_centi, 0, 65535),
        (gps.home_distance_m, 0, 32_000_000),
        (gps.home_direction_decideg, 0, 3599),
    ):
        assert value is None or low <= value <= high
    assert (gps.lat_e7 is None) == (gps.lon_e7 is None) == (not gps.fix)
    assert (gps.home_distance_m is not None) == (gps.fix and gps.home_fix)
    assert gps.faults >= 0
    assert UNKNOWN not in vars(gps).values()
    assert gps.describe()
