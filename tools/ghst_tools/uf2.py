"""UF2, the format of RP2040 images (https://github.com/microsoft/uf2)."""

import struct
from dataclasses import dataclass
from pathlib import Path

from ghst_tools.errors import GhstError

RP2040_FAMILY = 0xE48BFF56
RP2350_FAMILY = 0xE48BFF59
FLASH_BASE = 0x10000000

_BLOCK = 512
_HEADER = struct.Struct("<8I")
_MAGIC_START = (0x0A324655, 0x9E5D5157)
_MAGIC_END = struct.pack("<I", 0x0AB16F30)
_NOT_MAIN_FLASH = 0x00000001
_FAMILY_PRESENT = 0x00002000


@dataclass(frozen=True)
class Image:
    """The flash content of a UF2 file."""

    family: int
    start: int
    """Address of the first byte."""
    data: bytes
    """From the lowest address to the highest; gaps read as erased flash."""

    @property
    def end(self) -> int:
        """Address after the last byte."""
        return self.start + len(self.data)


def read(path: Path) -> Image:
    """Read a UF2 file for an RP2040; `GhstError` if it is damaged or for another chip."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise GhstError(f"{path}: {error.strerror}") from error
    if not content or len(content) % _BLOCK:
        raise GhstError(f"{path}: not a UF2 file (its size is not a multiple of {_BLOCK})")
    blocks = []
    for offset in range(0, len(content), _BLOCK):
        block = content[offset : offset + _BLOCK]
        magic0, magic1, flags, address, size, _, _, family = _HEADER.unpack_from(block)
        if (magic0, magic1) != _MAGIC_START or block[-4:] != _MAGIC_END or size > 476:
            raise GhstError(f"{path}: damaged UF2 block at byte {offset}")
        # Images for the RP2350 begin with a block of another family, for its erratum E10.
        if not flags & _NOT_MAIN_FLASH and flags & _FAMILY_PRESENT:
            blocks.append((family, address, block[32 : 32 + size]))
    families = {family for family, _, _ in blocks}
    if families != {RP2040_FAMILY}:
        chip = "an RP2350" if RP2350_FAMILY in families else "another chip"
        raise GhstError(f"{path}: an image for {chip}, not for the RP2040")
    start = min(address for _, address, _ in blocks)
    end = max(address + len(data) for _, address, data in blocks)
    flash = bytearray(b"\xff" * (end - start))
    for _, address, data in blocks:
        flash[address - start : address - start + len(data)] = data
    return Image(RP2040_FAMILY, start, bytes(flash))
