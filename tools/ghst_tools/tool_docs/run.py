"""The command `ghst docs-tools`."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import click

from ghst_tools import boards
from ghst_tools.errors import GhstError
from ghst_tools.files import write_file
from ghst_tools.tool_docs import examples, ports

DOCUMENT = "docs/tools.md"
RECORDING = "docs/examples/wire.log"
_PICTURE = "flight.png"  # what the example of `ghst plot` leaves
_SHOWN = "docs/img/tools_plot.png"


def render(document: str, pictures: Path | None = None, with_board: bool = False) -> str:
    """`document` with what its examples print now; the plot goes to `pictures`.

    `with_board`: those of a board, too, on the emulated one.
    """
    if with_board:
        # The emulator takes its time to load.
        from ghst_tools.tool_docs import board

        with tempfile.TemporaryDirectory() as name, board.emulated(Path(name)) as address:
            runner = board.runner(address, Path(name))
            document = examples.render(document, with_board=runner)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shell = examples.Shell(folder)
        with ports.adapters(folder, boards.checkout() / RECORDING):
            text = examples.render(document, shell.run)
        if pictures is not None:
            write_file(pictures, (folder / _PICTURE).read_bytes())
    return text


@click.command()
@click.option("--record", is_flag=True, help=f"Make {RECORDING} anew on the emulated board first.")
def command(record: bool) -> None:
    """Run the examples of docs/tools.md and write what they print into it."""
    root = boards.checkout()
    if shutil.which("sigrok-cli") is None:
        raise GhstError("an example runs sigrok-cli: install it first (Debian: sigrok-cli)")
    if record:
        # The emulator takes its time to load, and this more than a minute.
        from ghst_tools.tool_docs.record import record as record_wire

        record_wire(root / RECORDING)
    path = root / DOCUMENT
    text = render(path.read_text(encoding="utf-8"), root / _SHOWN, with_board=True)
    write_file(path, text.encode())
    click.echo(path)
