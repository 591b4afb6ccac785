"""UF2 images: gaps, families, damage."""

import struct
from pathlib import Path

import pytest

from ghst_tools import uf2
from ghst_tools.errors import GhstError


def block(
    address: int, data: bytes, family: int = uf2.RP2040_FAMILY, flags: int = 0x2000
) -> bytes:
    header = struct.pack("<8I", 0x0A324655, 0x9E5D5157, flags, address, len(data), 0, 1, family)
    return header + data.ljust(476, b"\0") + struct.pack("<I", 0x0AB16F30)


def write(path: Path, *blocks: bytes) -> Path:
    path.write_bytes(b"".join(blocks))
    return path


def test_blocks_in_any_order_with_a_gap(tmp_path: Path) -> None:
    path = write(tmp_path / "a.uf2", block(0x10000300, b"cd"), block(0x10000000, b"a" * 256))
    image = uf2.read(path)
    assert (image.start, image.end) == (0x10000000, 0x10000302)
    assert image.data == b"a" * 256 + b"\xff" * 512 + b"cd"


def test_blocks_that_are_not_for_flash_are_skipped(tmp_path: Path) -> None:
    ignored = block(0x20000000, b"x", flags=0x2001)
    assert uf2.read(write(tmp_path / "a.uf2", ignored, block(0x10000000, b"y"))).data == b"y"


@pytest.mark.parametrize(
    ("family", "chip"), [(uf2.RP2350_FAMILY, "an RP2350"), (0x1C5F21B0, "another chip")]
)
def test_an_image_for_another_chip_is_refused(tmp_path: Path, family: int, chip: str) -> None:
    path = write(tmp_path / "a.uf2", block(0x10000000, b"y", family))
    with pytest.raises(GhstError, match=rf"a\.uf2: an image for {chip}, not for the RP2040$"):
        uf2.read(path)


def test_a_cut_off_file_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "a.uf2", block(0x10000000, b"y"), b"rest")
    with pytest.raises(GhstError, match="not a UF2 file"):
        uf2.read(path)


@pytest.mark.parametrize("position", [0, 4, 511])
def test_a_damaged_block_is_located(tmp_path: Path, position: int) -> None:
    bad = bytearray(block(0x10000100, b"z"))
    bad[position] ^= 1
    path = write(tmp_path / "a.uf2", block(0x10000000, b"y"), bytes(bad))
    with pytest.raises(GhstError, match="damaged UF2 block at byte 512"):
        uf2.read(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(GhstError, match=r"none\.uf2: No such file"):
        uf2.read(tmp_path / "none.uf2")
