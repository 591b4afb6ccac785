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
    return json.dumps(file, separators=(",", ":")).encode()
