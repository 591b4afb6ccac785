"""Altitude and vario from emulated barometers, in emulated time without a board."""

from __future__ import annotations

import pytest
from simulated_i2c import BAROMETERS, Bench


@pytest.mark.parametrize("name", BAROMETERS)
def test_altitude_is_zero_at_the_start_and_follows(name: str) -> None:
    bench = Bench(name)
    found: list[tuple[float, int | None]] = []
    bench.run(1.5, watch=lambda: found.append((bench.bus.now_ns / 1e9, bench.sensor.altitude_cm)))
    first_s = next(at for at, altitude in found if altitude is not None)
    assert 1.0 < first_s < 1.25
    for _ in range(200):  # 2 m/s
        bench.altitude_m += 0.02
        bench.run(0.01, period_ms=10)
    bench.run(3)
    assert abs(bench.sensor.altitude_cm - 400) < 20
    assert abs(bench.sensor.vario_cm_s) < 25
    assert abs(bench.sensor.temperature_decicelsius - 187) <= 1
    assert bench.sensor.describe().startswith(f"{name}: ")


@pytest.mark.parametrize("name", BAROMETERS)
def test_vario_of_a_steady_climb(name: str) -> None:
    bench = Bench(name)
    seen: list[int] = []
    start_ns = 3e9

    def climb() -> None:
        bench.altitude_m = 123 + max(0, bench.bus.now_ns - start_ns) * 3e-9

    bench.run(5, watch=climb)
    bench.run(4, watch=lambda: (climb(), seen.append(bench.sensor.vario_cm_s)))  # type: ignore[func-returns-value]
    assert abs(sum(seen) / len(seen) - 300) < 6
    assert max(abs(vario - 300) for vario in seen) < 45


def test_the_zero_is_kept_while_the_chip_is_away() -> None:
    bench = Bench("BMP280")
    bench.run(2)
    bench.chip.unplug()
    bench.run(1.5)
    assert bench.sensor.altitude_cm is None
    bench.altitude_m += 40
    bench.chip.plug_in()
    bench.run(4)
    assert abs(bench.sensor.altitude_cm - 4000) < 30
    assert abs(bench.sensor.vario_cm_s) < 25


def test_the_zero_starts_afresh_when_the_chip_vanishes_before_it_was_found() -> None:
    bench = Bench("BMP280")
    bench.run(0.8)
    bench.altitude_m += 40
    bench.chip.unplug()
    bench.run(0.3)
    bench.chip.plug_in()
    bench.run(3)
    assert abs(bench.sensor.altitude_cm) < 20


def test_a_jump_that_cannot_be_is_left_out() -> None:
    bench = Bench("LPS22HB")
    bench.run(3)
    faults = bench.sensor.faults
    bench.altitude_m += 400
    bench.run(0.025)
    bench.altitude_m -= 400
    bench.run(0.5)
    assert 1 <= bench.sensor.faults - faults <= 2
    assert abs(bench.sensor.altitude_cm) < 30
    assert abs(bench.sensor.vario_cm_s) < 40
    bench.altitude_m += 400
    bench.run(1.5)  # it stays: believed after the chip has been started anew
    assert abs(bench.sensor.altitude_cm - 40_000) < 60


@pytest.mark.parametrize("altitude_m", [-1500, 12_000])
def test_a_pressure_that_cannot_be_is_a_fault(altitude_m: float) -> None:
    bench = Bench("LPS22HB")
    bench.altitude_m = altitude_m
    bench.run(2)
    assert bench.value is None
    assert bench.sensor.faults > 3
