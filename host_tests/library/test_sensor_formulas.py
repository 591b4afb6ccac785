"""The sensors' integer arithmetic against floating point and exact fractions."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from firmware.sensors import bmp280, dps310
from firmware.sensors.arithmetic import atan2_decideg, divide, multiply
from firmware.sensors.atmosphere import (
    MAXIMUM_PRESSURE_16,
    MINIMUM_PRESSURE_16,
    altitude_mm,
)
from firmware.sensors.hard_iron import HardIron
from firmware.sensors.vario import AltitudeFilter
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from ghst_tools.emulator.i2c_barometers import Dps310
from ghst_tools.emulator.i2c_bmp280 import Bmp280

repeatable = settings(derandomize=True, deadline=None, max_examples=300)
small_ints = st.integers(-(2**30) + 1, 2**30 - 1)


class Still:
    """A clock that stands still."""

    now_ns = 0.0


@repeatable
@given(small_ints, small_ints, st.integers(1, 30))
def test_products_are_exact(a: int, b: int, shift: int) -> None:
    exact = Fraction(a * b, 1 << shift)
    wanted = math.floor(abs(exact) + Fraction(1, 2)) * (1 if exact > 0 else -1)
    assume(abs(wanted) < 2**30)
    assert multiply(a, b, shift) == wanted


@repeatable
@given(st.integers(0, 2**30 - 1), st.integers(1, 2**30 - 1), st.integers(0, 30))
def test_quotients_are_exact(a: int, b: int, shift: int) -> None:
    assume((a << shift) // b < 2**30)
    assert divide(a, b, shift) == (a << shift) // b


@repeatable
@given(st.integers(-(10**6), 10**6), st.integers(-(10**6), 10**6))
def test_angles_are_right_to_a_fifth_of_a_degree(x: int, y: int) -> None:
    assume(x or y)
    difference = atan2_decideg(y, x) - math.degrees(math.atan2(y, x)) * 10
    assert abs((difference + 1800) % 3600 - 1800) < 1.5


def isa_mm(pressure_pa: float) -> float:
    """The international standard atmosphere, below 11 km."""
    exponent = 287.05287 * 0.0065 / 9.80665
    return float(288.15 / 0.0065 * (1 - (pressure_pa / 101325) ** exponent) * 1000)


def test_altitudes_of_the_whole_table() -> None:
    for pressure_16 in range(MINIMUM_PRESSURE_16, MAXIMUM_PRESSURE_16 + 1, 37):
        error_mm = abs(altitude_mm(pressure_16) - isa_mm(pressure_16 / 16))
        assert error_mm < (
            40 if pressure_16 > 79_495 * 16 else 200 if pressure_16 > 491_000 else 500
        )


def test_small_changes_of_altitude_are_right() -> None:
    """Climbs of 1 m to 10 m near where a model starts: 5 cm, and three parts in a thousand."""
    for pressure_16 in range(70_000 * 16, 108_000 * 16, 1009):
        for step_pa in (12, 60, 120):
            found = altitude_mm(pressure_16) - altitude_mm(pressure_16 + 16 * step_pa)
            wanted = isa_mm(pressure_16 / 16) - isa_mm(pressure_16 / 16 + step_pa)
            assert abs(found - wanted) < min(50, 3 + 0.003 * wanted)


def near(nominal: int, spread: int) -> st.SearchStrategy[int]:
    return st.integers(nominal - spread, nominal + spread)


@repeatable
@given(
    st.tuples(*(near(value, abs(value) // 10 + 5) for value in Bmp280.CALIBRATION)),
    st.integers(200_000, 800_000),
    st.integers(440_000, 600_000),
)
def test_bmp280_against_the_formula(
    calibration: tuple[int, ...], raw: int, raw_temperature: int
) -> None:
    model = Bmp280(Still(), lambda t_ns: 0.0, lambda t_ns: 0.0)
    model.CALIBRATION = calibration  # type: ignore[assignment, misc]
    fine = model.fine_temperature(raw_temperature)
    wanted = model.compensated(raw, fine)
    assume(25_000 < wanted < 120_000 and -40 < fine / 5120 < 85)
    found = bmp280.fine_temperature(calibration, raw_temperature)
    assert abs(found - fine) < 1.5
    assert abs(bmp280.pressure_16(calibration, raw, found) / 16 - wanted) < 0.12


signed_16 = st.integers(-(2**15), 2**15 - 1)
signed_20 = st.integers(-(2**19), 2**19 - 1)
signed_12 = st.integers(-(2**11), 2**11 - 1)


@repeatable
@given(
    st.tuples(signed_12, signed_12, signed_20, signed_20, *[signed_16] * 5),
    st.integers(-(2**25) + 1, 2**25 - 1),
    st.integers(-(2**25) + 1, 2**25 - 1),
)
def test_dps310_against_the_formula(
    coefficients: tuple[int, ...], pressure: int, temperature: int
) -> None:
    model = Dps310(Still(), lambda t_ns: 0.0, lambda t_ns: 0.0)
    model.COEFFICIENTS = coefficients  # type: ignore[assignment, misc]
    model.reset_registers()
    assert dps310.unpack(bytes(model.registers[0x10:0x22])) == coefficients
    found = dps310.pressure_16(coefficients, pressure, temperature)
    assert abs(found / 16 - model.compensated(pressure / 2**24, temperature / 2**24)) < 0.1


class ExactFilter:
    """The vario's filter in floating point."""

    def __init__(self, altitude_mm: float, time_constant_ms: float) -> None:
        self.altitude_mm, self.speed_mm_s = altitude_mm, 0.0
        self._time_constant_ms = time_constant_ms

    def update(self, altitude_mm: float, step_ms: float) -> None:
        pole = self._time_constant_ms / (self._time_constant_ms + step_ms)
        predicted = self.altitude_mm + self.speed_mm_s * step_ms / 1000
        error = altitude_mm - predicted
        self.altitude_mm = predicted + (1 - pole**2) * error
        self.speed_mm_s += (1 - pole) ** 2 * error / step_ms * 1000


