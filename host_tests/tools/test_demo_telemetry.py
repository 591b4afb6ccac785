"""What the demo says about telemetry: the radio's screen, and the judge of slots and values."""

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from ghst import telemetry as build
from ghst_tools.demo import telemetry
from ghst_tools.demo.aircraft import HOME_LAT_DEG, RADIUS_M, Aircraft, home_from
from ghst_tools.demo.flight import RATE_HZ
from ghst_tools.demo.radio import MAG_BARO, Radio
from ghst_tools.demo.report import Report
from ghst_tools.emulator.receiver import DownlinkFrame

SECOND_NS = 1e9
SLOT_NS = SECOND_NS / RATE_HZ
SENSORS: dict[str, Any] = {"battery": {}, "gps": {}, "barometer": {}, "magnetometer": {}}
THROTTLE = {3: 6000}  # half
HOME_DEG = 270.0 - 90.0 / 2  # a quarter of a circle that began in the east


def flying() -> Aircraft:
    """Takes off after a second, and flies with half throttle from then on."""
    aircraft = Aircraft()
    aircraft.takeoff_ns = SECOND_NS
    aircraft.channels(SECOND_NS, THROTTLE)
    return aircraft


def fill(kind: int, aircraft: Aircraft, t_ns: float) -> bytes:
    """The frame that a board without any delay sends, kinds in turn."""
    frame = bytearray(14)
    place = aircraft.place(t_ns)
    course = round(10 * place.course_deg)
    home_m, home_deg = home_from(place)
    if kind == 0:
        milli = [round(1000 * value) for value in (aircraft.volts(t_ns), aircraft.amps(t_ns))]
        build.pack_status(frame, *milli, round(aircraft.consumed_mah(t_ns)), True)
    elif kind == 1:
        position = (round(place.lat_deg * 1e7), round(place.lon_deg * 1e7))
        build.gps_primary(frame, *position, round(place.alt_m))
    elif kind == 2:
        speed = round(100 * place.speed_m_s)
        home = (round(home_m), round(10 * home_deg))
        build.gps_secondary(frame, speed, course, place.satellites, *home, True, True)
    else:
        heading = course - 3600 if course > 1800 else course
        climb = round(aircraft.climb_cm_s(t_ns))
        build.mag_baro(frame, heading, round(aircraft.height_m(t_ns)), climb)
    return bytes(frame)


Change = Callable[[DownlinkFrame], DownlinkFrame | None]


def judged(change: Change = lambda frame: frame, sensors: Any = SENSORS, **wire: Any) -> Report:
    """The report of six seconds in which every fifth slot had a frame, each through `change`."""
    aircraft = flying()
    heard = []
    for number in range(300):
        t_ns = 0.1 * SECOND_NS + 5 * number * SLOT_NS
        frame = DownlinkFrame(t_ns, 1e6, fill(number % 4, aircraft, t_ns), True)
        heard += [changed] if (changed := change(frame)) else []
    solutions = [(t, aircraft.place(t)) for t in {frame.t_ns for frame in heard}]
    gps = SimpleNamespace(sent=sorted(solutions), baud=115_200, period_ms=100)
    receiver: Any = SimpleNamespace(
        downlink=heard,
        noise=wire.get("noise", []),
        wire=SimpleNamespace(contention=wire.get("contention", [])),
    )
    devices: Any = SimpleNamespace(gps=gps)
    radio = Radio()
    radio.listen(heard[:100])
    radio.listen(heard)
    result = Report("", "")
    telemetry.judge(result, {"defaults": sensors}, receiver, radio, aircraft, devices)
    return result


def test_the_aircraft_flies_a_climbing_circle() -> None:
    aircraft = flying()
    assert aircraft.place(SECOND_NS)[:4] == (HOME_LAT_DEG, 8.5, 412.0, 0.0)
    # 15 m in the first second, and then 30 m/s to a quarter of the circle.
    quarter_ns = (2 + (math.pi / 2 * RADIUS_M - 15) / 30) * SECOND_NS
    assert aircraft.course_deg(quarter_ns) == pytest.approx(0, abs=1e-9)
    assert aircraft.height_m(quarter_ns) == pytest.approx(math.pi / 2 * RADIUS_M * 4 / 30)
    distance, direction = home_from(aircraft.place(quarter_ns))
    assert distance == pytest.approx(math.sqrt(2) * RADIUS_M, rel=1e-4)
    assert direction == pytest.approx(HOME_DEG, abs=0.01)


def test_the_battery_sags_and_drains() -> None:
    aircraft = flying()
    assert aircraft.amps(0) == 0.5
    assert aircraft.volts(0) == pytest.approx(16.8 - 0.025 * 0.5)
    assert aircraft.amps(2 * SECOND_NS) == 15.25
    assert aircraft.consumed_mah(2 * SECOND_NS) == pytest.approx((0.5 + 15.25) / 3.6)
    used_v = 0.02 * 15.75 / 3.6
    assert aircraft.volts(2 * SECOND_NS) == pytest.approx(16.8 - used_v - 0.025 * 15.25)


def test_the_radio_shows_what_it_was_sent() -> None:
    radio = Radio()
    frames = [bytearray(14) for _ in range(4)]
    build.pack_status(frames[0], 16_420, 12_300, 40, True)
    build.gps_primary(frames[1], 473_000_012, -85_000_004, 424)
    build.gps_secondary(frames[2], 3000, 905, 14, 120, 2250, True, True)
    build.mag_baro(frames[3], -100, 12, 400)
    radio.listen([DownlinkFrame(t, 1e6, bytes(frame), True) for t, frame in enumerate(frames)])
    assert radio.shown() == (
        ("battery", "16.42 V, 12.3 A, 40 mAh"),
        ("position", "47.300001 -8.500000, 424 m"),
        ("motion", "108 km/h, course 90 deg, 14 satellites"),
        ("home", "120 m, at 225 deg"),
        ("altitude", "+12 m, +4.0 m/s, heading 350 deg"),
    )


