"""What this computer knows of the configurations on boards, so that none is overwritten unseen.

For each board, by its chip's number, there is the hash of what each file was pulled from or pushed
as: a file that was pulled before the board changed its own is found to be old.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import click

from ghst_tools.files import explained, write_file

STATE_VARIABLE = "GHST_STATE"
STANDARD_INPUT = "-"


def state_folder() -> Path:
    """`$GHST_STATE`, or `micropython-ghst` in the user's state folder (XDG); not created."""
    if folder := os.environ.get(STATE_VARIABLE):
        return Path(folder)
    base = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(base) / "micropython-ghst"


def remember(board_id: str, file: str, digest: str | None) -> None:
    """Note that `file` is what was on the board when its own had this hash (None: no file).

    Where that cannot be noted it is told, and `file` stays unknown: it replaces nothing unseen.
    """
    everything = _load()
    everything.setdefault(board_id, {})[_name(file)] = digest
    path = _path()
    try:
        write_file(path, (json.dumps(everything, indent=1) + "\n").encode())
    except OSError as error:
        click.echo(f"{path}: {error.strerror}: not noted what {file} is", err=True)


def remembered(board_id: str, file: str) -> str | None:
    """The hash that was noted last; None if there is none."""
    found = _load().get(board_id, {}).get(_name(file))
    return found if isinstance(found, str) else None


def keep(board_id: str, digest: str, content: bytes) -> Path:
    """Keep what was on a board and is about to be replaced; returns where."""
    path = state_folder() / "replaced" / f"{board_id}-{digest}.json"
    with explained(path):
        write_file(path, content)
    return path


def _path() -> Path:
    return state_folder() / "boards.json"


def _name(file: str) -> str:
    return file if file == STANDARD_INPUT else str(Path(file).resolve())


def _load() -> dict[str, dict[str, Any]]:
    try:
        found = json.loads(_path().read_bytes())
    except (OSError, ValueError):
        return {}
    if not isinstance(found, dict):
        return {}
    return {key: value for key, value in found.items() if isinstance(value, dict)}
