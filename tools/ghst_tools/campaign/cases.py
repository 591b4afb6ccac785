"""Cases of the campaign: what once went wrong, saved to a folder, each a test from then on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path

from ghst_tools import boards
from ghst_tools.campaign import (
    application_bytes,
    configuration_files,
    console_bytes,
    library_bytes,
    serial_bytes,
    starts,
    wire_bytes,
)
from ghst_tools.campaign.again import blocks_of
from ghst_tools.campaign.areas import AREAS
from ghst_tools.campaign.effort import SHORT, Effort
from ghst_tools.campaign.picos import Picos
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Case, Wrong, expect
from ghst_tools.errors import GhstError
from ghst_tools.files import write_file

FOLDER = "host_tests/campaign/cases"


def trial_case(
    area: str, name: str, setting: Setting, counts: Mapping[str, int] | None = None
) -> Case:
    """A trial as a case: what failed without saying more is done again as a whole.

    `counts`: those of its effort with which it ends where it failed.
    """
    effort = asdict(setting.effort) | dict(counts or {})
    return {"kind": "trial", "area": area, "name": name, "seed": setting.seed, "effort": effort}


def _replay_trial(case: Case, picos: Picos) -> None:
    # Counts that have come since are those of the short form; those that are gone do not matter.
    known = {field.name for field in fields(Effort)}
    effort = asdict(SHORT) | {name: n for name, n in case["effort"].items() if name in known}
    if effort["cpu_faults"] is not None:
        effort["cpu_faults"] = tuple(effort["cpu_faults"])
    setting = Setting(picos.image, Effort(**effort), case["seed"])
    setting.__dict__["picos"] = picos
    trials = dict(AREAS[case["area"]].trials(setting)) if case["area"] in AREAS else {}
    expect(case["name"] in trials, f"there is no trial {case['area']}, {case['name']!r} any more")
    trials[case["name"]]()


REPLAYS = {
    "bytes": lambda case, picos: library_bytes.replay(case),
    "wire": wire_bytes.replay,
    "application": application_bytes.replay,
    "configuration": configuration_files.replay,
    "start": starts.replay,
    "serial": serial_bytes.replay,
    "console": lambda case, picos: console_bytes.replay(case),
    "trial": _replay_trial,
}


def folder() -> Path:
    """Where cases are kept: in the checkout, for a commit."""
    return boards.checkout() / FOLDER


def to_save(wrong: Wrong, area: str, name: str, setting: Setting) -> tuple[Case, str]:
    """The smallest case that goes wrong again, done here and now, and what was found out by it.

    A trial is not done again: its seed and effort make it the same.
    """
    if wrong.case is None:
        return trial_case(area, name, setting), "the whole trial: it names nothing smaller"
    if _fails(wrong.case, setting):
        return wrong.case, "done again, it went wrong again"
    for case in wrong.wider:
        if _fails(case, setting):
            blocks = len(blocks_of(case)) - 1
            return case, f"alone it was right; done again behind the {blocks} before it, wrong"
    tried = "".join(f", behind {len(blocks_of(case)) - 1} before it too" for case in wrong.wider)
    upto = "the trial up to there" if wrong.counts else "the whole trial"
    return (
        trial_case(area, name, setting, wrong.counts),
        f"{upto}: done again alone, it was right{tried}",
    )


def _fails(case: Case, setting: Setting) -> bool:
    try:
        replay(case, setting.picos)
    except Exception:
        return True
    return False


def save(case: Case, reason: str, where: Path | None = None) -> Path:
    """Write a case to a file that is named after its contents; returns its path."""
    text = json.dumps(case | {"reason": reason}, indent=1) + "\n"
    name = hashlib.sha256(json.dumps(case, sort_keys=True).encode()).hexdigest()[:12]
    path = (where or folder()) / f"{case['kind']}-{name}.json"
    write_file(path, text.encode())
    return path


def load(path: Path) -> Case:
    """Read a case. `GhstError` if the file is none."""
    try:
        case = json.loads(path.read_bytes())
    except (OSError, ValueError) as error:
        raise GhstError(f"{path}: no saved case: {error}") from error
    if not isinstance(case, dict) or case.get("kind") not in REPLAYS:
        raise GhstError(f"{path}: the kind of a case is one of {', '.join(REPLAYS)}")
    return case


def replay(case: Case, picos: Picos) -> None:
    """Do again what once went wrong; raises what the trial raises if it still does."""
    REPLAYS[case["kind"]](case, picos)
