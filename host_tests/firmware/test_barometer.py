"""Barometers on the emulated board: values, timing, and no allocation."""

from __future__ import annotations

from pathlib import Path

import pytest
from i2c_rig import LONGEST_UPDATE_US, NONE, Flight, grounded

from forked import forked
from ghst_tools.emulator.i2c_barometers import Dps310, Lps22hb
from ghst_tools.emulator.i2c_bmp280 import Bmp280
from ghst_tools.emulator.i2c_hmc5883l import Hmc5883l
from ghst_tools.emulator.i2c_magnetometers import Lis3mdl, Magnetometer, Qmc5883l
from ghst_tools.emulator.i2c_sensors import Barometer, pressure_at


@pytest.fixture
def flight(micropython_image: Path, firmware_files: dict[str, bytes]) -> Flight:
    """A board before the start of its sensors; for forked tests only."""
    return grounded(micropython_image, firmware_files)


@pytest.mark.parametrize(
    ("chip", "address", "neighbour", "neighbour_address"),
    [
        (Bmp280, 0x77, Qmc5883l, 0x0D),
        (Dps310, 0x77, Hmc5883l, 0x1E),
        (Lps22hb, 0x5C, Lis3mdl, 0x1C),
    ],
)
@forked
def test_each_chip_beside_a_magnetometer(
    flight: Flight,
    chip: type[Barometer],
    address: int,
    neighbour: type[Magnetometer],
    neighbour_address: int,
) -> None:
    flight.temperature_c = -7.3
    flight.start(chip, address, neighbour, neighbour_address)
    flight.wait(250)
    flight.check_values()
    assert abs(flight.note("temperature_decicelsius") + 73) <= 1
    assert flight.note("altitude_cm") == NONE
    assert flight.note("barometer_faults") == flight.note("magnetometer_faults") == 0
    assert flight.note("barometer_us") < LONGEST_UPDATE_US
    assert flight.note("magnetometer_us") < LONGEST_UPDATE_US
    flight.check_heap()


@forked
def test_altitude_and_vario(flight: Flight) -> None:
    flight.start(magnetometer=None)
    flight.wait(1250)
    assert abs(flight.note("altitude_cm")) < 25
    assert abs(flight.note("vario_cm_s")) < 40
    start_m, start_ns = flight.altitude_m, flight.board.now_ns
    flight.barometer.pressure_pa = lambda t_ns: pressure_at(  # type: ignore[attr-defined]
        start_m + (t_ns - start_ns) * 5e-9
    )
    flight.wait(600)
    # Behind a sudden climb of 5 m/s: 44 % of it after 1.5 time constants, and 0.67 m less than
    # the 3 m; measurements are up to 45 ms old.
    assert abs(flight.note("vario_cm_s") - 210) < 50
    assert abs(flight.note("altitude_cm") - 220) < 35
    assert flight.note("barometer_faults") == 0


@forked
def test_no_sensor_at_all(flight: Flight) -> None:
    flight.start(barometer=None, magnetometer=None)
    flight.wait(240)
    assert flight.note("barometer_faults") == flight.note("magnetometer_faults") == 2
    assert flight.note("pressure_pa") == flight.note("heading_decideg") == NONE
    assert flight.note("barometer_us") < LONGEST_UPDATE_US
    assert flight.note("magnetometer_us") < LONGEST_UPDATE_US
