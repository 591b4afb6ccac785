"""`/board.json` as a board gets it: what the firmware needs of `boards/<name>/board.json`."""

import json
from collections.abc import Mapping
from typing import Any

from ghst_tools.chips import KINDS


def device_file(values: Mapping[str, Any]) -> bytes:
    """The file for the board, of the parsed and checked `boards/<name>/board.json`.

    `functions`: {function: [GPIO, ...]}. All pins of "gpio" and "output" can give servo pulses;
    on RP2 chips the slice is `gpio >> 1 & 7`, its output `gpio & 1`, and so no list has them. The
    channel of an ADC is left out, too. `labels`: {GPIO: what is printed} where that is not GP<n>.
    """
    pins: Mapping[str, Any] = values["pins"]
    functions: dict[str, list[int]] = {}
    for gpio, pin in pins.items():
        for function in pin["functions"]:
            if function.startswith("adc"):
                function = "adc"
            elif function.startswith(("pwm", "ledc")):
                continue
            functions.setdefault(function, []).append(int(gpio))
    order = [*KINDS, *sorted(set(functions) - set(KINDS))]
    file = {
        **{key: values[key] for key in ("name", "title", "chip", "outputs_hardware")},
        "functions": {key: functions[key] for key in order if key in functions},
        "labels": {
            gpio: pin["label"] for gpio, pin in pins.items() if pin["label"] != f"GP{gpio}"
        },
        "defaults": values["defaults"],
    }
    if values["outputs_hardware"]["kind"] == "pwm_slices":
        file |= legacy(values["defaults"])
    return json.dumps(file, separators=(",", ":")).encode()


def legacy(defaults: Mapping[str, Any]) -> dict[str, Any]:
    """The same defaults under the keys that `firmware/board.py` reads today."""
    pins: dict[str, Any] = {
        "ghst_wire": defaults["wire"]["pin"],
        "servos": {gpio: output["channel"] for gpio, output in defaults["outputs"].items()},
    }
    sensors: dict[str, Any] = {}
    if "led" in defaults:
        pins["led"] = defaults["led"]["pin"]
    if "gps" in defaults:
        gps = defaults["gps"]
        pins["gps_uart"] = {"id": gps["uart"], "tx": gps["tx_pin"], "rx": gps["rx_pin"]}
        sensors["gps"] = {}
    if "i2c" in defaults:
        i2c = defaults["i2c"]
        pins["i2c"] = {"id": i2c["bus"], "sda": i2c["sda_pin"], "scl": i2c["scl_pin"]}
    sensors |= {key: {} for key in ("barometer", "magnetometer") if key in defaults}
    if "battery" in defaults:
        battery = dict(defaults["battery"])
        for old, new in (("battery_adc", "voltage_pin"), ("current_adc", "current_pin")):
            if new in battery:
                pins[old] = battery.pop(new)
        sensors["battery"] = battery
    return {"pins": pins, "sensors": sensors}