def test_telemetry_of_a_perfect_board_is_right() -> None:
    result = judged()
    assert result.failures == []
    lines = dict(result.lines)
    each = "GpsPrimary 75, GpsSecondary 75, MagBaro 75, PackStatus 75"
    assert lines["telemetry frames"] == each
    assert lines["stop bit to telemetry slot"].startswith("min 1000.00, mean 1000.00, max 1000.00")
    assert lines["collisions on the wire"] == "0, frames in one slot: at most 1"
    assert sum(label.endswith(" on the radio") for label in lines) == 14
    # The last one, at 6.08 s, after 137.4 m of a circle with 100 m.
    assert lines["heading on the radio"].startswith("11.3 deg, device 11.3 deg (+0.0); 75 ")
    assert "(+0.00); 75 frames within 0.00 m/s of" in lines["vario on the radio"]


def with_bytes(kind: int, at: int, difference: int) -> Change:
    """Adds to a value of 16 bits in all frames of `kind`."""

    def change(heard: DownlinkFrame) -> DownlinkFrame:
        frame = bytearray(heard.frame)
        if frame[2] == kind:
            value = int.from_bytes(frame[at : at + 2], "little") + difference
            frame[at : at + 2] = (value & 0xFFFF).to_bytes(2, "little")
            build._end(frame)
        return heard._replace(frame=bytes(frame))

    return change


@pytest.mark.parametrize(
    ("label", "kind", "at", "difference"),
    [
        ("voltage", 0x23, 3, 4),
        ("current", 0x23, 5, 40),
        ("charge", 0x23, 7, 2),
        ("latitude", 0x25, 3, 12),
        ("longitude", 0x25, 7, 12),
        ("altitude by GPS", 0x25, 11, 2),
        ("speed", 0x26, 3, 5),
        ("course", 0x26, 5, 4),
        ("satellites", 0x26, 7, -1),
        ("home distance", 0x26, 8, 2),
        ("home direction", 0x26, 10, 15),
        ("heading", 0x27, 3, 100),
        ("altitude", 0x27, 5, 2),
        ("vario", 0x27, 7, 60),
    ],
)
def test_a_wrong_value_is_found(label: str, kind: int, at: int, difference: int) -> None:
    (failure,) = judged(with_bytes(kind, at, difference)).failures
    assert failure.startswith(f"{label} on the radio is up to ")


def test_a_kind_that_never_comes_is_found() -> None:
    def change(heard: DownlinkFrame) -> DownlinkFrame | None:
        return None if heard.frame[2] == 0x27 else heard

    assert judged(change).failures == [f"no {MAG_BARO} frame came"]
    assert judged(change, {"battery": {}, "gps": {}}).failures == []


def test_a_value_that_is_never_valid_is_found() -> None:
    def change(heard: DownlinkFrame) -> DownlinkFrame:
        frame = bytearray(heard.frame)
        if frame[2] == 0x27:
            build.mag_baro(frame, 900, 0, 0, build.VALID_HEADING)
        return heard._replace(frame=bytes(frame))

    failures = judged(change, {"barometer": {}}).failures
    assert failures == [f"the radio never showed a valid {it}" for it in ("altitude", "vario")]


@pytest.mark.parametrize("after_ns", [989_900.0, 1_010_100.0])
def test_a_slot_that_begins_at_the_wrong_time_is_found(after_ns: float) -> None:
    def change(heard: DownlinkFrame) -> DownlinkFrame:
        return heard._replace(after_ns=after_ns) if heard.t_ns > 6e9 else heard

    (failure,) = judged(change).failures
    assert failure.startswith("telemetry began ") and f"{after_ns / 1000:.2f}" in failure


def test_two_frames_in_a_slot_and_collisions_are_found() -> None:
    ends = iter(range(1000))

    def change(heard: DownlinkFrame) -> DownlinkFrame:
        # The second frame of each pair, in the slot of the first one.
        back_ns = 5 * SLOT_NS if next(ends) == 1 else 0.0
        return heard._replace(after_ns=1e6 + back_ns)

    failures = judged(change, contention=[5e6], noise=[(6e6, 0x55)]).failures
    assert failures[0].startswith("telemetry began 1000.00 to 21000.00 us")
    assert failures[1:] == [
        "1 collisions on the wire, the first at 5.000 ms",
        "2 telemetry frames in one slot",
        "1 bytes on the wire that are no frame",
    ]


def test_a_broken_frame_is_found() -> None:
    def change(heard: DownlinkFrame) -> DownlinkFrame:
        if heard.t_ns > 6.07e9:
            return heard._replace(ok=False)
        return heard._replace(frame=bytes(14)) if heard.t_ns > 6.05e9 else heard

    failures = judged(change).failures
    assert failures == [
        "telemetry frame at 6060.000 ms: address is 0x00, must be 0x89",
        "telemetry frame at 6080.000 ms: a stop bit is low",
    ]


def test_without_sensors_there_is_nothing_to_judge() -> None:
    result = judged(sensors={})
    assert result.failures == []
    assert result.lines == [("telemetry", "none: the board's description names no sensors")]
