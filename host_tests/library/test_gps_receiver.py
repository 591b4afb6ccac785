"""`Gps` with simulated receivers: it sets them up, gets over what they do, and knows home.

On CPython, where minutes take a second; the emulated board does the same with the real UART in
`host_tests/firmware/test_gps.py`.
"""

from __future__ import annotations

import math

import pytest
from gps_bench import BAUDRATES, HERE, NMEA_VALUES, NOTHING, UBX_VALUES, Bench, values

from ghst_tools.emulator.gps_messages import Place, nav_pvt


@pytest.mark.parametrize("period_ms", [100, 200, 1000])
def test_each_epoch_is_one_solution(period_ms: int) -> None:
    bench = Bench()
    receiver = bench.nmea(baud=115200, period_ms=period_ms)
    bench.until("gps.baudrate", 7)
    bench.run(1)
    before, sent = bench.solutions, len(receiver.sent)
    bench.run(10)
    assert bench.solutions - before == len(receiver.sent) - sent == 10_000 // period_ms
    assert bench.gps.updates == bench.solutions


@pytest.mark.parametrize("generation", [8, 9, 10])
@pytest.mark.parametrize("baud", BAUDRATES)
def test_a_ublox_is_set_up(generation: int, baud: int) -> None:
    bench = Bench()
    receiver = bench.ublox(generation=generation, baud=baud)
    bench.until("gps.baudrate == 115200 and gps.protocol == 'UBX'", 14)
    bench.run(4)
    assert (receiver.baud, receiver.period_ms) == (115200, 100)
    assert (receiver.outputs, receiver.pvt) == (1, True)
    assert values(bench.gps) == UBX_VALUES
    assert bench.gps.describe() == "3D fix, 12 satellites, home 0 m, UBX at 115200 baud"
    before, faults, accepted = bench.solutions, bench.gps.faults, len(receiver.accepted)
    bench.run(10)
    assert bench.solutions - before == 100
    # It is done: nothing more is sent, and nothing goes wrong.
    assert (bench.gps.faults, len(receiver.accepted)) == (faults, accepted)
    assert faults <= 2


def test_a_ublox_that_nobody_sets_up() -> None:
    bench = Bench(configure=False)
    receiver = bench.ublox()
    bench.run(20)
    assert (receiver.baud, receiver.period_ms, receiver.accepted) == (9600, 1000, [])
    assert (bench.gps.protocol, bench.gps.baudrate) == ("NMEA", 9600)
    assert values(bench.gps) == NMEA_VALUES


@pytest.mark.parametrize("baud", BAUDRATES)
def test_one_that_was_set_up_before_and_sends_ubx_only(baud: int) -> None:
    for configure in (True, False):
        bench = Bench(configure=configure)
        bench.ublox(baud=baud, outputs=1, pvt=True, period_ms=200)
        bench.until("gps.fix", 7)
        assert (bench.gps.protocol, values(bench.gps)) == ("UBX", UBX_VALUES)
        bench.run(8)
        assert bench.gps.baudrate == (115200 if configure else baud)


def test_a_receiver_that_does_not_answer_goes_on_with_nmea() -> None:
    bench = Bench()
    receiver = bench.ublox(deaf=True)
    bench.until("gps.updates", 3)
    bench.run(20)
    # Three attempts, 2.5 s each; since then nothing is sent.
    assert (bench.gps.protocol, bench.gps.baudrate) == ("NMEA", 9600)
    assert (bench.gps.faults, bench.uart.baudrates) == (0, [9600])
    sent = bench.uart._sent_ns
    bench.run(20)
    assert bench.uart._sent_ns == sent
    assert receiver.accepted == []


@pytest.mark.parametrize(("baud", "period_ms"), [(9600, 200), (38400, 100)])
def test_one_that_keeps_its_baud_rate_is_set_up_at_that(baud: int, period_ms: int) -> None:
    bench = Bench()
    receiver = bench.ublox(baud=baud, fixed_baud=True)
    bench.run(25)
    assert (bench.gps.baudrate, receiver.period_ms, receiver.outputs) == (baud, period_ms, 1)
    assert (bench.gps.protocol, values(bench.gps)) == ("UBX", UBX_VALUES)
    solutions = bench.solutions
    bench.run(5)
    assert bench.solutions - solutions == 5000 // period_ms


@pytest.mark.parametrize("generation", [8, 10])
def test_a_ublox_whose_supply_is_interrupted(generation: int) -> None:
    bench = Bench()
    receiver = bench.ublox(generation=generation)
    bench.run(15)
    assert bench.gps.protocol == "UBX"
    receiver.stop()
    bench.run(1)
    receiver.forget()
    receiver.start()
    bench.until("gps.baudrate is None", 5)
    assert bench.gps.protocol is None
    bench.until("gps.baudrate == 115200 and gps.protocol == 'UBX'", 20)
    bench.run(4)
    assert (receiver.period_ms, receiver.outputs, receiver.baud) == (100, 1, 115200)


