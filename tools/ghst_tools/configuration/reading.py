"""The commands of `ghst config` that read from a board: show, dump, diff, get."""

from __future__ import annotations

import base64
import json
import sys
from typing import Any

import click

from ghst import __version__  # type: ignore[import-not-found]
from ghst_tools import boards
from ghst_tools.configuration import keys, known_files
from ghst_tools.configuration.on_board import (
    FILE,
    State,
    digest,
    open_configuration,
    port_or_found,
)
from ghst_tools.configuration.transfer import read_file
from ghst_tools.configuration.validator import check, check_content, parse
from ghst_tools.errors import GhstError

ON_BOARD = f"{FILE} on the board"

PORT = click.option(
    "--port",
    envvar="GHST_PORT",
    help="Serial port, or socket://HOST:PORT; default: $GHST_PORT, or the board on USB.",
)


@click.command("show")
@PORT
def show(port: str | None) -> None:
    """Show every value in force on a board, with defaults marked."""
    from rich.console import Console

    from ghst_tools.configuration.show import tables

    port = port_or_found(port)
    with open_configuration(port) as board:
        state, content = board.read()
    definition = boards.load(state.board)
    link = f"link {state.link}" if state.link else "the application does not run"
    click.echo(f"{state.board} at {port}, micropython-ghst {state.version}, {link}")
    if state.version != __version__:
        click.echo(f"This program is of {__version__}: what it says of defaults may differ.")
    if content is None:
        click.echo(f"no {FILE}: all is as the board has it")
    else:
        click.echo(f"{FILE}: {len(content)} bytes, hash {state.hash}")
    if state.restart:
        click.echo("The file is newer than what is in force: restart the board.")
    click.echo("In brackets: defaults.\n")
    problems = _problems(state, content)
    values, _ = check({} if content is None or problems else parse(content), definition)
    if problems:
        values = {**values, keys.OUTPUTS: {}}
    console = Console()
    for table in tables(values, definition):
        console.print(table)
        console.print()
    if problems:
        # A board takes more than this program does: JSON with a key twice, for one.
        consequence = "nothing moves, for " if state.problems else ""
        raise GhstError(f"{consequence}the file cannot be used:\n" + "\n".join(problems))


@click.command("dump")
@PORT
@click.option("--commands", is_flag=True, help="As lines for the board's console.")
def dump(port: str | None, commands: bool) -> None:
    """Print the file of a board as it is, to be given to `ghst config push -`.

    With --commands it can be pasted into a terminal that is connected to a board.
    """
    with open_configuration(port_or_found(port)) as board:
        state, content = board.read()
    if content is None:
        click.echo(f"no {FILE} on the board: all is as the board has it", err=True)
        content = b"{}\n"
    if commands:
        for line in _lines(content):
            click.echo(line)
        return
    known_files.remember(state.id, known_files.STANDARD_INPUT, state.hash)
    sys.stdout.buffer.write(content)
    sys.stdout.flush()


@click.command("diff")
@click.argument("file", required=False)
@PORT
def diff(file: str | None, port: str | None) -> None:
    """Show in what a board differs from FILE, or from its defaults; exit status 1 if it does."""
    from rich.console import Console
    from rich.table import Table

    with open_configuration(port_or_found(port)) as board:
        state, content = board.read()
    _refuse_broken(_problems(state, content))
    definition = boards.load(state.board)
    other: Any = {}
    if file is not None:
        text = read_file(file)
        _refuse_broken(check_content(text, file, definition))
        other = parse(text)
    here = dict(keys.flat(check({} if content is None else parse(content), definition)[0]))
    there = dict(keys.flat(check(other, definition)[0]))
    table = Table("key", "on the board", file or "default", box=None, pad_edge=False)
    for key in {**here, **there}:
        if here.get(key, here) != there.get(key, there):
            table.add_row(
                key, *[keys.shown(key, side[key]) if key in side else "" for side in (here, there)]
            )
    if table.row_count:
        Console().print(table)
        sys.exit(1)
    click.echo("no difference")


@click.command("get")
@click.argument("key")
@PORT
def get(key: str, port: str | None) -> None:
    """Print the value of KEY, such as outputs.6.reverse, as JSON."""
    with open_configuration(port_or_found(port)) as board:
        state, content = board.read()
    definition = boards.load(state.board)
    keys.check_known(key, definition)
    _refuse_broken(_problems(state, content))
    values, _ = check({} if content is None else parse(content), definition)
    click.echo(json.dumps(keys.value_at(values, key)))


def _problems(state: State, content: bytes | None) -> list[str]:
    """Why the file on a board cannot be used; with lines, if this program sees it as well."""
    problems = []
    if content is not None:
        problems = check_content(content, ON_BOARD, boards.load(state.board))
    # What the board says of a file that was replaced since is no more of interest.
    return problems or ([] if state.restart else list(state.problems))


def _refuse_broken(problems: list[str]) -> None:
    if problems:
        raise GhstError("the file cannot be used:\n" + "\n".join(problems))


def _lines(content: bytes) -> list[str]:
    """The lines of the console that give a board this file."""
    size = 45
    lines = [f"config begin {len(content)}"]
    for at in range(0, len(content), size):
        lines.append(f"config put {at} {base64.b64encode(content[at : at + size]).decode()}")
    return [*lines, f"config check {digest(content)}", "config save"]
