"""Failing cases of the campaign: saved to a folder, each a test from then on."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from ghst_tools import boards
from ghst_tools.campaign import (
    application_bytes,
    configuration_files,
    console_bytes,
    library_bytes,
    serial_bytes,
    wire_bytes,
)
from ghst_tools.campaign.picos import Picos
from ghst_tools.errors import GhstError
from ghst_tools.files import write_file

FOLDER = "host_tests/campaign/cases"

REPLAYS = {
    "bytes": lambda case, picos: library_bytes.replay(case),
    "wire": wire_bytes.replay,
    "application": application_bytes.replay,
    "configuration": configuration_files.replay,
    "serial": serial_bytes.replay,
    "console": lambda case, picos: console_bytes.replay(case),
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
    """Do again what once went wrong; raises `verdict.Wrong` if it still does."""
    REPLAYS[case["kind"]](case, picos)
