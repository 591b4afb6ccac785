"""Faults of the I2C bus while control frames come at 500 Hz, on the emulated board."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from i2c_rig import Flight, grounded

from forked import forked


@pytest.fixture
def flight(micropython_image: Path, firmware_files: dict[str, bytes]) -> Flight:
    """A flight before its start; for forked tests only."""
    return grounded(micropython_image, firmware_files)


@forked
def test_without_faults(flight: Flight) -> None:
    flight.take_off()
    flight.check_values()
    flight.check_control()
    names = ("barometer_faults", "magnetometer_faults", "faults", "timeouts", "recoveries")
    assert [flight.note(name) for name in names] == [0] * 5


@forked
def test_nobody_answers_in_the_middle(flight: Flight) -> None:
    flight.take_off()
    flight.barometer.unplug()
    flight.wait(40)
    assert flight.note("barometer_faults") >= 2
    assert flight.note("magnetometer_faults") == 0
    assert flight.note("faults") >= 2
    assert flight.values(70)[1] >= 1  # the other one goes on, every 40 to 64 ms
    flight.barometer.plug_in()
    flight.wait(150)
    flight.check_values()
    assert flight.note("timeouts") == flight.note("recoveries") == 0
    flight.check_control()


@forked
def test_sda_is_held_low_and_clocked_free(flight: Flight) -> None:
    flight.take_off()
    flight.bus.hold_sda(9)
    flight.wait(60)
    assert flight.note("recoveries") == 1
    assert flight.board.pin(4).level and not flight.bus.stuck
    flight.check_values()
    assert 1 <= flight.note("faults") <= 2
    flight.check_control()


@forked
def test_sda_is_held_low_in_the_middle_of_a_byte(flight: Flight) -> None:
    flight.take_off()
    read = flight.barometer.read

    def hold() -> int:
        flight.barometer.read = read  # type: ignore[method-assign]
        flight.bus.hold_sda(5)
        return read()

    flight.barometer.read = hold  # type: ignore[method-assign]
    flight.wait(100)
    assert (flight.note("timeouts"), flight.note("recoveries")) == (1, 1)
    flight.check_values()
    flight.check_control()


@forked
def test_a_line_stays_low_for_long(flight: Flight) -> None:
    flight.take_off()
    flight.bus.stuck = True
    flight.board.pin(5).drive(False)  # SCL: clocking does not help
    flight.wait(100)
    # Once it timed out; since then the lines were only looked at, after 10, 20 and 40 ms.
    assert flight.note("timeouts") == 1
    assert flight.note("recoveries") == 0
    assert flight.values(20) == (0, 0)
    flight.board.pin(5).drive(None)
    flight.bus.stuck = False
    flight.wait(80)
    assert flight.note("recoveries") == 1
    flight.check_values()
    flight.check_control()


@forked
def test_an_sda_that_is_low_without_a_timeout(flight: Flight) -> None:
    """The controller may also say that it has lost the arbitration: only the line tells."""
    flight.take_off()
    flight.barometer.plugged_in = flight.magnetometer.plugged_in = False
    flight.board.pin(4).drive(False)
    flight.wait(60)
    assert flight.note("timeouts") == flight.note("recoveries") == 0
    assert flight.note("faults") == 1
    flight.board.pin(4).drive(None)
    flight.barometer.plugged_in = flight.magnetometer.plugged_in = True
    flight.wait(60)
    assert flight.note("recoveries") == 1
    flight.check_values()
    flight.check_control()


@forked
def test_garbage_from_all_registers(flight: Flight) -> None:
    flight.take_off()
    flight.barometer.garbage = random.Random(1)
    flight.magnetometer.garbage = random.Random(2)
    flight.wait(70)
    assert flight.note("barometer_faults") >= 3
    assert flight.note("magnetometer_faults") >= 3
    flight.barometer.garbage = flight.magnetometer.garbage = None
    flight.barometer.plug_in()
    flight.magnetometer.plug_in()
    flight.wait(220)  # a search that failed waits for 100 ms or 200 ms by now
    flight.check_values()
    flight.check_control()


@forked
def test_chips_that_hang_in_the_middle_of_everything(flight: Flight) -> None:
    """The bus stops dead at any of its steps, again and again."""
    flight.take_off()
    chance = random.Random(7)
    for _ in range(3):
        flight.wait(chance.uniform(1, 30))
        flight.bus.hold_sda(chance.randint(1, 9))
        flight.wait(chance.uniform(30, 60))
    flight.wait(60)
    assert flight.note("recoveries") == 3
    flight.check_values()
    flight.check_control()