@repeatable
@given(
    st.integers(-500_000, 9_000_000),
    st.sampled_from([300, 400, 1000]),
    st.lists(st.tuples(st.integers(-3000, 3000), st.integers(10, 120)), min_size=1, max_size=80),
)
def test_filter_against_floating_point(
    start_mm: int, time_constant_ms: int, steps: list[tuple[int, int]]
) -> None:
    found = AltitudeFilter(time_constant_ms)
    found.update(start_mm, 0)
    wanted = ExactFilter(start_mm, time_constant_ms)
    for offset_mm, step_ms in steps:
        assert found.update(start_mm + offset_mm, step_ms)
        wanted.update(start_mm + offset_mm, step_ms)
        assert found.altitude_mm is not None
        assert abs(found.altitude_mm - wanted.altitude_mm) < 25
        assert abs(found.speed_mm_s - wanted.speed_mm_s) < 30 + 0.01 * abs(wanted.speed_mm_s)


@pytest.mark.parametrize("radius_nt", [10_000, 20_000, 45_000])
def test_an_accepted_part_of_a_circle_costs_four_degrees_at_most(radius_nt: int) -> None:
    accepted = 0
    for arc_deg in range(10, 361, 10):
        for start_deg in range(0, 360, 8):
            circle = HardIron()
            for step in range(120):
                at = math.radians(start_deg + arc_deg * step / 119)
                x = round(radius_nt * math.cos(at)) + 30_000
                circle.update((x, round(radius_nt * math.sin(at)) - 20_000, 0))
            try:
                x, y, _ = circle.offset_nt(0)
            except ValueError:
                assert arc_deg < 350
                continue
            accepted += 1
            away = math.hypot(x - 30_000, y + 20_000)
            assert math.degrees(math.asin(away / radius_nt)) < 4.0
            assert arc_deg > 250
    assert accepted > 300
