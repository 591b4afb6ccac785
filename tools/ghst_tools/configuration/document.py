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
name. Without a file, or with one that says `{}`, the board is as its picture shows. An empty file
is not valid JSON, and nothing moves with it.

    {
        "name": "Wing",
        "outputs": {
            "6": {"reverse": true, "failsafe": 1500},
            "7": {"minimum_us": 1100, "maximum_us": 1900},
            "13": {"kind": "unused"}
        },
        "gps": {"enabled": false}
    }

With an invalid file a board moves nothing, tells the reason on USB and in `ghst config show`, and
its LED flashes three times. `ghst config` also refuses a key that stands twice in an object, of
which the board's parser would keep the last without a word.

| `ghst config` | |
| --- | --- |
| `show` | every value in force, with units and defaults marked; the reason if nothing moves |
| `get KEY`, `set KEY VALUE` | one value, such as `outputs.6.reverse`; the rest of the file stays |
| `diff [FILE]` | in what the board differs from FILE, or from its defaults |
| `pull [FILE]`, `push FILE` | the board's file to here, and back, byte for byte |
| `dump` | the board's file as text, for `ghst config push -`; with `--commands` for a terminal |
| `wizard [FILE]` | asks step by step what a model needs and writes FILE; no board is needed |
| `check FILE` | what a board would say to FILE, with the lines; no board is needed |
| `defaults` | what a board has without a file; no board is needed |

[tools.md](tools.md#config) shows them. They talk to the board on USB, or to the one at `--port` or
`$GHST_PORT`; a board behind a USB-serial bridge (most with an ESP32) has to be named so, for a
bridge may as well be an adapter on the Ghost wire. A chip with its own USB, such as the ESP32-S3
and the ESP32-C3, is found.

An application that runs goes on meanwhile: nothing is stopped, and reading, sending and checking a
file delay no pulse; while the board checks a file, 0.2 s, telemetry waits. A board that
stands at MicroPython's prompt is configured as well.

**Before a file is saved** it is checked on this computer and once more on the board. It is written
beside the old one, read back and renamed: a power cut leaves one of them whole. It is in force
after a restart, which `--restart` does.

**While the link is up** nothing is written and the board is not restarted: writing the flash stops
all interrupts, so that the outputs keep their pulses and failsafe is judged late by what the flash
takes. `--force` does it all the same. On the bench, switch the transmitter off.

**What the board has saved itself is not lost**: `push` refuses to replace a file that is not the
one that FILE was pulled from or pushed as. `diff FILE` shows the difference, `pull` gets the
board's, `--force` replaces it and keeps the old one on this computer (in `$GHST_STATE`, or
`micropython-ghst` in the user's state folder).

MSP and the console write to the same file (settings of the video transmitter, the calibration of
the magnetometer), only while there is no link. What they write has the values of the old file and
not its spaces and line feeds: until then the file is what was pushed, byte for byte.
"""


def document() -> str:
    """The text of the file."""
    points = firmware_module("configuration.points")
    parts = [_BEGINNING]
    for section, declared in points.SECTIONS.items():
        parts.append(_table(section or "At the top", declared))
        if section == "failsafe":
            parts.append(_table("outputs, each by its GPIO", points.OUTPUT))
            parts.append(_limits())
        elif section == "wire":
            parts.append(_WIRE)
    parts.append(_MOTORS)
    return "\n".join(parts)


_WIRE = """\
Boards of the ESP32 family have the driver `uart` alone. It takes two pins, which have to be
connected as [boards.md](boards.md) says: `pin`, RX, straight to the wire; `tx_pin`, TX, through a
Schottky diode with its cathode at TX; and a resistor of 2.2 kOhm from the wire to 3.3 V, which the
diode needs. 1 kOhm in place of the diode does as well, without the pull-up. On the RP2040 and
RP2350 `pio`, the default, needs one pin and none of these parts. With `uart` there, `pin` and
`tx_pin` are RX and TX of one UART, and TX goes through 1 kOhm to the wire, or through the diode
with its pull-up: without either it fights a receiver that sends while the board starts.
"""

_MOTORS = """\
## Motors

A motor stays at its shortest pulse until it is armed: the throttle channel has to be low while the
arm channel is low, and still low when the arm channel goes high. It is disarmed when the arm
channel goes low, and by failsafe; after failsafe it has to be armed anew. The telemetry's flag
tells whether motors are armed.
"""


def _limits() -> str:
    """What the tables cannot say: the range of a pulse depends on another value."""
    outputs = firmware_module("configuration.outputs")
    ranges = []
    for kind in outputs.SHORTENED:
        lowest, highest = outputs.limits_us(kind)
        ranges.append(f"{lowest:g}..{highest:g} us with `{kind}`")
    return (
        "How long a pulse may be depends on the kind, for `minimum_us`, `centre_us`, `maximum_us` "
        "and\n"
        f"`failsafe`: {', '.join(ranges)}.\n"
        "They must rise from the minimum to the maximum: the direction is turned by `reverse`.\n"
    )


def _table(title: str, points: Any) -> str:
    lines = [f"## {title}", "", "| name | value | default | |", "| --- | --- | --- | --- |"]
    for point in points:
        lines.append(
            f"| `{point.name}` | {point.range_text()} | `{json.dumps(point.default)}` "
            f"| {point.help} |"
        )
    return "\n".join(lines) + "\n"
