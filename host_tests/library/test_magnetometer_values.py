"""Headings and calibration from emulated magnetometers, in emulated time without a board."""

from __future__ import annotations

from typing import Any

import pytest
from firmware.sensors.magnetometer import Magnetometer
from simulated_i2c import MAGNETOMETERS, Bench, SimulatedI2c, field_at


def heading(bench: Bench, **options: Any) -> int:
    bench.sensor = Magnetometer(bench.bus, **options)
    bench.run(0.4)
    assert bench.sensor.heading_decideg is not None
    return int(bench.sensor.heading_decideg)


def away(found: int, wanted: float) -> float:
    return abs((found - wanted + 1800) % 3600 - 1800)


@pytest.mark.parametrize("name", MAGNETOMETERS)
def test_headings_all_round(name: str) -> None:
    bench = Bench(name)
    bench.chip.noise_nt = 20  # type: ignore[attr-defined]
    bench.run(0.5)
    for degrees in range(0, 360, 7):
        bench.heading_deg = degrees
        bench.run(0.1)
        assert 0 <= bench.sensor.heading_decideg <= 3599
        assert away(bench.sensor.heading_decideg, 10 * degrees) <= 6  # 1.2 uT is one step
        assert bench.sensor.describe().startswith(f"{name}: ")


@pytest.mark.parametrize("rotation_deg", [0, 90, 180, 270, 17])
@pytest.mark.parametrize("upside_down", [False, True])
def test_mounting_and_declination(rotation_deg: int, upside_down: bool) -> None:
    """An independent model: the field in the world, turned into the chip's axes step by step."""
    nose_deg, declination_deg = 77.0, -12.5
    bench = Bench("QMC5883L")
    bench.chip.noise_nt = 0.001  # type: ignore[attr-defined]
    # Magnetic north is at the declination; the chip's x arrow is turned from the nose.
    x, y, z = field_at(nose_deg + rotation_deg - declination_deg)
    field = (x, -y, -z) if upside_down else (x, y, z)
    ticks = iter(range(1 << 30))
    bench.chip.field_nt = lambda t_ns: (field[0] + next(ticks) % 3, *field[1:])  # type: ignore[attr-defined]
    found = heading(
        bench,
        rotation_deg=rotation_deg,
        upside_down=upside_down,
        declination_decideg=round(10 * declination_deg),
    )
    assert away(found, 10 * nose_deg) <= 2


@pytest.mark.parametrize("name", MAGNETOMETERS)
def test_a_field_beyond_the_range_is_counted_and_skipped(name: str) -> None:
    bench = Bench(name)
    bench.run(0.5)
    faults, before = bench.sensor.faults, bench.sensor.heading_decideg
    normal = bench.chip.field_nt  # type: ignore[attr-defined]
    bench.chip.field_nt = lambda t_ns: (1e9, 2e4, 2e4)  # type: ignore[attr-defined]
    bench.run(0.5)
    assert bench.sensor.faults >= faults + 8
    assert away(bench.sensor.heading_decideg, before) <= 30
    assert bench.sensor.chip == name
    bench.run(0.7)
    assert bench.sensor.heading_decideg is None
    bench.chip.field_nt = normal  # type: ignore[attr-defined]
    bench.run(0.1)
    assert bench.right()


def test_no_field_at_all_is_a_fault() -> None:
    bench = Bench("QMC5883L")
    bench.chip.field_nt = lambda t_ns: (0.0, 0.0, 0.0)  # type: ignore[attr-defined]
    bench.chip.noise_nt = 0  # type: ignore[attr-defined]
    bench.run(2)
    assert bench.value is None
    assert bench.sensor.faults > 2


@pytest.mark.parametrize("name", MAGNETOMETERS)
def test_calibration(name: str) -> None:
    bench = Bench(name)
    iron = (35_000.0, -28_000.0, 9_000.0)
    bench.chip.field_nt = lambda t_ns: field_at(bench.heading_deg, hard_iron_nt=iron)  # type: ignore[attr-defined]
    bench.run(0.5)
    sensor = bench.sensor
    with pytest.raises(ValueError, match="no calibration is under way"):
        sensor.finish_calibration()
    sensor.start_calibration()
    assert sensor.calibrating
    bench.run(1)
    with pytest.raises(ValueError, match="turn the model for some seconds"):
        sensor.finish_calibration()
    bench.run(2)
    with pytest.raises(ValueError, match=r"changed by \d uT only"):
        sensor.finish_calibration()
    for part in range(2):
        for _ in range(180):
            bench.heading_deg += 1
            bench.run(0.03)
        if not part:
            with pytest.raises(ValueError, match="not complete"):
                sensor.finish_calibration()
            assert "calibrating" in sensor.describe()
    offset = sensor.finish_calibration()
    assert offset == sensor.offset_nt
    assert not sensor.calibrating
    assert offset[2] == 0  # it was not turned over
    assert max(abs(offset[axis] - iron[axis]) for axis in range(2)) < 700
    bench.run(0.1)
    assert bench.right()
    again = Magnetometer(bench.bus, offset_nt=list(offset))
    bench.bus.run(again, 0.5)
    assert away(again.heading_decideg, sensor.heading_decideg) < 50


def test_a_calibration_can_be_cancelled() -> None:
    bench = Bench("LIS3MDL")
    bench.run(0.5)
    bench.sensor.start_calibration()
    bench.run(0.5)
    bench.sensor.cancel_calibration()
    assert not bench.sensor.calibrating
    assert bench.sensor.offset_nt == (0, 0, 0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"offset_nt": (1, 2)}, "must be three"),
        ({"offset_nt": (0, 0, 1_000_001)}, "calibrate again"),
        ({"declination_decideg": 1801}, "must be -1800..1800"),
        ({"rotation_deg": 360}, "must be 0..359"),
        ({"rotation_deg": -90}, "must be 0..359"),
    ],
)
def test_options_that_cannot_be(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Magnetometer(SimulatedI2c(), **options)
