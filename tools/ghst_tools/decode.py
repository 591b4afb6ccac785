"""The command `ghst decode`."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path

import click

from ghst_tools.frames.finder import Pieces
from ghst_tools.frames.formats import FORMATS, Source
from ghst_tools.frames.json_lines import JsonLines
from ghst_tools.frames.lines import LineWriter
from ghst_tools.frames.stream import Stream
from ghst_tools.frames.text import TextLines
from ghst_tools.frames.timeline import Times


def decode(source: Source, writer: LineWriter) -> list[str]:
    """Print a line for each piece of the recording; returns those of the summary.

    Ctrl-C ends a recording that is followed.
    """
    stream: Stream | None = None
    with contextlib.suppress(KeyboardInterrupt):
        for block in source.blocks():
            stream = stream or Stream(source.baud)
            _print(writer, *stream.feed(block))
    stream = stream or Stream(source.baud)
    _print(writer, *stream.finish())
    return stream.lines()


def _print(writer: LineWriter, pieces: Pieces, times: Times | None) -> None:
    if not len(pieces.starts):
        return
    lines = writer.lines(pieces, None if times is None else times.begins_s.tolist())
    lines.append("")
    sys.stdout.write("\n".join(lines))
    # Whoever follows a recording waits for this.
    sys.stdout.flush()


@click.command()
@click.argument(
    "file", type=click.Path(path_type=Path, allow_dash=True), default="-", metavar="[FILE|-]"
)
@click.option("--json", "as_json", is_flag=True, help="One object a line; the summary on stderr.")
@click.option("--follow", is_flag=True, help="Go on with what is added to the file, until Ctrl-C.")
@click.option(
    "--format",
    "format_",
    type=click.Choice(list(FORMATS)),
    help="What the file holds; default: found out from its first 4096 bytes.",
)
def command(file: Path, as_json: bool, follow: bool, format_: str | None) -> None:
    """Show the frames of a recording, one line each.

    FILE, or standard input, holds bytes of the wire in one of four formats. hex: two digits a
    byte, `0x` and separators allowed, # begins a comment. raw: the bytes themselves. log: what
    `ghst sniff` writes, with times. px4: a capture of PX4's GHST test.

    Without --format the file is a log or a capture if it begins so or has lines of that kind. Any
    other text, valid UTF-8 without control characters, is hex. All else is raw: an address, with
    which every frame begins, is not valid UTF-8.

    Frames are found as the library finds them. A frame whose CRC is wrong is shown as bytes, since
    no receiver uses its values; what lies between frames is shown with its length.
    """
    lines = decode(Source(file, format_, follow), JsonLines() if as_json else TextLines())
    if not as_json:
        click.echo()
    for line in lines:
        click.echo(line, err=as_json)
