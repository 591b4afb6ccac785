"""The command `ghst docs-tools`."""

from __future__ import annotations

import shutil
import tempfile
from contextlib import AbstractContextManager
from pathlib import Path

import click

from ghst_tools import boards
from ghst_tools.errors import GhstError
from ghst_tools.files import write_file
from ghst_tools.tool_docs import examples, ports

DOCUMENT = "docs/tools.md"
RECORDING = "docs/examples/wire.log"
MONITOR_PICTURE = "docs/img/tools_monitor.svg"
STATUS = "docs/examples/status.jsonl"
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
        with _adapters(folder):
            text = examples.render(document, shell.run)
        if pictures is not None:
            write_file(pictures, (folder / _PICTURE).read_bytes())
            # textual takes its time to load.
            from ghst_tools.tool_docs.monitor_picture import draw

            with tempfile.TemporaryDirectory() as name, _adapters(Path(name)):
                picture = draw(Path(name), "ttyACM0")
            write_file(boards.checkout() / MONITOR_PICTURE, picture.encode())
    return text


def _adapters(folder: Path) -> AbstractContextManager[None]:
    root = boards.checkout()
    return ports.adapters(folder, root / RECORDING, root / STATUS)


@click.command()
@click.option(
    "--record",
    is_flag=True,
    help=f"Make {RECORDING} and {STATUS} anew on the emulated board first.",
)
def command(record: bool) -> None:
    """Run the examples of docs/tools.md and write what they print into it."""
    root = boards.checkout()
    if shutil.which("sigrok-cli") is None:
        raise GhstError("an example runs sigrok-cli: install it first (Debian: sigrok-cli)")
    if record:
        # The emulator takes its time to load, and this more than a minute.
        from ghst_tools.tool_docs.record import record as record_wire

        record_wire(root / RECORDING, root / STATUS)
    path = root / DOCUMENT
    text = render(path.read_text(encoding="utf-8"), root / _SHOWN, with_board=True)
    write_file(path, text.encode())
    click.echo(path)
