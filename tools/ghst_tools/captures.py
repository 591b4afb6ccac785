"""Recorded bytes of real Ghost receivers."""

import re
from pathlib import Path

from ghst_tools.boards import checkout
from ghst_tools.errors import GhstError

Read = tuple[bytes, tuple[int | None, ...] | None]
"""The bytes of one read from the UART, and the channels in microseconds after it, if shown."""

_NEVER_RECEIVED = 0xFFFF
_CHANNELS = 16
_VALUES = re.compile(r"(?:0x[0-9a-fA-F]+,\s*)+")


def px4_path() -> Path:
    """Where the capture of PX4's GHST test lies: beside the checkout, not part of it."""
    return checkout().parent / "shared" / "captures" / "px4_ghst_rc_channels.txt"


def read_px4(path: Path) -> list[Read]:
    """The reads of a capture file; see `parse_px4`. `GhstError` if it cannot be read."""
    try:
        return parse_px4(path.read_bytes(), str(path))
    except OSError as error:
        raise GhstError(f"{path}: {error.strerror}") from error


def parse_px4(content: bytes, where: str) -> list[Read]:
    """The reads of a capture in the format of PX4's GHST test, in their order.

    `INPUT` lines hold the bytes of one read. A `DECODED` line holds 16 channels in whole
    microseconds, as PX4 rounded them, and belongs to the read before it; 0xffff, a channel that
    was not received yet, becomes None. The text above the dashed line is a comment. `GhstError`
    names the line that is wrong, in `where`.
    """
    try:
        lines = content.decode("ascii").splitlines()
    except UnicodeDecodeError as error:
        raise GhstError(f"{where}: not a capture: it is not plain text") from error
    reads: list[Read] = []
    in_comment = True
    for number, line in enumerate(lines, 1):
        if in_comment:
            in_comment = not line.startswith("---")
            continue
        if not line.strip():
            continue
        place = f"{where}:{number}"
        kind, _, rest = line.partition(" ")
        if kind not in ("INPUT", "DECODED"):
            raise GhstError(f"{place}: neither INPUT nor DECODED")
        values = _values(rest, place)
        if kind == "INPUT":
            if max(values) > 0xFF:
                raise GhstError(f"{place}: {max(values):#x} is no byte")
            reads.append((bytes(values), None))
            continue
        if len(values) != _CHANNELS:
            raise GhstError(f"{place}: {len(values)} channels, must be {_CHANNELS}")
        if not reads or reads[-1][1] is not None:
            raise GhstError(f"{place}: DECODED without an INPUT before it")
        decoded = tuple(None if value == _NEVER_RECEIVED else value for value in values)
        reads[-1] = (reads[-1][0], decoded)
    if not reads:
        raise GhstError(f"{where}: no INPUT line below a dashed line")
    return reads


def _values(text: str, where: str) -> list[int]:
    if not _VALUES.fullmatch(text.strip()):
        raise GhstError(f"{where}: not a list of hexadecimal numbers with a comma behind each")
    return [int(value, 16) for value in text.split(",") if value.strip()]
