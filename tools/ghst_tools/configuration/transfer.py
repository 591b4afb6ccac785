"""Replacing the file on a board: what is looked at first, and the restart afterwards."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import click

from ghst_tools import boards, hello
from ghst_tools.configuration import known_files
from ghst_tools.configuration.on_board import (
    FILE,
    BoardConfiguration,
    State,
    digest,
    open_configuration,
)
from ghst_tools.configuration.validator import check_content
from ghst_tools.errors import GhstError
from ghst_tools.files import explained

Report = Callable[[str], None]

_LINKED = (
    "the link is up, and writing the flash stops the interrupts that move the outputs and judge "
    "failsafe: switch the transmitter off, or say --force"
)


def require(content: bytes, name: str, state: State) -> None:
    """`GhstError` with a line for each problem that the board `state` is of would have."""
    called = "standard input" if name == known_files.STANDARD_INPUT else name
    problems = check_content(content, called, boards.load(state.board))
    if problems:
        raise GhstError("not sent: the board would not take it\n" + "\n".join(problems))


def replace(
    board: BoardConfiguration,
    state: State,
    content: bytes,
    name: str,
    *,
    force: bool,
    report: Report,
) -> None:
    """Make `content` the file of a board whose state is `state`, and remember that as `name`'s.

    It has to be all right by `require`. `GhstError` while the link is up, unless forced.
    """
    if state.linked and not force:
        raise GhstError(f"{board.port}: {_LINKED}")
    problems = board.send(content, state.hash)
    if problems:
        raise GhstError(
            f"{board.port}: the board refuses it (its firmware is {state.version}): "
            + "; ".join(text for _, text in problems)
        )
    took_ms = board.save(force)
    known_files.remember(state.id, name, digest(content))
    report(f"{board.port}: {len(content)} bytes saved as {FILE}")
    if state.linked:
        report(
            f"the link was up: for parts of {took_ms} ms, and of the time the flash takes, the "
            "outputs held their pulses and failsafe was not judged"
        )


def refuse_unseen(board: BoardConfiguration, state: State, name: str) -> None:
    """`GhstError` if the file on the board is not the one that `name` was made from."""
    if state.hash is None or state.hash == known_files.remembered(state.id, name):
        return
    source = "what was dumped last" if name == known_files.STANDARD_INPUT else name
    raise GhstError(
        f"{board.port}: {FILE} on the board is not the one that {source} was pulled from or "
        f"pushed as: look at it with 'ghst config diff', 'pull' it, or say --force"
    )


def wants_restart(asked: bool | None, state: State) -> bool:
    """Whether the board is to be restarted: as asked, or as whoever sits there answers."""
    if asked is not None:
        return asked
    if not state.linked and sys.stdin.isatty():
        return click.confirm("Restart the board now, for it to be in force?", default=True)
    click.echo("In force after a restart: --restart")
    return False


def greet(port: str, report: Report) -> None:
    """Wait for a board that restarts; `GhstError` if it does not take its configuration."""
    report(hello.wait_for_hello(port, hello.TIMEOUT_S))
    with open_configuration(port) as board:
        problems = board.state().problems
    if problems:
        raise GhstError(f"{port}: nothing moves: {problems[0]}")


def read_file(file: str) -> bytes:
    """The contents of a file, or what comes on standard input."""
    if file == known_files.STANDARD_INPUT:
        return sys.stdin.buffer.read()
    with explained(file):
        return Path(file).read_bytes()
