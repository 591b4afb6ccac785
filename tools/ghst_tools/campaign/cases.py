"""Cases of the campaign: what once went wrong, saved to a folder, each a test from then on."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

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
from ghst_tools.campaign.areas import AREAS
from ghst_tools.campaign.effort import SHORT, Effort
from ghst_tools.campaign.picos import Picos
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import expect
from ghst_tools.errors import GhstError
from ghst_tools.files import write_file

FOLDER = "host_tests/campaign/cases"


def trial_case(area: str, name: str, setting: Setting) -> dict[str, Any]:
    """A trial as a case: what failed without saying more is done again as a whole."""
    effort = asdict(setting.effort)
    return {"kind": "trial", "area": area, "name": name, "seed": setting.seed, "effort": effort}


def _replay_trial(case: dict[str, Any], picos: Picos) -> None:
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


def save(case: dict[str, Any], reason: str, where: Path | None = None) -> Path:
    """Write a case to a file that is named after its contents; returns its path."""
    text = json.dumps(case | {"reason": reason}, indent=1) + "\n"
    name = hashlib.sha256(json.dumps(case, sort_keys=True).encode()).hexdigest()[:12]
    path = (where or folder()) / f"{case['kind']}-{name}.json"
    write_file(path, text.encode())
    return path


def load(path: Path) -> dict[str, Any]:
    """Read a case. `GhstError` if the file is none."""
    try:
        case = json.loads(path.read_bytes())
    except (OSError, ValueError) as error:
        raise GhstError(f"{path}: no saved case: {error}") from error
    if not isinstance(case, dict) or case.get("kind") not in REPLAYS:
        raise GhstError(f"{path}: the kind of a case is one of {', '.join(REPLAYS)}")
    return case


def replay(case: dict[str, Any], picos: Picos) -> None:
    """Do again what once went wrong; raises what the trial raises if it still does."""
    REPLAYS[case["kind"]](case, picos)
