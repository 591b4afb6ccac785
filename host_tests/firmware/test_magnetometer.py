"""Magnetometers on the emulated board: headings and timing.

That they allocate nothing, not even while they are calibrated, is tested beside the barometers.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from i2c_rig import LONGEST_UPDATE_US, Flight, grounded

from forked import forked
from ghst_tools.emulator.i2c_hmc5883l import Hmc5883l
from ghst_tools.emulator.i2c_magnetometers import Lis3mdl, Magnetometer, Qmc5883l


@pytest.fixture
def flight(micropython_image: Path, firmware_files: dict[str, bytes]) -> Flight:
    """A board before the start of its sensors; for forked tests only."""
    return grounded(micropython_image, firmware_files)


@pytest.mark.parametrize(
    ("chip", "address"), [(Qmc5883l, 0x0D), (Hmc5883l, 0x1E), (Lis3mdl, 0x1E)]
)
@forked
def test_each_chip(flight: Flight, chip: type[Magnetometer], address: int) -> None:
    flight.start(None, magnetometer=chip, magnetometer_address=address)
    flight.magnetometer.noise_nt = 100.0  # type: ignore[attr-defined]
    flight.wait(180)
    for heading_deg in (20.0, 200.0):
        flight.heading_deg = heading_deg
        _, headings = flight.values(100)
        assert headings >= 1
        assert abs(flight.note("heading_decideg") - 10 * heading_deg) < 20
    assert flight.note("magnetometer_faults") == 0
    assert flight.note("magnetometer_us") < LONGEST_UPDATE_US
