"""The command `ghst simulate`."""

from __future__ import annotations

import contextlib
import sys
from typing import Any

import click
from rich.console import Console

from ghst import encode  # type: ignore[import-not-found]
from ghst.protocol import (  # type: ignore[import-not-found]
    ADDRESS_GOGGLES,
    ADDRESS_RADIO,
    FRAME_SIZE,
)
from ghst_tools import replay
from ghst_tools.errors import GhstError
from ghst_tools.frames.formats import Source
from ghst_tools.frames.recording import load
from ghst_tools.serial_port import is_network, open_wire
from ghst_tools.simulate import engine, keyboard, msp_client, options
from ghst_tools.simulate.faults import Faults, Loss, Ramp
from ghst_tools.simulate.joystick import open_joystick
from ghst_tools.simulate.keys import Keys
from ghst_tools.simulate.output import Lines, Objects, Output
from ghst_tools.simulate.session import Session
from ghst_tools.simulate.stick_file import StickFile
from ghst_tools.simulate.sticks import Held, Pattern, Sticks
from ghst_tools.simulate.uplink import (
    CaptureUplink,
    Link,
    StickUplink,
    Uplink,
)
from ghst_tools.simulate.value_types import MODES
from ghst_tools.simulate.view import LiveView
from ghst_tools.simulate.wire_log import WireLog
from ghst_tools.sniff.log_file import LogFile

# How long an answer may take: an emulated board is slow.
_MSP_S, _MSP_NETWORK_S = 1.0, 20.0


@click.command()
@click.option("--port", help="Serial port of the adapter; without it the ports are listed.")
@options.all_of_them
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
    options.check(ctx, values)
    simulate(port, **values)


def simulate(port: str | None, **values: Any) -> None:
    """Run the command with the values of its options."""
    baud: int = values["baud"]
    controls = engine.Controls()
    if values["joystick"] is not None:
        controls.joystick = open_joystick(values["joystick"], values["axes"])
    if values["keyboard"]:
        controls.keyboard = keyboard.Keyboard()
    uplink, link = _uplink(controls, values)
    _check_rate(uplink, baud)
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
            if uplink.length_s is not None:
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


def _check_rate(uplink: Uplink, baud: int) -> None:
    """Raise a `GhstError` if the wire is too slow."""
    highest_hz = baud / (10 * FRAME_SIZE)
    if uplink.rate_hz > highest_hz:
        raise GhstError(
            f"{uplink.rate_hz:.0f} frames a second do not fit in {baud} baud: at most "
            f"{highest_hz:.0f} do"
        )


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
