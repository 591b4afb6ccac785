"""The whole firmware of an ESP32, from its /main.py on, on MicroPython's unix port.

The board's own files, compiled for the host, on a littlefs; `machine` and `time` are those of
`esp32_model`. The tests themselves are functions of the modules in `esp32_run`, and run in there.
"""

import ast
import re
import subprocess
from pathlib import Path

import pytest

from ghst_tools import boards, device_files, micropython_image

HERE = Path(__file__).parent
LIMIT_S = 600
"""Far beyond what any of them takes on a busy machine: ends what hangs."""


def board_tree(name: str, folder: Path) -> boards.Board:
    """Write the files of a board into `folder`, as machine code for this computer."""
    board = boards.load(name)
    modules = device_files.sources(board=board)
    files = {
        path: content
        for path, content in device_files.collect(board).items()
        if not path.endswith(".mpy")
    }
    # Its words hold addresses of 32 bits, which here have 64: bytecode, and numbers for addresses.
    shape = device_files.folded(modules)["firmware/shape_viper.py"]
    shape = re.sub(r"@micropython\.viper\n", "\n", shape)
    files |= device_files.compile_modules(modules, "x64")
    del files["/lib/firmware/shape_viper.mpy"]
    files["/lib/firmware/shape_viper.py"] = shape.encode()
    for path, content in files.items():
        file = folder / path.removeprefix("/")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
    return board


class Boards:
    """The files of each board, made when they are needed."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._made: dict[str, boards.Board] = {}

    def run(self, name: str, module: str, function: str) -> None:
        """Run a function of `esp32_run` for a board; AssertionError with its traceback."""
        tree = self._folder / name
        if name not in self._made:
            self._made[name] = board_tree(name, tree)
        board = self._made[name]
        arguments = f"{str(tree)!r}, {board.machine!r}, {board.chip!r}"
        done = subprocess.run(
            [
                *(micropython_image.unix_micropython(), "-X", "heapsize=32M", "-c"),
                f"from esp32_run.{module} import {function}\n{function}({arguments})",
            ],
            env={"MICROPYPATH": f"{HERE}:{boards.checkout() / 'lib'}:.frozen"},
            capture_output=True,
            text=True,
            timeout=LIMIT_S,
        )
        assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="session")
def esp32(tmp_path_factory: pytest.TempPathFactory) -> Boards:
    return Boards(tmp_path_factory.mktemp("esp32"))


def cases(module: str) -> list[str]:
    """The tests of a module of `esp32_run`: its public functions."""
    source = HERE.joinpath("esp32_run", f"{module}.py").read_text(encoding="utf-8")
    return [
        node.name
        for node in ast.parse(source).body
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")
    ]


@pytest.mark.parametrize("function", cases("flying"))
def test_flying(esp32: Boards, function: str) -> None:
    esp32.run("esp32_devkit", "flying", function)


@pytest.mark.parametrize("name", ["esp32_s3_devkit", "esp32_c3_supermini"])
@pytest.mark.parametrize("function", ["each_channel", "every_pulse_width"])
def test_flying_with_another_chip(esp32: Boards, name: str, function: str) -> None:
    esp32.run(name, "flying", function)


@pytest.mark.parametrize("function", [name for name in cases("losing") if "the_led" not in name])
def test_losing(esp32: Boards, function: str) -> None:
    esp32.run("esp32_devkit", "losing", function)


@pytest.mark.parametrize("function", cases("talking"))
def test_talking(esp32: Boards, function: str) -> None:
    esp32.run("esp32_devkit", "talking", function)


@pytest.mark.parametrize("function", ["the_led", "the_led_of_a_broken_configuration"])
def test_the_led(esp32: Boards, function: str) -> None:
    esp32.run("esp32_c3_supermini", "losing", function)
