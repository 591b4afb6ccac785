"""The commands of `ghst config` that write a file, here or on a board: set, push, pull, wizard."""

from __future__ import annotations

import json
from pathlib import Path

import click

from ghst_tools import boards
from ghst_tools.configuration import keys, known_files, transfer
from ghst_tools.configuration.on_board import FILE, open_configuration, port_or_found
from ghst_tools.configuration.reading import ON_BOARD, PORT
from ghst_tools.configuration.validator import check, parse
from ghst_tools.errors import GhstError
from ghst_tools.files import explained, need_folder, write_file

_FORCE = click.option(
    "--force", is_flag=True, help="Even over a file not seen before, and while the link is up."
)
_RESTART = click.option(
    "--restart/--no-restart",
    "restart",
    default=None,
    help="Restart the board, for it to be in force; default: ask, on a terminal.",
)


@click.command("set", context_settings={"ignore_unknown_options": True})
@click.argument("key")
@click.argument("value")
@PORT
@_FORCE
@_RESTART
def set_(key: str, value: str, port: str | None, force: bool, restart: bool | None) -> None:
    """Change the value of KEY in the file of a board, and nothing else.

    VALUE is JSON; what is none is taken as a text.
    """
    port = port_or_found(port)
    with open_configuration(port) as board:
        state, content = board.read()
        definition = boards.load(state.board)
        keys.check_known(key, definition)
        try:
            tree = {} if content is None else parse(content)
        except ValueError as error:
            raise GhstError(f"{ON_BOARD}: {error}: pull it, mend it, push it") from error
        changed = keys.with_value(tree, key, keys.parse_value(value))
        _, problems = check(changed, definition)
        if problems:
            raise GhstError("not changed: " + "\n".join(text for _, text in problems))
        text = json.dumps(changed, indent=4, ensure_ascii=False).encode() + b"\n"
        if json.dumps(changed) == json.dumps(tree):
            click.echo(f"{key} is {value} already")
            return
        transfer.replace(board, state, text, ON_BOARD, force=force, report=click.echo)
        restarts = transfer.wants_restart(restart, state)
        if restarts:
            board.restart(force)
    if restarts:
        transfer.greet(port, click.echo)


@click.command("push")
@click.argument("file")
@PORT
@_FORCE
@_RESTART
def push(file: str, port: str | None, force: bool, restart: bool | None) -> None:
    """Make FILE (- for standard input) the configuration of a board."""
    _push(file, port, force, restart)


def _push(file: str, port: str | None, force: bool, restart: bool | None) -> None:
    content = transfer.read_file(file)
    port = port_or_found(port)
    with open_configuration(port) as board:
        state, old = board.read()
        transfer.require(content, file, state)
        if old == content:
            known_files.remember(state.id, file, state.hash)
            click.echo(f"{port}: has it already")
            if not restart:
                return
        else:
            if not force:
                transfer.refuse_unseen(board, state, file)
            if old is not None and state.hash is not None:
                kept = known_files.keep(state.id, state.hash, old)
                click.echo(f"what was on the board is kept as {kept}")
            transfer.replace(board, state, content, file, force=force, report=click.echo)
        restarts = transfer.wants_restart(restart, state)
        if restarts:
            board.restart(force)
    if restarts:
        transfer.greet(port, click.echo)


@click.command("pull")
@click.argument("file", type=click.Path(path_type=Path), default="ghst.json")
@PORT
@click.option("--force", is_flag=True, help="Replace FILE if it is there.")
def pull(file: Path, port: str | None, force: bool) -> None:
    """Write the file of a board to FILE (default: ghst.json), byte for byte."""
    need_folder(file)
    with open_configuration(port_or_found(port)) as board:
        state, content = board.read()
    if content is None:
        raise GhstError(
            f"no {FILE} on the board: all is as the board has it ('ghst config defaults')"
        )
    with explained(file):
        same = file.exists() and file.read_bytes() == content
        if not same and file.exists() and not force:
            raise GhstError(f"{file} is there and differs: say another name, or --force")
        if not same:
            write_file(file, content)
    known_files.remember(state.id, str(file), state.hash)
    click.echo(f"{file}: {len(content)} bytes")


@click.command("wizard")
@click.argument("file", type=click.Path(path_type=Path), default="ghst.json")
@click.option("--board", "name", help="The board; default: that at --port, or it is asked for.")
@click.option("--port", help="Serial port of a board that gets the file, or socket://HOST:PORT.")
def wizard(file: Path, name: str | None, port: str | None) -> None:
    """Ask step by step what a model needs, and write FILE (default: ghst.json).

    No board is needed. A file that is there is replaced only if you say so.
    """
    from ghst_tools.configuration.wizard import Wizard

    need_folder(file)
    if file.exists() and not click.confirm(f"{file} is there: replace it?", default=False):
        raise GhstError(f"{file} is left as it is: say another name")
    if name is None and port is not None:
        with open_configuration(port) as board:
            name = board.state().board
    if name is None:
        choice = click.Choice(boards.names())
        name = click.prompt("Which board?", type=choice, default=boards.DEFAULT_BOARD)
    text = Wizard(boards.load(name)).run()
    click.echo(f"\n{text}")
    if not click.confirm(f"Write this to {file}?", default=True):
        raise GhstError("nothing was written")
    with explained(file):
        write_file(file, text.encode())
    if port is not None or click.confirm("Push it to a board on USB now?", default=False):
        _push(str(file), port, force=False, restart=None)
    else:
        click.echo(f"{file}: written; 'ghst config push {file}' gives it to a board")
