"""The boards of this checkout: where its files are, and what `boards/<name>/board.json` says."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ghst_tools import board_check, board_file
from ghst_tools.chips import CHIPS
from ghst_tools.errors import GhstError

DEFAULT_BOARD = "rpi_pico"


def checkout() -> Path:
    """Top folder of the checkout that these tools are installed from (`pip install -e`)."""
    return Path(__file__).resolve().parents[2]


def resources() -> Path:
    """Folder with `boards` and `firmware`: the checkout, or what an installed wheel has of it."""
    root = checkout()
    return root if (root / "firmware").is_dir() else Path(__file__).parent / "shipped"


@dataclass(frozen=True)
class Pin:
    """One pin that a board brings out, or that has its LED."""

    label: str
    """What is printed beside it, or what the maker's drawing calls it; "LED" for the LED alone."""
    functions: tuple[str, ...]
    """Of `chips.KINDS` and of `chips.Chip.functions`."""
    note: str


@dataclass(frozen=True)
class Connection:
    """One row of the wiring that the defaults do not tell."""

    source: str
    """What is connected: one of `board_check.SOURCES`."""
    to: str
    """Label of a pin, or the board's name for a supply or ground pin."""
    part: str
    """What is in between; empty for a plain wire."""
    optional: bool
    note: str


@dataclass(frozen=True)
class Board:
    """One board: what `boards/<name>/board.json` says."""

    name: str
    title: str
    chip: str
    """A key of `chips.CHIPS`."""
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
    pins: Mapping[int, Pin]
    """By GPIO number."""
    defaults: Mapping[str, Any]
    """The configuration of a board whose user has written none, in the form of `ghst.json`."""
    wiring: tuple[Connection, ...]
    selftest_pin: int | None
    """The pin that plays the receiver in the self-test, on boards that have one."""
    definition: bytes
    """`/board.json` as the board gets it: see `board_file.device_file`."""

    def label(self, gpio: int) -> str:
        """What is printed beside a pin."""
        return self.pins[gpio].label

    def connection(self, source: str) -> Connection:
        """The row of the wiring for a source that has one only."""
        return next(row for row in self.wiring if row.source == source)

    @property
    def battery_limit_v(self) -> int:
        """The highest battery voltage, in whole V, that the ADC reads with the default divider."""
        return int(CHIPS[self.chip].adc_limit_mv * self.defaults["battery"]["divider"]) // 1000


def names(root: Path | None = None) -> list[str]:
    """All boards, sorted."""
    folder = (root or resources()) / "boards"
    return sorted(path.parent.name for path in folder.glob("*/board.json"))


def load_all(root: Path | None = None) -> Iterator[Board]:
    """All boards: the default one, then those with an RP2 chip, then the others, by name."""
    boards = [load(name, root) for name in names(root)]
    yield from sorted(
        boards, key=lambda board: (board.name != DEFAULT_BOARD, not CHIPS[board.chip].is_rp2)
    )


def load(name: str, root: Path | None = None) -> Board:
    """Read `boards/<name>/board.json`; `GhstError` names the known boards or the broken key."""
    known = names(root)
    if name not in known:
        raise GhstError(f"unknown board {name!r}: known are {', '.join(known) or 'none'}")
    path = (root or resources()) / "boards" / name / "board.json"
    try:
        values = json.loads(path.read_bytes())
        board_check.check(values, name)
    except json.JSONDecodeError as error:
        raise GhstError(f"{path}:{error.lineno}: not valid JSON: {error.msg}") from error
    except UnicodeDecodeError as error:
        raise GhstError(f"{path}: not valid JSON: {error.reason}") from error
    except GhstError as error:
        raise GhstError(f"{path}: {error}") from error
    return Board(
        name=name,
        title=values["title"],
        chip=values["chip"],
        mpy_arch=values["mpy_arch"],
        micropython_board=values["micropython"]["board"],
        machine=values["micropython"]["machine"],
        filesystem_offset=values["flash"]["filesystem_offset"],
        filesystem_size=values["flash"]["filesystem_size"],
        pins={
            int(gpio): Pin(pin["label"], tuple(pin["functions"]), pin.get("note", ""))
            for gpio, pin in values["pins"].items()
        },
        defaults=values["defaults"],
        wiring=tuple(
            Connection(
                source=row["from"],
                to=row["to"],
                part=row.get("part", ""),
                optional=row.get("optional", False),
                note=row.get("note", ""),
            )
            for row in values["wiring"]
        ),
        selftest_pin=values.get("selftest", {}).get("receiver_pin"),
        definition=board_file.device_file(values),
    )