def test_one_that_forgets_all_but_its_baud_rate() -> None:
    bench = Bench()
    receiver = bench.ublox(baud=115200)
    bench.run(10)
    assert (bench.gps.protocol, receiver.outputs) == ("UBX", 1)
    receiver.forget()
    bench.until("gps.protocol == 'NMEA'", 4)
    bench.until("gps.protocol == 'UBX'", 5)
    bench.run(4)
    assert (receiver.period_ms, receiver.outputs) == (100, 1)
    assert bench.uart.baudrates == list(BAUDRATES)


def test_silence_ends_the_fix_after_two_seconds() -> None:
    bench = Bench()
    receiver = bench.nmea()
    bench.run(6)
    receiver.stop()
    bench.until("gps.updates == 6", 1)
    bench.until("not gps.fix", 3)
    assert 1.99 < (bench.clock.nanos - receiver.sent[-1][0]) / 1e9 < 2.5
    assert values(bench.gps) == NOTHING
    assert (bench.gps.home_fix, bench.gps.home_distance_m) == (True, None)
    assert bench.gps.baudrate == 9600
    bench.until("gps.baudrate is None", 2)
    assert (bench.gps.faults, bench.gps.protocol) == (1, None)
    receiver.start()
    assert bench.until("gps.fix", 3) < 1
    bench.run(1)
    assert values(bench.gps) == NMEA_VALUES


def test_no_fix_ends_the_fix_at_once() -> None:
    bench = Bench()
    bench.nmea(period_ms=1000)
    bench.run(5)
    bench.place = HERE._replace(fix=0, satellites=3)
    bench.run(1.5)
    assert values(bench.gps) == (*NOTHING[:7], 3, 140)
    assert bench.gps.describe() == "no fix, 3 satellites, NMEA at 9600 baud"
    bench.place = HERE._replace(fix=2)
    bench.run(2)
    assert values(bench.gps) == (True, False, *NMEA_VALUES[2:])
    assert bench.gps.describe() == "2D fix, 12 satellites, home 0 m, NMEA at 9600 baud"


def test_home_is_the_first_good_position() -> None:
    bench = Bench(minimum_satellites=7)
    bench.ublox(baud=115200, pvt=True, outputs=1, period_ms=100)
    for bad in (
        HERE._replace(fix=2, lat_deg=1),
        HERE._replace(satellites=6, lat_deg=2),
        HERE._replace(pdop=5.01, lat_deg=3),
        HERE._replace(fix=0, lat_deg=4),
        HERE._replace(h_acc_m=10.001, lat_deg=5),
        HERE._replace(h_acc_m=1000.0, lat_deg=6),
        HERE._replace(valid=False, lat_deg=7),
    ):
        bench.place = bad
        bench.run(7 if bench.gps.baudrate is None else 1)
        assert bench.gps.updates
        assert bench.gps.fix is (bad.fix > 0 and bad.valid)
        assert (bench.gps.home_fix, bench.gps.home_distance_m) == (False, None)
    bench.place = HERE._replace(satellites=7, pdop=5.0, h_acc_m=10.0)
    bench.run(1)
    assert (bench.gps.home_fix, bench.gps.home_distance_m) == (True, 0)
    # 1 km to the north: home lies in the south. It does not get better by better positions.
    bench.place = HERE._replace(lat_deg=HERE.lat_deg + math.degrees(1000 / 6371008.8))
    bench.run(1)
    assert (bench.gps.home_distance_m, bench.gps.home_direction_decideg) == (1000, 1800)
    bench.place = bench.place._replace(fix=2, satellites=4)
    bench.run(1)
    assert (bench.gps.home_distance_m, bench.gps.home_direction_decideg) == (1000, 1800)
    bench.gps.reset_home()
    assert (bench.gps.home_fix, bench.gps.home_distance_m) == (False, None)
    bench.run(1)
    assert not bench.gps.home_fix
    bench.place = bench.place._replace(fix=3, satellites=9)
    bench.run(1)
    assert (bench.gps.home_fix, bench.gps.home_distance_m) == (True, 0)


def test_home_is_the_fifth_good_position_in_a_row() -> None:
    bench = Bench()
    bench.ublox(baud=115200, pvt=True, outputs=1, period_ms=100)
    nowhere = bench.place = HERE._replace(fix=0)
    bench.until("gps.protocol == 'UBX'", 7)
    bench.run(3)

    def see(count: int, place: Place) -> None:
        # It is set before a solution is made, and seen after it has come.
        bench.place = place
        updates = bench.gps.updates
        while bench.gps.updates - updates < count:
            bench.round()
        bench.place = nowhere

    for _ in range(3):
        see(4, HERE._replace(lat_deg=40))
        assert (bench.gps.fix_3d, bench.gps.home_fix) == (True, False)
        see(1, HERE._replace(lat_deg=40, h_acc_m=12.0))
        assert (bench.gps.fix_3d, bench.gps.home_fix) == (True, False)
    see(4, HERE._replace(lat_deg=41))
    assert not bench.gps.home_fix
    see(1, HERE)
    assert bench.gps.home_fix
    # 40 to 41 degrees were no home.
    assert bench.gps.home_distance_m == 0


