"""Draws wiring and self-test of the boards and writes docs/boards.md: `ghst wiring`."""

from pathlib import Path

import click

from ghst_tools import boards, boards_document, selftest_picture
from ghst_tools.boards import Board
from ghst_tools.errors import GhstError
from ghst_tools.files import explained, write_file
from ghst_tools.selftest_picture import SelftestPicture
from ghst_tools.wiring_picture import WiringPicture

DOCUMENT = "docs/boards.md"


def picture_path(name: str) -> str:
    """Where a board's picture is, below the checkout."""
    return f"docs/img/wiring_{name}.svg"


def pictures(board: Board) -> dict[str, bytes]:
    """The pictures of one board: path below the checkout -> content."""
    made = {picture_path(board.name): WiringPicture(board).draw()}
    if board.selftest_pin is not None:
        made[selftest_picture.picture_path(board.name)] = SelftestPicture(board).draw()
    return made


def documents(root: Path | None = None) -> dict[str, bytes]:
    """Everything that is made of the boards' files: path below the checkout -> content."""
    all_boards = list(boards.load_all(root))
    made: dict[str, bytes] = {}
    for board in all_boards:
        made |= pictures(board)
    made[DOCUMENT] = boards_document.document(all_boards).encode()
    return made


@click.command()
@click.option("--board", help="Draw this board only, and leave the rest alone.")
@click.option("--all", "every", is_flag=True, help="All boards; as without --board.")
@click.option(
    "--tree", type=click.Path(path_type=Path, file_okay=False), help="Checkout to write to."
)
def command(board: str | None, every: bool, tree: Path | None) -> None:
    """Draw wiring and self-test of the boards, write docs/boards.md, from boards/*/board.json."""
    if board and every:
        raise click.UsageError("--board and --all exclude each other")
    root = tree or boards.checkout()
    if not boards.names(root):
        raise GhstError(f"{root}: has no boards/*/board.json: name a checkout with --tree")
    made = pictures(boards.load(board, root)) if board else documents(root)
    for path, content in made.items():
        with explained(root / path):
            write_file(root / path, content)
        click.echo(root / path)
