"""docs/configuration.md, from the points that the firmware declares."""

from __future__ import annotations

import json
from typing import Any

from ghst_tools.configuration.validator import firmware_module

_BEGINNING = """\
# Configuration

Written by `ghst config document` from `firmware/configuration/points.py`; the board checks a file
by the same declarations.

Everything that a board is told stands in one file in its file system, `/ghst.json`. What is absent
has its default; the defaults of pins, outputs and sensors are those of the board
([boards.md](boards.md)). An output that the board has by default keeps what the file does not
name. With an empty file, or none, the board is as its picture shows.

    {
        "name": "Wing",
        "outputs": {
            "6": {"reverse": true, "failsafe": 1500},
            "7": {"minimum_us": 1100, "maximum_us": 1900},
            "13": {"kind": "unused"}
        },
        "gps": {"enabled": false}
    }

`ghst config check FILE` tells what a board would say to a file, with the line. `mpremote cp
ghst.json :/ghst.json` puts it on the board, which reads it when it starts. A board with a file
that cannot be moves nothing, tells the reason on USB, and flashes three times.

MSP and the console write to the same file (settings of the video transmitter, the calibration of
the magnetometer), only while there is no link, since writing flash stops all interrupts. The new
file is written beside the old one, read back and renamed: a power cut leaves one of them whole.
"""


def document() -> str:
    """The text of the file."""
    points = firmware_module("points")
    parts = [_BEGINNING]
    for section, declared in points.SECTIONS.items():
        parts.append(_table(section or "At the top", declared))
        if section == "failsafe":
            parts.append(_table("outputs, each by its GPIO", points.OUTPUT))
    parts.append(_MOTORS)
    return "\n".join(parts)


_MOTORS = """\
## Motors

A motor stays at its shortest pulse until it is armed: the throttle channel has to be low while the
arm channel is low, and still low when the arm channel goes high. It is disarmed when the arm
channel goes low, and by failsafe; after failsafe it has to be armed anew. The telemetry's flag
tells whether motors are armed.
"""


def _table(title: str, points: Any) -> str:
    lines = [f"## {title}", "", "| name | value | default | |", "| --- | --- | --- | --- |"]
    for point in points:
        lines.append(
            f"| `{point.name}` | {point.range_text()} | `{json.dumps(point.default)}` "
            f"| {point.help} |"
        )
    return "\n".join(lines) + "\n"
