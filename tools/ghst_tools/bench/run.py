"""The command `ghst bench`."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import click
from rich.console import Console

from ghst_tools import boards, micropython_image
from ghst_tools.bench import (
    control_path,
    decode,
    document,
    host,
    interrupts,
    memory,
    outputs,
)
from ghst_tools.bench.figures import FULL, QUICK, Effort, Table
from ghst_tools.bench.rig import Rig
from ghst_tools.errors import GhstError
from ghst_tools.files import write_file

FIGURES = "docs/figures.md"


def measurements(
    image: Path, effort: Effort
) -> Iterator[tuple[str, Callable[[], tuple[Table, ...]]]]:
    """What is to be measured, in its order, and how to do it."""
    rig = Rig(image)
    yield "from the wire to the registers", partial(control_path.latency, rig, effort)
    yield "cycles of the interrupts", partial(interrupts.cycles, rig)
    yield "share of the CPU", partial(interrupts.share, rig, effort)
    yield "pulses at the pins", partial(outputs.pulses, rig, effort)
    yield "failsafe", partial(control_path.failsafe, rig, effort)
    yield "power-on to pulses", partial(outputs.boot, rig)
    yield "RAM", partial(memory.ram, rig, effort)
    yield "files", partial(memory.flash, rig)
    yield "the library on the host", partial(host.speed, effort)
    yield "decoding recordings on the host", partial(decode.speed, effort)


def bench(image: Path, effort: Effort, command_line: str, out: Path) -> None:
    """Measure everything, show it, and write it to `out`."""
    console = Console(highlight=False)
    started = time.monotonic()
    tables: list[Table] = []
    for name, step in measurements(image, effort):
        with console.status(f"measuring: {name}"):
            try:
                found = step()
            except TimeoutError as error:
                raise GhstError(f"{name}: the emulated board does not answer: {error}") from error
        for table in found:
            document.show(console, table)
        tables += found
    taking_part = document.versions(micropython_image.version_of(image))
    for line in document.NOT_MODELLED:
        console.print(f"- {line}", style="dim")
    text = document.markdown(tables, taking_part, command_line)
    write_file(out, text.encode())
    console.print(f"\n{out} written after {time.monotonic() - started:.0f} s", soft_wrap=True)


@click.command()
@click.option("--quick", is_flag=True, help="A few of each: to see that it works.")
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    help=f"Where to write the figures; default: {FIGURES} in the checkout.",
)
@click.option(
    "--image",
    type=click.Path(path_type=Path, dir_okay=False),
    help="MicroPython image (UF2); default: what `ghst micropython` names.",
)
def command(quick: bool, out: Path | None, image: Path | None) -> None:
    """Measure the firmware on the emulated chip and write docs/figures.md."""
    if quick and out is None:
        raise click.UsageError(f"--quick is too little for {FIGURES}: name a file with --out")
    effort, command_line = (QUICK, "ghst bench --quick") if quick else (FULL, "make bench")
    found = micropython_image.find(image)
    bench(found, effort, command_line, out or boards.checkout() / FIGURES)
