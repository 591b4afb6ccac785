"""The file-system image: contents, determinism, limits, and the chip that mounts it."""

import hashlib
import os
import stat
from pathlib import Path

import pytest
import small_checkout

from ghst_tools import boards, device_files, filesystem
from ghst_tools.emulator import Board
from ghst_tools.errors import GhstError

SIZE = 352 * 4096
FILES = {"/main.py": b"pass\n", "/lib/a/b/c.mpy": bytes(range(256)) * 40, "/empty": b""}


def test_what_goes_in_comes_out() -> None:
    image = filesystem.build(FILES, SIZE)
    assert len(image) == SIZE
    assert filesystem.read(image) == dict(sorted(FILES.items()))


def test_the_same_files_give_the_same_bytes_in_any_order() -> None:
    assert filesystem.build(FILES, SIZE) == filesystem.build(dict(reversed(FILES.items())), SIZE)


def test_files_that_do_not_fit_are_refused() -> None:
    with pytest.raises(GhstError, match=r"^65536 bytes of files do not fit in 65536 bytes"):
        filesystem.build({"/big": bytes(65536)}, 65536)


def test_what_is_no_image_is_refused() -> None:
    with pytest.raises(GhstError, match="not a littlefs image"):
        filesystem.read(b"\xff" * SIZE)


def test_the_command_writes_into_the_build_folder(tmp_path: Path) -> None:
    root = small_checkout.make(tmp_path)
    path = filesystem.write("rpi_pico", root)
    assert path == root / "build/rpi_pico/filesystem.img"
    assert stat.S_IMODE(path.stat().st_mode) == 0o644
    content = filesystem.read(path.read_bytes())
    assert content == device_files.collect(boards.load("rpi_pico", root), root)
    assert list(content) == small_checkout.BOARD_FILES


def test_a_failure_leaves_the_old_image(tmp_path: Path) -> None:
    root = small_checkout.make(tmp_path)
    path = filesystem.write("rpi_pico", root)
    before = path.read_bytes()
    (root / "lib/ghst/answer.py").write_text("=\n")
    with pytest.raises(GhstError):
        filesystem.write("rpi_pico", root)
    assert path.read_bytes() == before
    assert os.listdir(path.parent) == [path.name]


def test_the_chip_mounts_it_and_runs_main(tmp_path: Path, micropython_image: Path) -> None:
    root = small_checkout.make(tmp_path)
    definition = boards.load("rpi_pico", root)
    board = Board(micropython_image, filesystem.write("rpi_pico", root))
    declared = (board.filesystem.offset, board.filesystem.size)
    assert declared == (definition.filesystem_offset, definition.filesystem_size)
    board.boot(until=f"{small_checkout.HELLO} 42\r\n".encode())
    listing = board.exec(
        "import os, hashlib\n"
        "for name in ('/main.py', '/lib/ghst/answer.mpy'):\n"
        "    print(name, hashlib.sha256(open(name, 'rb').read()).digest().hex())\n"
        "print(os.statvfs('/')[:3])\n"
    )
    files = device_files.collect(definition, root)
    assert listing.splitlines() == [
        f"{name} {hashlib.sha256(files[name]).hexdigest()}"
        for name in ("/main.py", "/lib/ghst/answer.mpy")
    ] + ["(4096, 4096, 352)"]
