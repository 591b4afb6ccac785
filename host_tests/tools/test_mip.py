"""package.json: what mip installs is what lib/ghst has for boards."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import small_checkout
from click.testing import CliRunner
from served_board import ServedBoard

from ghst_tools import boards, filesystem, mip
from ghst_tools.cli import ghst
from ghst_tools.emulator import Board
from ghst_tools.errors import GhstError


def test_the_manifest_of_this_checkout_is_up_to_date() -> None:
    written = (boards.checkout() / mip.MANIFEST).read_text()
    assert written == mip.manifest(), "run 'ghst mip-manifest'"


def test_it_lists_what_is_for_boards(tmp_path: Path) -> None:
    assert json.loads(mip.manifest(small_checkout.make(tmp_path))) == {
        "urls": [
            ["ghst/__init__.py", "lib/ghst/__init__.py"],
            ["ghst/answer.py", "lib/ghst/answer.py"],
        ],
        "deps": [],
        "version": "1.2.3",
    }


def test_what_is_no_checkout_has_no_manifest(tmp_path: Path) -> None:
    project = tmp_path / "pyproject.toml"
    result = CliRunner().invoke(ghst, ["mip-manifest", "--tree", str(tmp_path)])
    assert (result.exit_code, result.output) == (
        1,
        f"ghst: {project}: No such file or directory\n",
    )
    for text in ("[project]\n", "[project\n"):
        project.write_text(text)
        with pytest.raises(GhstError, match=r"pyproject\.toml: has no version of a project: "):
            mip.manifest(tmp_path)


def test_mpremote_installs_from_a_path(empty_board: ServedBoard, tmp_path: Path) -> None:
    root = small_checkout.make(tmp_path)
    manifest = root / mip.MANIFEST
    manifest.write_text(mip.manifest(root))
    mpremote = [sys.executable, "-m", "mpremote", "connect", empty_board.address]
    done = subprocess.run(
        [*mpremote, "mip", "install", str(manifest)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    code = "import ghst; print(ghst.__file__, ghst.ANSWER)"
    done = subprocess.run([*mpremote, "exec", code], capture_output=True, text=True)
    assert done.stdout == "/lib/ghst/__init__.py 42\n", done.stdout + done.stderr


def test_the_library_works_as_mip_installs_it(micropython_image: Path) -> None:
    # As sources, compiled on the chip: without the detour over mpremote, which takes its time.
    root = boards.checkout()
    urls = json.loads((root / mip.MANIFEST).read_text())["urls"]
    files = {f"/lib/{target}": (root / source).read_bytes() for target, source in urls}
    size = boards.load("rpi_pico").filesystem_size
    board = Board(micropython_image, filesystem.build(files, size))
    board.boot()
    printed = board.exec("import ghst; print(ghst.__file__, ghst.crc8(b'123456789', 0, 9))")
    # Check value of CRC-8/DVB-S2.
    assert printed == f"/lib/ghst/__init__.py {0xBC}\n"
