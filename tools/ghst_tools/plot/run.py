"""The command `ghst plot`."""

from __future__ import annotations

from pathlib import Path

import click

from ghst_tools.errors import GhstError
from ghst_tools.files import check_output, explained
from ghst_tools.frames.formats import FORMATS, Source
from ghst_tools.frames.recording import load

_SUFFIXES = (".svg", ".png")


@click.command()
@click.argument("file", type=click.Path(path_type=Path, allow_dash=True))
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    help="Picture to write: .svg or .png.",
)
@click.option("--format", "format_", type=click.Choice(list(FORMATS)), help="As of ghst decode.")
def command(file: Path, output: Path, format_: str | None) -> None:
    """Draw a recording: channels, link quality, RSSI, and the rhythm of the frames.

    The two histograms show the time between control frames, and from the end of a control frame to
    the beginning of the telemetry behind it. They need the times of a log, and count only what did
    not come in one read.
    """
    if output.suffix.lower() not in _SUFFIXES:
        raise GhstError(f"{output}: say .svg or .png for the kind of picture")
    check_output(output, file)
    recording = load(Source(file, format_))
    # matplotlib takes half a second to load: an error before does not wait for it.
    from ghst_tools.plot import draw

    with explained(output):
        draw.write(recording, output)
    click.echo(output)
