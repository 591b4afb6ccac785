"""`ghst config`: what needs no board, and the commands of `reading` and `writing`."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import click

from ghst_tools import boards
from ghst_tools.configuration.document import document
from ghst_tools.configuration.reading import diff, dump, get, show
from ghst_tools.configuration.validator import check, check_file
from ghst_tools.configuration.writing import pull, push, set_, wizard
from ghst_tools.files import explained, write_file

DOCUMENT = Path("docs/configuration.md")

_BOARD = click.option("--board", "name", default=boards.DEFAULT_BOARD, show_default=True)


@click.group()
def command() -> None:
    """Check, show and change what a board is told by its ghst.json."""


@command.command("check")
@click.argument("file", type=click.Path(path_type=Path))
@_BOARD
def check_command(file: Path, name: str) -> None:
    """Tell what a board would say to FILE; exit status 1 if it would not take it."""
    problems = check_file(file, boards.load(name))
    for line in problems:
        click.echo(line, err=True)
    if problems:
        sys.exit(1)
    click.echo(f"{file}: {name} takes it")


@command.command("defaults")
@_BOARD
def defaults_command(name: str) -> None:
    """Print every value that a board has without a file, as a file that could be edited."""
    values, _ = check({}, boards.load(name))
    tree = dict(values[""]) | {key: value for key, value in values.items() if key}
    click.echo(json.dumps(tree, indent=4))


@command.command("document")
def document_command() -> None:
    """Write docs/configuration.md."""
    path = boards.checkout() / DOCUMENT
    with explained(path):
        write_file(path, document().encode())
    click.echo(path)


for board_command in (show, dump, diff, get, set_, push, pull, wizard):
    command.add_command(board_command)
