"""Where a MicroPython image keeps its file system in flash.

The image says so itself: MicroPython declares its block device in the Pico SDK's binary
information (`bi_block_device` in `ports/rp2/rp2_flash.c`), a table that `picotool` reads too.
Nothing has to be known about the build that way, and a build with another layout is not
overwritten by a file-system image made for the usual one.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from ghst_tools.errors import GhstError

FLASH_BASE = 0x10000000
BLOCK_SIZE = 4096  # smallest erasable unit of the Pico's flash, and littlefs' block size on rp2

# pico-sdk, pico_binary_info: the header lies within the first 256 bytes behind the second stage.
_SEARCH_END = 0x200
_MARKER_START = 0x7188EBF2
_MARKER_END = 0xE71AA390
_TYPE_BLOCK_DEVICE = 0x0007
_TAG_MICROPYTHON = 0x504D  # 'M', 'P'


@dataclass(frozen=True)
class FlashRegion:
    """A piece of flash: offset from the start of flash and size, both in bytes."""

    offset: int
    size: int

    @property
    def blocks(self) -> int:
        """Number of erasable blocks."""
        return self.size // BLOCK_SIZE


def find_filesystem(flash: bytes) -> FlashRegion:
    """Return the file-system region that the image in `flash` declares.

    Raises GhstError if the image holds no such declaration.
    """
    header = flash.find(struct.pack("<I", _MARKER_START), 0, _SEARCH_END)
    if header < 0 or _word(flash, header + 16) != _MARKER_END:
        raise GhstError("not a MicroPython image for the Pico: it has no binary information")
    first, last = _word(flash, header + 4), _word(flash, header + 8)
    for pointer in range(first - FLASH_BASE, last - FLASH_BASE, 4):
        entry = _word(flash, pointer) - FLASH_BASE
        kind, tag = struct.unpack_from("<HH", flash, entry)
        if kind == _TYPE_BLOCK_DEVICE and tag == _TAG_MICROPYTHON:
            address, size = struct.unpack_from("<II", flash, entry + 8)
            return FlashRegion(offset=address % FLASH_BASE, size=size)
    raise GhstError("the MicroPython image declares no file system: use an RPI_PICO build")


def _word(flash: bytes, offset: int) -> int:
    return int.from_bytes(flash[offset : offset + 4], "little")
