"""The command `ghst bench`."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import click
from rich.console import Console

from ghst_tools import boards, micropython_image
from ghst_tools.bench import (
    control_path,
    decode,
    document,
    goals,
    heap,
    host,
    kinds,
    languages,
    memory,
    modules,
    outputs,
    parts,
    plots,
    ram_ways,
    share,
    variants,
)
from ghst_tools.bench.figures import FULL, QUICK, Effort, Findings, Table
from ghst_tools.bench.rig import Rig
from ghst_tools.errors import GhstError
from ghst_tools.files import write_file

FIGURES = "docs/figures.md"
PLOTS = "img"
"""The folder with the plots, beside the figures."""


def measurements(
    image: Path, effort: Effort, findings: Findings
) -> Iterator[tuple[str, Callable[[], tuple[Table, ...]]]]:
    """What is to be measured, in its order, and how to do it."""
    rig = Rig(image)
    yield "from the wire to the registers", partial(control_path.latency, rig, effort, findings)
    yield "cycles of the interrupts", partial(share.cycles, rig)
    yield "parts of the interrupt", partial(parts.parts, rig)
    if effort.variant_frames:
        yield "other ways", partial(variants.variants, rig, effort, findings)
    yield "four languages", partial(languages.languages, rig)
    yield "share of the CPU", partial(share.share, rig, effort, findings)
    yield "plain and shaped outputs", partial(kinds.kinds, rig, effort, findings)
    if effort.variant_frames:
        yield "other ways for shaped outputs", partial(kinds.ways, rig, effort)
    yield "pulses at the pins", partial(outputs.pulses, rig, effort, findings)
    yield "failsafe", partial(control_path.failsafe, rig, effort)
    yield "power-on to pulses", partial(outputs.boot, rig, effort)
    yield "RAM", partial(memory.ram, rig)
    yield "heap", partial(heap.heap, rig, effort, findings)
    yield "RAM of the modules", partial(modules.modules, rig, effort, findings)
    if effort.frozen:
        yield "ways to keep less in RAM", partial(ram_ways.ram_ways, rig, findings)
    yield "files", partial(memory.flash, rig)
    yield "the library on the host", partial(host.speed, effort)
    yield "decoding recordings on the host", partial(decode.speed, effort)


def bench(image: Path, effort: Effort, command_line: str, out: Path) -> None:
    """Measure everything, show it, and write it to `out`.

    Raises GhstError if a goal is missed that is not known to be.
    """
    console = Console(highlight=False)
    started, worked = time.monotonic(), _cpu_s()
    origin = document.origin(micropython_image.version_of(image), command_line)
    measured: list[Table] = []
    findings = Findings()
    for name, step in measurements(image, effort, findings):
        with console.status(f"measuring: {name}"):
            try:
                found = step()
            except TimeoutError as error:
                raise GhstError(f"{name}: the emulated board does not answer: {error}") from error
        for table in found:
            document.show(console, table)
        measured += found
    reached = goals.goals(findings)
    seconds = time.monotonic() - started
    publish([*goals.tables(reached), *measured], findings, origin, seconds, out)
    console.print(
        f"\n{out} written after {seconds:.0f} s, {_cpu_s() - worked:.0f} s of them at work",
        soft_wrap=True,
    )
    check(reached)


def publish(
    tables: Sequence[Table],
    findings: Findings,
    origin: document.Origin,
    seconds: float,
    out: Path,
) -> None:
    """Show the goals, which come first, and write the figures and the plots."""
    console = Console(highlight=False)
    for table in tables:
        if table.title in goals.TITLES:
            document.show(console, table)
    for line in document.NOT_MODELLED:
        console.print(f"- {line}", style="dim")
    plots.write(findings, out.parent / PLOTS, document.note(origin))
    text = document.markdown(tables, origin, seconds)
    write_file(out, (text + document.plots(plots.PLOTS, PLOTS)).encode())


def check(reached: Sequence[goals.Goal]) -> None:
    """Raise GhstError if a goal is missed that is not known to be."""
    failed = [f"{goal.name}: {goal.reached}" for goal in reached if goal.failed]
    if failed:
        raise GhstError(f"goals are missed: {'; '.join(failed)}")


def _cpu_s() -> float:
    """CPU time of this process and of those that it has waited for, in seconds."""
    return sum(os.times()[:4])


@click.command()
@click.option("--quick", is_flag=True, help="A few of each: to see that it works.")
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    help=f"Where to write the figures; default: {FIGURES} in the checkout. Plots go into "
    f"{PLOTS}/ beside it.",
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
