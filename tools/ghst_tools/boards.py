"""The boards of this checkout: where its files are, and what `boards/<name>/board.json` says."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ghst_tools.errors import GhstError

DEFAULT_BOARD = "rpi_pico"


def checkout() -> Path:
    """Top folder of the checkout that these tools are installed from (`pip install -e`)."""
    return Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Board:
    """One board: the part of `board.json` that the host needs, and the file itself."""

    name: str
    chip: str
    mpy_arch: str
    """Architecture of native code, as mpy-cross's `-march` spells it."""
    micropython_board: str
    """MicroPython's own name of the board (`RPI_PICO`): the stem of its images."""
    machine: str
    """`sys.implementation._machine` of an image for this board."""
    filesystem_offset: int
    """Start of the file system, bytes from the start of flash."""
    filesystem_size: int
    """Bytes."""
    definition: bytes
    """The file as it is: the firmware reads its pins from a copy on the board."""


def load(name: str, root: Path | None = None) -> Board:
    """Read `boards/<name>/board.json`; `GhstError` names the known boards or the broken key."""
    folder = (root or checkout()) / "boards"
    known = sorted(path.parent.name for path in folder.glob("*/board.json"))
    if name not in known:
        raise GhstError(f"unknown board {name!r}: known are {', '.join(known) or 'none'}")
    path = folder / name / "board.json"
    definition = path.read_bytes()
    try:
        values: dict[str, Any] = json.loads(definition)
        return Board(
            name=name,
            chip=values["chip"],
            mpy_arch=values["mpy_arch"],
            micropython_board=values["micropython"]["board"],
            machine=values["micropython"]["machine"],
            filesystem_offset=values["flash"]["filesystem_offset"],
            filesystem_size=values["flash"]["filesystem_size"],
            definition=definition,
        )
    except json.JSONDecodeError as error:
        raise GhstError(f"{path}:{error.lineno}: not valid JSON: {error.msg}") from error
    except KeyError as error:
        raise GhstError(f"{path}: the key {error} is missing") from error
