"""Barometer and magnetometer against emulated chips that are missing, vanish, lie or hang.

Here without a board, in emulated time, so that hours cost seconds; `host_tests/firmware` has the
same on the emulated board.
"""

from __future__ import annotations

import itertools
import random

import pytest
from firmware.sensors.barometer import Barometer
from firmware.sensors.magnetometer import Magnetometer
from hypothesis import given, settings
from hypothesis import strategies as st
from simulated_i2c import BAROMETERS, CHIPS, MAGNETOMETERS, PLACES, WRAP, Bench, SimulatedI2c


@pytest.mark.parametrize(("name", "address"), PLACES)
def test_finds_the_chip_and_reads_it(name: str, address: int) -> None:
    bench = Bench(name, address)
    assert bench.sensor.chip is None
    assert bench.value is None
    bench.run(0.4)
    found = bench.run(2.0)
    assert bench.right()
    assert bench.sensor.chip == name
    assert bench.sensor.faults == 0
    assert 40 <= found <= 100  # 20 to 50 a second
    assert bench.chip.measurements >= found


@pytest.mark.parametrize("name", CHIPS)
@pytest.mark.parametrize("period_ms", [0.2, 1.0, 20.0, 90.0])
def test_main_loops_of_any_speed(name: str, period_ms: float) -> None:
    bench = Bench(name)
    bench.run(0.8, period_ms=period_ms)
    found = bench.run(1.0, period_ms=period_ms)
    assert bench.right()
    assert bench.sensor.faults == 0
    assert found >= min(20, 300 / period_ms)


@pytest.mark.parametrize("name", CHIPS)
def test_an_address_of_its_own(name: str) -> None:
    for right in (True, False):
        bench = Bench(name)
        other = 0x76 if bench.address != 0x76 else 0x77
        if name in MAGNETOMETERS:
            other = 0x1C if bench.address != 0x1C else 0x0D
        address = bench.address if right else other
        bench.sensor = type(bench.sensor)(bench.bus, address=address)
        bench.run(0.5)
        assert bench.right() is right
        assert (bench.sensor.faults == 0) is right


@pytest.mark.parametrize("slowest_ms", [6, 60])
@pytest.mark.parametrize("name", CHIPS)
def test_no_value_has_bytes_of_two_measurements(name: str, slowest_ms: int) -> None:
    """Each measurement differs from the one before in the high bytes of all of its numbers."""
    bench = Bench(name)
    seen: set[int] = set()
    if name in BAROMETERS:
        pressures = itertools.cycle((100_000.0, 100_020.0, 99_990.0))
        bench.chip.noise_pa = 0.0  # type: ignore[attr-defined]
        bench.chip.pressure_pa = lambda t_ns: next(pressures)  # type: ignore[attr-defined]
        allowed = (100_000, 100_020, 99_990)
        tolerance = 2
    else:
        # Each axis differs. 2 degrees to the left and to the right; the low byte of one with the
        # high byte of the other is 20 degrees away, the y of one with the x of the other 1 degree.
        fields = itertools.cycle(((20_000.0, -700.0, 40_000.0), (40_000.0, 1400.0, -40_000.0)))
        bench.chip.noise_nt = 0.0  # type: ignore[attr-defined]
        bench.chip.field_nt = lambda t_ns: next(fields)  # type: ignore[attr-defined]
        allowed = (20, 3580)
        tolerance = 3
    bench.run(1.5)

    def note() -> None:
        assert bench.value is not None
        seen.add(bench.value)

    periods = random.Random(1)
    for _ in range(1500):
        bench.run(0.1, period_ms=periods.uniform(2, slowest_ms), watch=note)
    wrong = [value for value in seen if min(abs(value - right) for right in allowed) > tolerance]
    assert wrong == []
    assert bench.sensor.faults == 0


def test_a_missing_chip_is_searched_for_ever_more_rarely() -> None:
    bench = Bench("BMP280")
    bench.chip.unplug()
    rounds: list[float] = []

    def note() -> None:
        if bench.sensor.faults > len(rounds):
            rounds.append(bench.bus.now_ns / 1e6)

    bench.run(30, period_ms=1, watch=note)
    pauses = [later - sooner for sooner, later in itertools.pairwise(rounds)]
    assert [round(pause, -2) for pause in pauses] == [100, 200, 400, 800, 1600, 3200, *[5000] * 4]
    assert bench.sensor.describe() == "no barometer answers"
    bench.chip.plug_in()
    bench.run(5.3)
    assert bench.right()


@pytest.mark.parametrize("name", CHIPS)
def test_a_transfer_that_fails_now_and_then_costs_one_value(name: str) -> None:
    bench = Bench(name)
    bench.run(0.5)
    quiet = bench.run(2)
    bench.bus.fails = lambda number: number % 17 == 0
    noisy = bench.run(2)
    assert bench.right()
    assert bench.sensor.faults > 3
    assert noisy > 0.75 * quiet


@pytest.mark.parametrize("name", CHIPS)
def test_each_transfer_of_the_start_may_fail(name: str) -> None:
    for bad in range(45):
        bench = Bench(name)
        bench.bus.fails = lambda number, bad=bad: number == bad  # type: ignore[misc]
        bench.run(1.2)
        assert bench.right(), bad
        bench.run(0.5)
        assert bench.sensor.faults <= 1


