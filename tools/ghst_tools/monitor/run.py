"""The command `ghst monitor`."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import click

from ghst_tools.doctor.ports import only_board
from ghst_tools.errors import GhstError
from ghst_tools.monitor.csv_log import CsvLog
from ghst_tools.monitor.feed import Feed

_POLL_S = 0.2


def monitor(
    port: str | None,
    interval_ms: int,
    as_json: bool,
    log_path: Path | None,
    seconds: float | None,
) -> None:
    """Show or print what a board says, until `seconds` are over or the user ends it."""
    if not as_json and not sys.stdout.isatty():
        raise GhstError("the view needs a terminal: use --json for scripts")
    port = port or only_board()
    log = CsvLog(log_path) if log_path else None
    try:
        with Feed(port, interval_ms) as feed:
            if as_json:
                _print(feed, log, seconds)
            else:
                _show(feed, log)
    finally:
        if log:
            log.close()


def _print(feed: Feed, log: CsvLog | None, seconds: float | None) -> None:
    end_s = None if seconds is None else time.monotonic() + seconds
    while end_s is None or time.monotonic() < end_s:
        item = feed.take(_POLL_S)
        if isinstance(item, GhstError):
            raise item
        if isinstance(item, dict) and item["ghst"] == "status":
            if log:
                log.add(item)
            sys.stdout.write(json.dumps(item) + "\n")
            sys.stdout.flush()


def _show(feed: Feed, log: CsvLog | None) -> None:
    from ghst_tools.monitor.screen import Monitor  # textual takes its time to load

    screen = Monitor(feed, log)
    try:
        screen.run()
    finally:
        if screen.log_file:
            screen.log_file.close()
    if screen.error:
        raise screen.error


@click.command()
@click.option("--port", help="Serial port, or socket://HOST:PORT; default: the board on USB.")
@click.option(
    "--interval",
    "interval_ms",
    type=click.IntRange(50, 60_000),
    default=200,
    show_default=True,
    help="Milliseconds between two states.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one object a line, for scripts.")
@click.option(
    "--log",
    "log_path",
    type=click.Path(path_type=Path, dir_okay=False),
    help="New CSV file for every state.",
)
@click.option(
    "--seconds",
    type=click.FloatRange(min=0, min_open=True),
    help="With --json: how long; default: until Ctrl-C.",
)
def command(
    port: str | None,
    interval_ms: int,
    as_json: bool,
    log_path: Path | None,
    seconds: float | None,
) -> None:
    """Watch a running board over USB: channels, outputs, link, telemetry, sensors.

    The board flies on: it is sent no Ctrl-C and is not reset. Its console command `status` says
    the state again and again, which costs less than 2 % of its time, and is ended at the end.

    \b
    Keys:
      p      hold the values on the screen
      l      write what comes to a new CSV file in this folder; again: end it
      c      send a command to the board's console, such as help
      Enter  have the board say its state in words
      q      end

    If the board is unplugged, the monitor ends and says so. A board that restarts by itself while
    the port stays open is asked again.
    """
    monitor(port, interval_ms, as_json, log_path, seconds)
