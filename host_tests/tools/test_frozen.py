"""MicroPython's board definitions: what they freeze, and what a frozen image starts."""

import json
import math
import re
import subprocess
import sys
from pathlib import Path

import pytest
import small_checkout

from ghst_tools import boards, device_files, micropython_image
from ghst_tools.chips import CHIPS

ROOT = boards.checkout()
ALL = boards.names()

# The functions that MicroPython's tools/manifestfile.py gives a manifest, and no others.
RUN = """
import json, os, sys

frozen = []

class Options:
    def __init__(self, given):
        self.__dict__.update(given)

def freeze(path, script=None, opt=None):
    frozen.append([path if path.startswith("$(") else os.path.abspath(path), script])

def include(path, **options):
    path = os.path.abspath(path)
    if os.path.isdir(path):
        path = os.path.join(path, "manifest.py")
    before = os.getcwd()
    os.chdir(os.path.dirname(path))
    with open(path) as file:
        exec(file.read(), {"include": include, "freeze": freeze, "options": Options(options)})
    os.chdir(before)

include(sys.argv[1])
print(json.dumps(frozen))
"""


def frozen(root: Path, name: str) -> list[tuple[str, list[str] | None]]:
    """What the manifest of a board freezes: folder, and files or None.

    Without the packages of PyPI: MicroPython's own make runs it with any Python.
    """
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", RUN, root / f"boards/{name}/micropython/manifest.py"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return [(folder, script) for folder, script in json.loads(done.stdout)]


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A small checkout with its tools."""
    root = small_checkout.make(tmp_path)
    (root / "tools").symlink_to(ROOT / "tools")
    return root


MODULES = [
    "firmware/__init__.py",
    "firmware/sub/__init__.py",
    "firmware/sub/app.py",
    "ghst/__init__.py",
    "ghst/answer.py",
    "ghst_board.py",
    "main.py",
]


@pytest.mark.parametrize("name", ALL)
def test_what_is_frozen(root: Path, name: str) -> None:
    build = root / "build" / name / "frozen"
    assert frozen(root, name) == [("$(PORT_DIR)/modules", None), (str(build), MODULES)]
    assert (build / "ghst/answer.py").read_text() == "ANSWER = 42\n"
    assert (build / "main.py").read_bytes() == (ROOT / "boards/frozen/main.py").read_bytes()
    values: dict[str, bytes] = {}
    exec((build / "ghst_board.py").read_text(), values)
    assert values["DEFINITION"] == boards.load(name, root).definition
    assert json.loads(values["DEFINITION"])["name"] == name


def test_only_what_differs_is_written(root: Path) -> None:
    board = boards.load("rpi_pico", root)
    folder = device_files.write_frozen_modules(board, root)

    def state() -> dict[str, tuple[int, int]]:
        files = sorted(path for path in folder.rglob("*") if path.is_file())
        return {
            path.relative_to(folder).as_posix(): (path.stat().st_ino, path.stat().st_mtime_ns)
            for path in files
        }

    first = state()
    assert list(first) == sorted(MODULES)
    assert device_files.write_frozen_modules(board, root) == folder
    assert state() == first
    (root / "lib/ghst/answer.py").write_text("ANSWER = 43\n")
    (folder / "firmware/old.py").touch()
    (folder / "ghst_board.py").write_text("DEFINITION = b''\n")
    device_files.write_frozen_modules(board, root)
    second = state()
    assert list(second) == list(first)
    changed = [name for name in first if second[name] != first[name]]
    assert changed == ["ghst/answer.py", "ghst_board.py"]


@pytest.mark.parametrize("name", ALL)
def test_the_definition_has_what_micropython_looks_for(name: str) -> None:
    board = boards.load(name)
    folder = ROOT / "boards" / name / "micropython"
    cmake = (folder / "mpconfigboard.cmake").read_text()
    header = (folder / "mpconfigboard.h").read_text()
    settings = dict(re.findall(r"^set\((\w+)\s+([^()]*?)\s*\)$", cmake, re.MULTILINE))
    assert settings["MICROPY_BOARD"] == f"GHST_{name.upper()}"
    assert settings["MICROPY_FROZEN_MANIFEST"] == "${MICROPY_BOARD_DIR}/manifest.py"
    if CHIPS[board.chip].is_rp2:
        assert settings["PICO_PLATFORM"] == board.chip
        storage = re.search(r"FLASH_STORAGE_BYTES \(([\d *]+)\)", header)
        assert storage is not None
        assert math.prod(map(int, storage[1].split("*"))) == board.filesystem_size
    else:
        assert settings.get("IDF_TARGET") == board.chip
        own = re.findall(r"\$\{MICROPY_BOARD_DIR\}/(\S+)", settings["SDKCONFIG_DEFAULTS"])
        assert sorted(own) == sorted(path.name for path in folder.glob("sdkconfig*"))
        # With the name of MicroPython's own definition it answers as an image of that.
        names = re.findall(r'#define MICROPY_HW_(?:BOARD|MCU)_NAME "([^"]*)"', header)
        assert " with ".join(names) == board.machine
    rows = [line.split(",") for line in (folder / "pins.csv").read_text().splitlines()]
    expected = [
        [f"IO{pin.label}" if pin.label.isdecimal() else pin.label, f"GPIO{gpio}"]
        for gpio, pin in board.pins.items()
    ]
    led = board.defaults.get("led")
    if led and all(label != "LED" for label, _ in expected):
        expected.append(["LED", f"GPIO{led['pin']}"])
    assert rows == expected


START = """
import sys, vfs
vfs.umount("/")
vfs.mount(vfs.VfsPosix(sys.argv[1]), "/")
sys.path[:] = ["/lib"]
execfile("/frozen_main.py")
"""


@pytest.mark.parametrize(
    ("user", "output"),
    [
        (None, "firmware\n"),
        ("print('user', __name__)\n", "user __main__\n"),
        ("from firmware.app import main\nmain()\nprint(main.__name__)\n", "firmware\nmain\n"),
    ],
)
def test_the_users_main_comes_before_the_frozen_one(
    tmp_path: Path, user: str | None, output: str
) -> None:
    (tmp_path / "lib/firmware").mkdir(parents=True)
    (tmp_path / "lib/firmware/__init__.py").touch()
    (tmp_path / "lib/firmware/app.py").write_text("def main():\n    print('firmware')\n")
    frozen_main = (ROOT / "boards/frozen/main.py").read_text()
    (tmp_path / "frozen_main.py").write_text(frozen_main)
    if user is not None:
        (tmp_path / "main.py").write_text(user)
    done = subprocess.run(
        [micropython_image.unix_micropython(), "-c", START, tmp_path],
        capture_output=True,
        text=True,
    )
    assert (done.stdout, done.stderr) == (output, "")