@pytest.mark.parametrize("name", CHIPS)
def test_unplugged_and_back(name: str) -> None:
    bench = Bench(name)
    bench.run(1.5)
    assert bench.right()
    for gone_s in (0.01, 0.1, 0.7, 3.0):
        faults = bench.sensor.faults
        bench.chip.unplug()
        bench.run(gone_s)
        assert gone_s < 0.1 or bench.sensor.faults > faults
        assert gone_s < 3 or bench.value is None
        bench.altitude_m += 5
        bench.heading_deg += 20
        bench.chip.plug_in()
        bench.run(3.3)
        assert bench.right(), gone_s


@pytest.mark.parametrize("name", CHIPS)
def test_values_are_gone_a_second_after_the_last_measurement(name: str) -> None:
    bench = Bench(name)
    bench.run(1.5)
    bench.chip.unplug()
    bench.run(0.95)
    assert bench.value is not None
    bench.run(0.1)
    assert bench.value is None
    assert "answers" in bench.sensor.describe()


@pytest.mark.parametrize("name", CHIPS)
def test_values_are_gone_while_the_bus_is_blocked(name: str) -> None:
    bench = Bench(name)
    bench.run(1.5)
    bench.bus.blocked = True
    bench.run(1.1)
    assert bench.value is None
    bench.bus.blocked = False
    bench.run(0.2)
    assert bench.right()


@pytest.mark.parametrize("name", CHIPS)
def test_a_chip_that_lost_its_power_for_a_moment(name: str) -> None:
    bench = Bench(name)
    bench.run(1.5)
    bench.chip.power_up()  # nobody saw it gone
    bench.altitude_m += 5
    bench.heading_deg += 20
    bench.run(0.8)
    assert bench.right()


@pytest.mark.parametrize("name", CHIPS)
def test_a_chip_that_hangs_is_a_fault_and_its_values_go(name: str) -> None:
    bench = Bench(name)
    bench.run(1.5)
    bench.chip.frozen = True
    bench.run(2.9)
    assert bench.value is not None
    bench.run(1.5)
    faults = bench.sensor.faults
    assert faults >= 1
    assert bench.value is None
    bench.run(20)
    assert bench.value is None
    assert bench.sensor.faults > faults
    bench.chip.frozen = False
    bench.altitude_m += 5
    bench.heading_deg += 20
    bench.run(5.5)
    assert bench.right()


@pytest.mark.parametrize("name", CHIPS)
def test_garbage_from_all_registers(name: str) -> None:
    bench = Bench(name)
    bench.run(1.5)
    for seed in range(20):
        bench.chip.garbage = random.Random(seed)
        bench.run(0.4)
        bench.chip.garbage = None
        bench.chip.plug_in()
        bench.run(1.3)
    assert bench.sensor.faults >= 40
    bench.run(5)
    assert bench.right()


@pytest.mark.parametrize("name", CHIPS)
def test_garbage_is_hardly_ever_believed(name: str) -> None:
    bench = Bench(name)
    bench.run(1.5)
    bench.chip.garbage = random.Random(name)
    assert bench.run(60) <= 2


@pytest.mark.parametrize("name", CHIPS)
@pytest.mark.parametrize("before_ms", [0, 300, 1400, 2500])
def test_the_clock_wraps(name: str, before_ms: int) -> None:
    bench = Bench(name, start_ms=WRAP - before_ms)
    bench.run(2)
    assert bench.right()
    bench.chip.unplug()
    bench.run(1.2)
    assert bench.value is None
    bench.chip.plug_in()
    bench.run(1.5)
    assert bench.right()


@settings(derandomize=True, deadline=None, max_examples=40)
@given(
    st.sampled_from(CHIPS), st.lists(st.tuples(st.sampled_from("pugfcbr"), st.integers(1, 900)))
)
def test_any_sequence_of_faults(name: str, events: list[tuple[str, int]]) -> None:
    bench = Bench(name)
    chip = bench.chip
    for kind, duration_ms in events:
        if kind == "p":
            chip.plug_in()
        elif kind == "u":
            chip.unplug()
        elif kind == "g":
            chip.garbage = random.Random(duration_ms)
        elif kind == "f":
            chip.frozen = not chip.frozen
        elif kind == "b":
            bench.bus.blocked = not bench.bus.blocked
        else:
            bench.bus.fails = random.Random(duration_ms).choice(
                (lambda n: n % 3 == 0, lambda n: False)
            )
        bench.run(duration_ms / 1000)
    chip.garbage, chip.frozen, bench.bus.blocked = None, False, False
    bench.bus.fails = lambda number: False
    chip.plug_in()
    bench.run(6.5)
    assert bench.right()


@pytest.mark.parametrize("address", [0, 0x75, 0x78, -1, 128])
def test_an_address_that_no_chip_has(address: int) -> None:
    with pytest.raises(ValueError, match="must be one of 0x5c, 0x5d, 0x76, 0x77"):
        Barometer(SimulatedI2c(), address=address)
    with pytest.raises(ValueError, match="must be one of 0x0d, 0x1c, 0x1e"):
        Magnetometer(SimulatedI2c(), address=address)
