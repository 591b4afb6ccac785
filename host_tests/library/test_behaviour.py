"""The behaviour of `lib/ghst` on CPython, on MicroPython's unix port and on an emulated RP2040."""

import pytest
from targets import BEHAVIOUR, Target, cases

MODULES = (
    *("samples", "scaling", "link", "counters", "streams", "memory", "msp_queue"),
    *("telemetry", "telemetry_memory", "schedule", "downlink"),
    *("msp_requests", "msp_replies", "msp_responder", "msp_answers", "msp_vtx", "msp_memory"),
    *("battery", "battery_cells", "battery_memory", "rx5808", "rx5808_memory"),
    *("settings", "json_text"),
    "configuration",
    *("gps_stream", "nmea_fields", "nmea", "ubx", "geodesy", "gps_garbage", "gps_memory"),
    *("sensor_arithmetic", "barometer_formulas", "hard_iron"),
)

NEEDS_MICROPYTHON = (
    "memory",
    "telemetry_memory",
    "msp_memory",
    "battery_memory",
    "rx5808_memory",
    "gps_memory",
)
"""Modules that import `micropython`."""


CASES = [(module, name) for module in MODULES for name in cases(module)]


@pytest.mark.parametrize(("module", "name"), CASES)
def test_behaviour(target: Target, module: str, name: str, request: pytest.FixtureRequest) -> None:
    kind = request.node.callspec.params["target"]
    if module in NEEDS_MICROPYTHON and kind == "cpython":
        pytest.skip("CPython has no heap that can be locked")
    target.run(module, name)


def test_every_behaviour_module_is_run() -> None:
    workloads = {"__init__", "support", "random_bytes", "random_telemetry", "replay"} | {
        "msp_support",
        "msp_random",
        "gps_support",
    }
    assert {path.stem for path in BEHAVIOUR.glob("*.py")} == {*MODULES, *workloads}
