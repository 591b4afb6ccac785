"""The command `ghst campaign`."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import click
from rich.console import Console

from ghst_tools import boards, micropython_image
from ghst_tools.campaign import cases, document
from ghst_tools.campaign.areas import AREAS
from ghst_tools.campaign.effort import LONG, SEED, SHORT
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Row, Trial, Wrong
from ghst_tools.errors import GhstError
from ghst_tools.files import write_file
from ghst_tools.revision import firmware_digest

DOCUMENT = "docs/reliability.md"


def attempt(
    area: str, name: str, trial: Trial, setting: Setting, console: Console
) -> tuple[list[Row], bool]:
    """Run a trial; its rows, and whether all was right.

    Whatever it raises, it has failed, and what fails is saved: the case that it names, or else the
    trial itself.
    """
    try:
        return trial(), True
    except Wrong as error:
        wrong = error
    except Exception as error:
        wrong = Wrong(f"{type(error).__name__}: {error}")
    case, remark = cases.to_save(wrong, area, name, setting)
    path = cases.save(case, f"{wrong} ({remark})")
    reason = f"{wrong} (saved as {path.name}; {remark})"
    console.print(f"  {name}: WRONG: {reason}", style="bold red", markup=False)
    return [Row(name, "", f"WRONG: {reason}")], False


def campaign(
    setting: Setting,
    names: list[str],
    command: str,
    console: Console,
    out: Path | None,
) -> int:
    """Run areas and show what happens; how many trials went wrong.

    `out`: the document, which gets the section of each area when that has ended.
    """
    wrong = 0
    for name in names:
        area = AREAS[name]
        rows: list[Row] = []
        began = document.Beginning.now(setting.image, area.unix_port)
        started = time.monotonic()
        console.print(f"{area.title}, seed {setting.seed}", style="bold")
        for trial_name, trial in area.trials(setting):
            with console.status(f"{name}: {trial_name}"):
                found, right = attempt(name, trial_name, trial, setting, console)
            wrong += not right
            rows += found
            for row in found if right else ():
                console.print(f"  {row.fault}: {row.done}: {row.happened}", markup=False)
        for reason in _not_valid(rows, began):
            wrong += 1
            rows.append(Row(area.title, "", f"WRONG: {reason}"))
            console.print(f"  {name}: WRONG: {reason}", style="bold red", markup=False)
        seconds = time.monotonic() - started
        if out is not None:
            line = f"{command} {name}"
            write(out, document.Section(area.title, line, setting.seed, began, seconds, rows))
    return wrong


def _not_valid(rows: list[Row], began: document.Beginning) -> Iterator[str]:
    if not rows:
        yield "there is no trial in it"
    if firmware_digest() != began.firmware:
        yield f"the files of the firmware are no longer those of {began.firmware}"


def read(out: Path) -> str:
    """What is in the document so far."""
    try:
        return out.read_text(encoding="utf-8") if out.exists() else ""
    except (OSError, UnicodeDecodeError) as error:
        raise GhstError(f"{out} cannot be read: {error}") from error


def write(out: Path, section: document.Section) -> None:
    """Put a section into the document at `out`, which keeps its others."""
    order = [area.title for area in AREAS.values()]
    write_file(out, document.update(read(out), order, [section]).encode())


@click.command()
@click.argument("areas", nargs=-1, type=click.Choice(list(AREAS)))
@click.option("--short", is_flag=True, help="A little of each: to see that it works.")
@click.option(
    "--share",
    type=click.FloatRange(0, 1, min_open=True),
    default=1.0,
    help="How much of the long form, such as 0.1; the report says what was done.",
)
@click.option("--seed", default=SEED, show_default=True, help="For everything random.")
@click.option(
    "--minutes",
    type=click.FloatRange(min=0, min_open=True),
    help="Emulated time of the long flight; default: 60.",
)
@click.option(
    "--board-files",
    type=click.IntRange(min=1),
    help="How many broken files of each kind the emulated board reads; default: 10000.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    help=f"The document to write; default: {DOCUMENT} in the checkout, none with --short.",
)
@click.option(
    "--image",
    type=click.Path(path_type=Path, dir_okay=False),
    help="MicroPython image (UF2); default: what `ghst micropython` names.",
)
def command(
    areas: tuple[str, ...],
    short: bool,
    share: float,
    seed: int,
    minutes: float | None,
    board_files: int | None,
    out: Path | None,
    image: Path | None,
) -> None:
    """Attack the firmware on purpose, all of it or AREAS, and write docs/reliability.md.

    The long form takes hours. What goes wrong is saved as a case in host_tests/campaign/cases,
    which the tests replay.
    """
    if short and share != 1.0:
        raise click.UsageError("--share is of the long form: leave --short out")
    effort = SHORT if short else LONG
    line = "ghst campaign" + (" --short" if short else "")
    if share != 1.0:
        effort = effort.share(share)
        line += f" --share {share:g}"
    if minutes is not None:
        effort = replace(effort, flight_s=max(1, round(60 * minutes)))
        line += f" --minutes {minutes:g}"
    if board_files is not None:
        effort = replace(effort, board_files=board_files)
        line += f" --board-files {board_files}"
    setting = Setting(micropython_image.find(image), effort, seed)
    names = list(areas) or list(AREAS)
    if out is None and not short:
        out = boards.checkout() / DOCUMENT
    if out is not None:
        # Not only when the first area has ended.
        read(out)
    wrong = campaign(setting, names, line, Console(highlight=False, soft_wrap=True), out)
    if out is not None:
        click.echo(f"{out} written")
    if wrong:
        raise GhstError(f"{wrong} trials went wrong")
