"""The command `ghst demo`."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import click
from rich.console import Console

from ghst_tools import boards, filesystem, micropython_image
from ghst_tools.demo import flight, screen, unix
from ghst_tools.demo.report import Report
from ghst_tools.errors import GhstError

_SECONDS, _QUICK_SECONDS = 4.0, 0.6
_INTERRUPTED = 130  # what a shell makes of Ctrl-C


def fly_emulated(plan: flight.Flight, image: Path, out: Path, console: Console) -> Report:
    """The demo on the emulated Pico; leaves `demo.vcd` in `out`."""
    # numpy and the emulator load only where they are needed.
    from ghst_tools.demo import findings
    from ghst_tools.demo.emulated import EmulatedFlight

    started = time.monotonic()
    definition = boards.load(boards.DEFAULT_BOARD)
    files = filesystem.write()
    with screen.open_view(console, "micropython-ghst on an emulated Pico", "at the pin") as view:
        flown = EmulatedFlight(plan, image, files, definition, view)
        flown.run()
    report = findings.report(
        flown, micropython_image.version_of(image), time.monotonic() - started
    )
    vcd = out / "demo.vcd"
    flown.recorder.write(vcd)
    report.lines.append(("wire and pins", f"{vcd} (PulseView: Open, Import Value Change Dump)"))
    return report


def fly_unix(plan: flight.Flight, console: Console) -> Report:
    """The demo on MicroPython's unix port: the library alone."""
    program = micropython_image.unix_micropython()
    with screen.open_view(console, "ghst.Receiver on MicroPython's unix port", "decoded") as view:
        return unix.UnixFlight(plan, program, view).run()


def find_image(image: Path | None, console: Console) -> Path | None:
    """The MicroPython image, or None if there is none to be had.

    A file that the user named and that is no image is an error.
    """
    try:
        return micropython_image.find(image)
    except GhstError as error:
        if image or os.environ.get(micropython_image.IMAGE_VARIABLE):
            raise
        console.print(f"{error}", soft_wrap=True, highlight=False)
        return None


def demo(seconds: float, out: Path, image: Path | None, on_unix: bool) -> bool:
    """Fly, show it, leave the plot and the VCD in `out`; returns whether everything was right."""
    console = Console(highlight=False)
    found = None if on_unix else find_image(image, console)
    out.mkdir(parents=True, exist_ok=True)
    plan = flight.plan(seconds)
    if found is None:
        console.print(
            "No emulated board: ghst.Receiver runs on MicroPython's unix port. No pins are "
            "measured.",
            soft_wrap=True,
        )
        report = fly_unix(plan, console)
    else:
        report = fly_emulated(plan, found, out, console)
    # matplotlib takes half a second to load: the flight does not wait for it.
    from ghst_tools.demo import plot

    picture = out / "demo.png"
    plot.write(report, picture)
    report.lines.append(("plot", str(picture)))
    screen.summarise(console, report)
    return not report.failures


@click.command()
@click.option(
    "--seconds",
    type=click.FloatRange(min=_QUICK_SECONDS, max=60),
    default=_SECONDS,
    show_default=True,
    help="Emulated time of flight, without the time when the link is lost.",
)
@click.option("--quick", is_flag=True, help=f"The same as --seconds {_QUICK_SECONDS}.")
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for plot and VCD; default: build/demo in the checkout.",
)
@click.option(
    "--image",
    type=click.Path(path_type=Path, dir_okay=False),
    help="MicroPython image (UF2); default: what `ghst micropython` names.",
)
@click.option("--unix", "on_unix", is_flag=True, help="No board: the library on the unix port.")
def command(
    seconds: float, quick: bool, out: Path | None, image: Path | None, on_unix: bool
) -> None:
    """Watch an emulated Pico with the firmware follow a simulated Ghost receiver.

    Exit status 0: every pulse was right, no frame was lost, failsafe came in time, and the pilot's
    radio showed what the emulated battery, GPS, barometer and compass had.
    """
    out = out or boards.checkout() / "build" / "demo"
    try:
        right = demo(_QUICK_SECONDS if quick else seconds, out, image, on_unix)
    except KeyboardInterrupt:
        click.echo("stopped: nothing was written", err=True)
        sys.exit(_INTERRUPTED)
    except OSError as error:
        raise GhstError(f"{error.filename or out}: {error.strerror}") from error
    sys.exit(0 if right else 1)
