"""`Gps` finds its receiver, whatever else is on the line.

On CPython, where minutes take a second; the emulated board does the same with the real UART in
`host_tests/firmware/test_gps.py`.
"""

from __future__ import annotations

import random

import pytest
from gps_bench import BAUDRATES, HERE, NMEA_VALUES, NOTHING, UBX_VALUES, Bench, values

from ghst_tools.emulator.gps_messages import nmea_epoch, sentence, ubx


def test_before_anything_comes() -> None:
    bench = Bench()
    bench.run(5)
    gps = bench.gps
    assert values(gps) == NOTHING
    assert (gps.home_fix, gps.home_distance_m, gps.home_direction_decideg) == (False, None, None)
    assert (gps.updates, gps.faults, gps.baudrate, gps.protocol) == (0, 0, None, None)
    assert gps.describe() == "nothing comes from a receiver"
    # No rate is better than another one while nothing comes.
    assert bench.uart.baudrates == [9600]


@pytest.mark.parametrize("baud", BAUDRATES)
def test_every_baud_rate_is_found(baud: int) -> None:
    bench = Bench()
    bench.nmea(baud=baud, period_ms=1000)
    took_s = bench.until("gps.updates", 7)
    assert bench.gps.baudrate == baud
    assert bench.uart.baudrates == list(BAUDRATES[: BAUDRATES.index(baud) + 1])
    # One burst for each rate that is wrong, and the first one: nobody knows where it began.
    assert took_s < 1.3 + BAUDRATES.index(baud)
    bench.run(6)
    assert values(bench.gps) == NMEA_VALUES
    assert bench.gps.faults == 0
    assert bench.gps.describe() == f"3D fix, 12 satellites, home 0 m, NMEA at {baud} baud"


def test_another_receiver_at_another_rate() -> None:
    bench = Bench(configure=False)
    for baud in (57600, 9600, 115200, 38400):
        receiver = bench.nmea(baud=baud)
        bench.until(f"gps.baudrate == {baud}", 12)
        bench.until("gps.fix", 3)
        receiver.stop()
        bench.run(0.5)


@pytest.mark.parametrize("before", BAUDRATES)
@pytest.mark.parametrize("after", BAUDRATES)
def test_from_each_baud_rate_to_each(before: int, after: int) -> None:
    bench = Bench(configure=False)
    receiver = bench.nmea(baud=before, period_ms=200 if before > 9600 else 500)
    bench.until("gps.fix", 3)
    receiver.baud = after
    receiver.period_ms = 200 if after > 9600 else 500
    # Lost after 3 s, and perhaps silent for 2 s if it is much slower now.
    bench.run(0.5)
    took_s = bench.until(f"gps.baudrate == {after}", 9)
    assert took_s < (6 if after == 9600 else 4.5)
    bench.run(1.5)
    assert values(bench.gps) == NMEA_VALUES


def test_silence_is_waited_through_at_the_slowest_rate() -> None:
    bench = Bench(configure=False)
    receiver = bench.nmea(baud=115200, period_ms=200)
    bench.until("gps.fix", 3)
    receiver.stop()
    # Whatever pauses for a moment only is still there at its own rate.
    bench.run(4.5)
    assert (bench.gps.baudrate, bench.gps._reader.port.listening) == (None, 115200)
    bench.run(60)
    assert bench.uart.baudrates == [*BAUDRATES, 9600]


def test_garbage_for_ever_is_searched_through_more_and_more_slowly() -> None:
    bench = Bench(round_ms=20)
    rng = random.Random(1)
    noise = bytes(rng.randrange(256) for _ in range(300))
    for _ in range(60):
        bench.uart.send(noise, 19200)
        bench.run(1)
    changes = len(bench.uart.baudrates)
    assert bench.uart.baudrates[:5] == [9600, 38400, 57600, 115200, 9600]
    for _ in range(60):
        bench.uart.send(noise, 19200)
        bench.run(1)
    # Eight times as long at each rate: new buffers every ten seconds.
    assert len(bench.uart.baudrates) - changes <= 7
    assert (bench.gps.baudrate, bench.gps.faults) == (None, 0)
    bench.nmea(baud=57600)
    bench.until("gps.fix", 45)


def test_a_single_glitch_does_not_use_a_rate_up() -> None:
    bench = Bench()
    for _ in range(10):
        bench.uart.send(b"\xff", 9600)
        bench.run(2)
    assert bench.uart.baudrates == [9600]
    assert bench.gps.describe() == "no receiver found, listening at 9600 baud"


def test_garbage_instead_of_what_came_is_a_lost_receiver() -> None:
    bench = Bench(configure=False)
    receiver = bench.nmea(period_ms=200, baud=57600)
    bench.until("gps.fix", 7)
    receiver.stop()
    rng = random.Random(2)
    bench.run(0.5)
    for _ in range(3):
        bench.uart.send(bytes(rng.randrange(256) for _ in range(1000)), 57600)
        bench.run(1)
    assert not bench.gps.fix
    assert bench.gps.baudrate is None
    receiver.start()
    bench.until("gps.fix", 15)


def test_sentences_between_garbage_are_all_read() -> None:
    bench = Bench(configure=False)
    bench.nmea(baud=115200, period_ms=1000)
    bench.until("gps.fix", 7)
    rng = random.Random(3)
    before = bench.gps.updates
    for number in range(100):
        noise = bytes(rng.randrange(256) for _ in range(rng.randrange(40)))
        for data in nmea_epoch(HERE, 1000 * number + 7):
            bench.uart.send(noise + data, 115200)
        bench.run(0.1)
    assert bench.gps.updates - before >= 100
    assert 0 < bench.gps.faults < 400
    assert bench.uart.lost == 0


def test_frames_that_mean_something_else() -> None:
    bench = Bench(configure=False)
    bench.uart.send(ubx(0x01, 0x03, bytes(16)) + ubx(0x05, 0x00, b"\x06\x01"), 9600)
    bench.run(0.5)
    # Any frame tells the rate.
    assert (bench.gps.baudrate, bench.gps.protocol, bench.gps.updates) == (9600, None, 0)
    assert bench.gps.describe() == "no fix, no solution at 9600 baud"
    bench.uart.send(ubx(0x01, 0x07, bytes(40)), 9600)
    bench.run(0.5)
    assert (bench.gps.faults, bench.gps.updates) == (1, 0)
    bench.uart.send(sentence("GPGGA,,,,,,x,00,,,,,,,"), 9600)
    bench.run(0.5)
    assert (bench.gps.faults, bench.gps.updates) == (2, 0)


@pytest.mark.parametrize("round_ms", [1, 20, 50])
def test_the_main_loop_may_be_slow(round_ms: int) -> None:
    bench = Bench(round_ms=round_ms)
    receiver = bench.ublox()
    bench.run(20)
    solutions = bench.solutions
    bench.run(5)
    assert (bench.solutions - solutions, receiver.period_ms) == (50, 100)
    assert bench.uart.lost == 0


def test_a_main_loop_that_stands_still_loses_solutions_and_nothing_else() -> None:
    bench = Bench()
    bench.ublox(baud=115200)
    bench.run(15)
    bench.clock.run_until(bench.clock.nanos + 10e9)
    assert bench.gps.baudrate == 115200
    bench.run(3)
    assert bench.uart.lost > 0
    assert (bench.gps.protocol, values(bench.gps)) == ("UBX", UBX_VALUES)
    solutions = bench.solutions
    bench.run(1)
    assert bench.solutions - solutions == 10
