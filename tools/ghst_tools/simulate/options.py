"""The options of `ghst simulate`, and which of them go together."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from ghst.protocol import BAUD_RATE  # type: ignore[import-not-found]
from ghst_tools.simulate.sticks import PATTERNS
from ghst_tools.simulate.uplink import HIGHEST_RATE_HZ
from ghst_tools.simulate.value_types import (
    MODES,
    AxesType,
    HeldType,
    LossType,
    MspType,
    RampType,
    VtxType,
)

_SOURCES = ("pattern", "joystick", "keyboard", "file", "capture")
# A recording has its own.
_NOT_WITH_CAPTURE = (
    "mode",
    "twelve_bit",
    "channels",
    "request_telemetry",
    "lq",
    "rssi",
    "power",
    "period",
    "held",
)
_PERCENT = click.FloatRange(0, 100)
_SECONDS = click.FloatRange(min=0, min_open=True)
_FILE = click.Path(path_type=Path, dir_okay=False)


def _together(*groups: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def add(function: Any) -> Any:
        for option in reversed(groups):
            function = option(function)
        return function

    return add


_LINK = _together(
    click.option(
        "--mode",
        type=click.Choice(list(MODES), case_sensitive=False),
        default="normal",
        show_default=True,
        help="RF mode: its rate, and whether it has a downlink.",
    ),
    click.option(
        "--rate",
        "rate_hz",
        type=click.FloatRange(0, HIGHEST_RATE_HZ, min_open=True),
        help="Frames a second, up to 500; default: as the RF mode, or the recording.",
    ),
    click.option("--12-bit", "twelve_bit", is_flag=True, help="Frames 0x30-0x33, not 0x10-0x13."),
    click.option(
        "--channels",
        type=click.Choice(["12", "16"]),
        default="12",
        show_default=True,
        help="Of the receiver: one with 12 never sends channels 13-16.",
    ),
    click.option("--lq", type=RampType(0, 100), default="100", help="Link quality in %."),
    click.option("--rssi", type=RampType(-255, 0), default="-60", help="RSSI in dBm."),
    click.option(
        "--power", type=click.IntRange(-128, 127), default=20, help="Of the radio, in dBm."
    ),
    click.option(
        "--request-telemetry", is_flag=True, help="Set the bit that asks for it in any RF mode."
    ),
)
_STICKS = _together(
    click.option(
        "--pattern",
        type=click.Choice(list(PATTERNS)),
        default="centre",
        show_default=True,
        help="What the sticks do; centre: throttle low.",
    ),
    click.option(
        "--period", type=_SECONDS, default=4.0, show_default=True, help="Of the pattern, in s."
    ),
    click.option("--joystick", metavar="NUMBER|PATH", help="0 is the first one; see above."),
    click.option("--axes", type=AxesType(), default=None, help="Which axis is channel 1, 2, ..."),
    click.option("--keyboard", is_flag=True, help="Keys are the sticks; see above."),
    click.option("--file", type=_FILE, help="Sticks from CSV or JSON lines; see above."),
    click.option("--capture", type=_FILE, help="The receiver's frames of a recording."),
    click.option("--loop", is_flag=True, help="Begin a file or recording again at its end."),
    click.option(
        "--set", "held", type=HeldType(), multiple=True, help="Hold a channel, whatever moves."
    ),
)
_FAULTS = _together(
    click.option(
        "--lose", type=LossType(), multiple=True, help="Lose the link: 5:2 at 5 s for 2 s."
    ),
    click.option("--drop", type=_PERCENT, default=0.0, help="Slots left empty, in %."),
    click.option("--bad-crc", type=_PERCENT, default=0.0, help="Frames with a wrong CRC, in %."),
    click.option(
        "--noise", type=_PERCENT, default=0.0, help="Slots that begin with 1-8 random bytes, in %."
    ),
    click.option("--seed", type=int, default=0, help="Of everything random."),
)
_OTHERS = _together(
    click.option(
        "--msp", type=MspType(), multiple=True, help="Ask an MSP command, such as api_version."
    ),
    click.option("--vtx", type=VtxType(), help="Send video settings once a second."),
    click.option(
        "--vtx-to",
        type=click.Choice(["radio", "goggles"]),
        default="radio",
        show_default=True,
        help="Address of the video settings: 0x80, or 0x83.",
    ),
    click.option("--duration", type=_SECONDS, help="How long, in s; default: until Ctrl-C."),
    click.option(
        "--json", "as_json", is_flag=True, help="Telemetry and figures, an object a line."
    ),
    click.option("--log", "log_path", type=_FILE, help="New file for what is on the wire."),
    click.option(
        "--baud",
        type=click.IntRange(min=1),
        default=BAUD_RATE,
        show_default=True,
        help="Baud rate.",
    ),
)

all_of_them = _together(_LINK, _STICKS, _FAULTS, _OTHERS)


def check(ctx: click.Context, values: dict[str, Any]) -> None:
    """Raise a `click.UsageError` for options that do not go together."""
    given = {
        name for name in values if ctx.get_parameter_source(name) is not ParameterSource.DEFAULT
    }
    sources = [f"--{name}" for name in _SOURCES if name in given]
    if len(sources) > 1:
        raise click.UsageError(f"{' and '.join(sources)}: choose one")
    names = {param.name: param.opts[0] for param in ctx.command.params}
    if "capture" in given:
        for name in _NOT_WITH_CAPTURE:
            if name in given:
                raise click.UsageError(f"{names[name]}: a recording has its own")
    if values["loop"] and not given & {"file", "capture"}:
        raise click.UsageError("--loop: only with --file or --capture")
    if values["axes"] and "joystick" not in given:
        raise click.UsageError("--axes: only with --joystick")
