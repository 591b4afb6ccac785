"""The command `ghst sniff`."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path

import click
from rich.console import Console

from ghst.protocol import BAUD_RATE  # type: ignore[import-not-found]
from ghst_tools.serial_port import open_wire
from ghst_tools.sniff.listen import blocks
from ghst_tools.sniff.log_file import LogFile
from ghst_tools.sniff.state import State
from ghst_tools.sniff.view import LiveView


def sniff(port: str | None, baud: int, log_path: Path | None, seconds: float | None) -> None:
    """Listen until `seconds` are over, or Ctrl-C; show what comes, and at the end the counts.

    In a terminal there is a live view, elsewhere a line for each frame.
    """
    console = Console(highlight=False)
    state = State(baud)
    log_file = LogFile(log_path)
    with (
        contextlib.closing(open_wire(port, baud)) as line,
        log_file.open(line.port, baud),
        contextlib.ExitStack() as stack,
    ):
        # Also when the port vanishes: then before the error is told.
        stack.callback(_summarise, state, log_file)
        view = None
        if console.is_terminal:
            kept = f", log {log_path}" if log_path else ""
            view = stack.enter_context(
                LiveView(console, f"ghst sniff {line.port}, {baud} baud{kept}")
            )
        with contextlib.suppress(KeyboardInterrupt):
            for time_s, block in blocks(line, log_file, seconds):
                _print(state.add(block, time_s), view)
                if view:
                    view.show(state)
        _print(state.finish(), view)


def _print(lines: list[str], view: LiveView | None) -> None:
    if lines and view is None:
        sys.stdout.write("\n".join([*lines, ""]))
        sys.stdout.flush()


def _summarise(state: State, log_file: LogFile) -> None:
    click.echo()
    for line in state.stream.lines():
        click.echo(line)
    if log_file.path:
        click.echo(f"log: {log_file.path}")


@click.command()
@click.option("--port", help="Serial port of the adapter; without it the ports are listed.")
@click.option(
    "--log",
    "log_path",
    type=click.Path(path_type=Path, dir_okay=False),
    help="New file for everything that is read, with times: for decode, plot, replay, vcd.",
)
@click.option(
    "--seconds",
    type=click.FloatRange(min=0, min_open=True),
    help="How long to listen; default: until Ctrl-C.",
)
@click.option(
    "--baud", type=click.IntRange(min=1), default=BAUD_RATE, show_default=True, help="Baud rate."
)
def command(port: str | None, log_path: Path | None, seconds: float | None, baud: int) -> None:
    """Listen on the wire between a Ghost receiver and a flight controller.

    Connect the RX of a USB-serial adapter (3.3 V, never RS-232) to the wire and its GND to theirs;
    leave its TX unconnected. Nothing is sent.

    A time is the moment at which the operating system handed bytes over, not when they were on the
    wire. USB adapters gather bytes for 1 ms, those of FTDI for up to 16 ms where that cannot be
    switched off. Bytes that came in one read have no measured distance, and are counted so. To
    measure the telemetry slot to the microsecond use a logic analyser and tools/sigrok.
    """
    sniff(port, baud, log_path, seconds)