def test_good_positions_before_a_silence_do_not_count() -> None:
    bench = Bench(configure=False)
    receiver = bench.nmea()
    bench.until("gps.updates == 4", 10)
    assert (bench.gps.fix_3d, bench.gps.home_fix) == (True, False)
    receiver.stop()
    bench.until("not gps.fix", 4)
    receiver.start()
    bench.until("gps.updates == 8", 6)
    assert not bench.gps.home_fix
    bench.until("gps.home_fix", 2)


@pytest.mark.parametrize("talker", ["GP", "GN"])
@pytest.mark.parametrize("satellites", [6, 17, 30])
@pytest.mark.parametrize(("baud", "period_ms"), [(9600, 1000), (115200, 100)])
def test_home_by_nmea_of_any_number_of_systems(
    talker: str, satellites: int, baud: int, period_ms: int
) -> None:
    bench = Bench()
    bench.place = HERE._replace(satellites=satellites)
    bench.nmea(talker=talker, baud=baud, period_ms=period_ms)
    bench.until("gps.home_fix", 14)
    assert (bench.gps.fix_3d, bench.gps.pdop_centi) == (True, 140)
    assert bench.gps.satellites == satellites


@pytest.mark.parametrize("configure", [True, False])
@pytest.mark.parametrize("generation", [8, 9, 10])
@pytest.mark.parametrize(
    "bad",
    [
        HERE._replace(fix=2, pdop=18.0, hdop=9.0, h_acc_m=80.0),
        HERE._replace(pdop=18.0, hdop=9.0, h_acc_m=80.0),
        HERE._replace(fix=2),
    ],
)
def test_no_home_from_a_poor_fix_whenever_the_receiver_is_plugged_in(
    generation: int, configure: bool, bad: Place
) -> None:
    for tenths in range(0, 10, 3):
        bench = Bench(configure=configure)
        bench.place = bad
        bench.run(tenths / 10)
        bench.ublox(generation=generation)
        bench.run(12)
        assert (bench.gps.fix, bench.gps.home_fix) == (True, False)


@pytest.mark.parametrize(("hdop", "home"), [(0.9, True), (2.5, True), (2.51, False), (9.9, False)])
def test_home_of_a_receiver_without_gsa_by_hdop(hdop: float, home: bool) -> None:
    bench = Bench()
    bench.place = HERE._replace(hdop=hdop)
    bench.nmea(gsa=False, baud=38400, period_ms=200)
    bench.until("gps.fix", 7)
    bench.run(2.5)
    assert (bench.gps.fix_3d, bench.gps.home_fix) == (False, False)
    bench.run(2)
    assert (bench.gps.fix_3d, bench.gps.home_fix) == (True, home)
    assert bench.gps.pdop_centi is None


def test_home_outlasts_the_loss_of_the_receiver() -> None:
    bench = Bench(configure=False)
    receiver = bench.nmea(baud=38400)
    bench.until("gps.home_fix", 12)
    receiver.stop()
    bench.run(10)
    assert (bench.gps.home_fix, bench.gps.home_distance_m) == (True, None)
    # Across the 180th meridian is another test; this is 1 km to the west.
    east = math.degrees(1000 / 6371008.8 / math.cos(math.radians(HERE.lat_deg)))
    bench.place = HERE._replace(lon_deg=HERE.lon_deg - east)
    receiver.start()
    bench.run(3)
    assert (bench.gps.home_distance_m, bench.gps.home_direction_decideg) == (1000, 900)


@pytest.mark.parametrize("start_ms", [(1 << 30) - 6000, (1 << 29) - 6000])
def test_the_clock_wraps(start_ms: int) -> None:
    bench = Bench(start_ms=start_ms)
    receiver = bench.ublox(generation=10)
    bench.run(15)
    assert (receiver.period_ms, bench.gps.protocol) == (100, "UBX")
    assert values(bench.gps) == UBX_VALUES


@pytest.mark.parametrize("satellites", [3, 0, -1, 33])
def test_impossible_options(satellites: int) -> None:
    with pytest.raises(ValueError, match=rf"minimum_satellites is {satellites}, must be 4\.\.32"):
        Bench(minimum_satellites=satellites)


def test_nav_pvt_and_nmea_together_count_once() -> None:
    bench = Bench(configure=False)
    bench.ublox(baud=57600, pvt=True)
    bench.until("gps.protocol == 'UBX'", 7)
    solutions = bench.solutions
    bench.run(10)
    assert bench.solutions - solutions == 10
    bench.uart.send(nav_pvt(HERE, 5), 57600)
    bench.run(0.1)
    assert bench.solutions - solutions == 11
