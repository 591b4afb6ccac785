"""The command `ghst simulate`."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource
from rich.console import Console

from ghst import encode  # type: ignore[import-not-found]
from ghst.protocol import (  # type: ignore[import-not-found]
    ADDRESS_GOGGLES,
    ADDRESS_RADIO,
    BAUD_RATE,
)
from ghst_tools import replay
from ghst_tools.errors import GhstError
from ghst_tools.frames.formats import Source
from ghst_tools.frames.recording import load
from ghst_tools.serial_port import is_network, open_wire
from ghst_tools.simulate import engine, keyboard, msp_client
from ghst_tools.simulate.faults import Faults, Loss, Ramp
from ghst_tools.simulate.joystick import open_joystick
from ghst_tools.simulate.keys import Keys
from ghst_tools.simulate.options import (
    MODES,
    AxesType,
    HeldType,
    LossType,
    MspType,
    RampType,
    VtxType,
)
from ghst_tools.simulate.output import Lines, Objects, Output
from ghst_tools.simulate.session import Session
from ghst_tools.simulate.stick_file import StickFile
from ghst_tools.simulate.sticks import PATTERNS, Held, Pattern, Sticks
from ghst_tools.simulate.uplink import (
    HIGHEST_RATE_HZ,
    CaptureUplink,
    Link,
    StickUplink,
    Uplink,
)
from ghst_tools.simulate.view import LiveView
from ghst_tools.simulate.wire_log import WireLog
from ghst_tools.sniff.log_file import LogFile

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
# How long an answer may take: an emulated board is slow.
_MSP_S, _MSP_NETWORK_S = 1.0, 20.0
_PERCENT = click.FloatRange(0, 100)
_SECONDS = click.FloatRange(min=0, min_open=True)
_FILE = click.Path(path_type=Path, dir_okay=False)


def _options(*groups: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def add(function: Any) -> Any:
        for option in reversed(groups):
            function = option(function)
        return function

    return add


_link_options = _options(
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
_stick_options = _options(
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
_fault_options = _options(
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
_other_options = _options(
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


@click.command()
@click.option("--port", help="Serial port of the adapter; without it the ports are listed.")
@_link_options
@_stick_options
@_fault_options
@_other_options
@click.pass_context
def command(ctx: click.Context, port: str | None, **values: Any) -> None:
    """Be a Ghost receiver, on a USB-serial adapter.

    What listens there obeys: servos move. Take the propellers off.

    \b
    Wiring, 3.3 V only:
      adapter TX -- 1 kOhm --+-- wire of the flight controller
      adapter RX ------------+
      adapter GND -------------- GND
    The resistor lets the flight controller pull the wire low while TX idles high. For leads
    longer than a hand add 10 kOhm from the wire to 3.3 V. The adapter has to know 420000 baud.

    What is sent comes back on RX. This echo is taken out; where it comes back broken something
    else drove the wire, which is counted as a collision. Without an echo it works, too.

    The slot is the time from the end of a frame to the telemetry behind it, as far as the
    operating system tells: a USB adapter gathers bytes for 1 ms, those of FTDI for up to 16 ms
    where that cannot be switched off. What came in one read is not measured.

    --joystick 0 is /dev/input/js0 on Linux, without any package; a radio in its USB joystick mode
    is one. On macOS and Windows it needs pygame: pip install 'micropython-ghst[joystick]'.
    --axes 1,2,-3,4 puts axes on channels 1 to 4, the third reversed; buttons come behind the axes.

    --keyboard: arrows move channels 1 and 2, w and s the throttle (3), a and d channel 4, by
    25 us; 5 to 8 switch that channel; space centres the sticks, x closes the throttle; l loses
    the link and brings it back; q ends.

    --file: CSV with a header t,ch1,ch2,... or without one, or JSON lines as `ghst decode --json`
    prints them; seconds, and microseconds that are held until the next line.

    --lq and --rssi take a value, or FROM:TO:SECONDS.

    With --msp it is an error if no answer comes.

    --port socket://HOST:PORT is the wire of `ghst emulate --wire-port`. That board is slower than
    real time: a frame waits for the echo of the one before, and no slot is measured.
    """
    _check(ctx, values)
    simulate(port, **values)


def _check(ctx: click.Context, values: dict[str, Any]) -> None:
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


def simulate(port: str | None, **values: Any) -> None:
    """Run the command with the values of its options."""
    baud: int = values["baud"]
    controls = engine.Controls()
    if values["joystick"] is not None:
        controls.joystick = open_joystick(values["joystick"], values["axes"])
    if values["keyboard"]:
        controls.keyboard = keyboard.Keyboard()
    uplink, link = _uplink(controls, values)
    vtx = None
    if values["vtx"]:
        address = ADDRESS_GOGGLES if values["vtx_to"] == "goggles" else ADDRESS_RADIO
        vtx = bytes(encode.vtx_setup(0, *values["vtx"], address=address))
    log_file = LogFile(values["log_path"])
    console = Console(highlight=False)
    with (
        contextlib.closing(open_wire(port, baud)) as line,
        log_file.open(f"{line.port} of ghst simulate", baud),
        contextlib.ExitStack() as stack,
    ):
        if controls.keyboard:
            controls.keys = stack.enter_context(Keys())
        network = is_network(line.port)
        msp = msp_client.MspClient(values["msp"], _MSP_NETWORK_S if network else _MSP_S)
        title = f"ghst simulate {line.port}, {baud} baud"
        output = _output(console, values["as_json"], title, controls, stack)

        def session(start_s: float) -> Session:
            log = WireLog(log_file, baud) if log_file.path else None
            return Session(uplink, link, baud, msp, vtx, log, start_s, network)

        try:
            engine.run(line, session, controls, output)
        except KeyboardInterrupt:
            if not uplink.endless:
                raise
        finally:
            if log_file.path:
                click.echo(f"log: {log_file.path}", err=values["as_json"])
    if msp.unanswered:
        asked = ", ".join(msp_client.title(command) for command in msp.unanswered)
        raise GhstError(f"no answer to MSP {asked}")


def _uplink(controls: engine.Controls, values: dict[str, Any]) -> tuple[Uplink, Link | None]:
    losses: tuple[Loss, ...] = values["lose"]
    faults = Faults(losses, values["drop"], values["bad_crc"], values["noise"], values["seed"])
    duration_s, loop = values["duration"], values["loop"]
    if values["capture"]:
        recording = load(Source(values["capture"]))
        plan = replay.plan(recording, 1.0, values["rate_hz"], values["baud"])
        return CaptureUplink(plan, faults, loop, duration_s), None
    sticks: Sticks
    if controls.joystick:
        sticks = controls.joystick
    elif controls.keyboard:
        sticks = controls.keyboard
    elif values["file"]:
        sticks = StickFile(values["file"], loop)
    else:
        sticks = Pattern(values["pattern"], values["period"], values["seed"])
    if values["held"]:
        sticks = Held(sticks, dict(values["held"]))
    lq: Ramp = values["lq"]
    link = Link(
        MODES[values["mode"].lower()],
        lq,
        values["rssi"],
        values["power"],
        values["request_telemetry"],
    )
    uplink = StickUplink(
        sticks,
        link,
        faults,
        values["rate_hz"],
        int(values["channels"]),
        values["twelve_bit"],
        duration_s,
    )
    return uplink, link


def _output(
    console: Console,
    as_json: bool,
    title: str,
    controls: engine.Controls,
    stack: contextlib.ExitStack,
) -> Output:
    if console.is_terminal and not as_json:
        help_text = keyboard.HELP if controls.keyboard else ""
        return stack.enter_context(LiveView(console, title, help_text))
    return Objects(_print) if as_json else Lines(_print)


def _print(line: str) -> None:
    sys.stdout.write(line + "\n")
    # Whoever reads this in a pipe waits for it.
    sys.stdout.flush()
