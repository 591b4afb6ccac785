"""The three interpreters that the library has to run on, behind one interface.

`run(module, name)` runs one function of the `behaviour` package and raises AssertionError with
the target's own traceback when it failed; `evaluate(module, expression)` returns a value that has
a literal.
"""

import ast
import importlib
import re
import subprocess
from pathlib import Path
from typing import Any, Protocol

from ghst_tools import boards, device_files, filesystem, micropython_image
from ghst_tools.campaign.fork import in_child
from ghst_tools.emulator import Board, DeviceError

BEHAVIOUR = Path(__file__).with_name("behaviour")
UNIX_LIMIT_S = 60
"""Far beyond what any workload takes: ends a unix port that hangs."""
EMULATED_LIMIT_NS = 60e9


def cases(module: str) -> list[str]:
    """The tests of a module of `behaviour`: its public functions, in the order of the source."""
    source = BEHAVIOUR.joinpath(f"{module}.py").read_text(encoding="utf-8")
    return [
        node.name
        for node in ast.parse(source).body
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")
    ]


class Target(Protocol):
    """An interpreter with `lib/ghst`, `firmware` and the behaviour tests on its path."""

    def run(self, module: str, name: str) -> None: ...

    def evaluate(self, module: str, expression: str) -> Any: ...


class CPython:
    """The interpreter that pytest itself runs on."""

    def run(self, module: str, name: str) -> None:
        getattr(importlib.import_module(f"behaviour.{module}"), name)()

    def evaluate(self, module: str, expression: str) -> Any:
        return eval(expression, vars(importlib.import_module(f"behaviour.{module}")))


class Unix:
    """MicroPython's unix port: the library from its source, a new process for each run."""

    def __init__(self) -> None:
        self._program = micropython_image.unix_micropython()
        root = boards.checkout()
        self._path = f"{root / 'lib'}:{root}:{BEHAVIOUR.parent}:.frozen"

    def run(self, module: str, name: str) -> None:
        self.execute(f"from behaviour.{module} import {name}\n{name}()")

    def evaluate(self, module: str, expression: str) -> Any:
        code = f"from behaviour.{module} import *\nprint(repr({expression}))"
        return ast.literal_eval(self.execute(code))

    def execute(self, code: str) -> str:
        """What `code` prints; AssertionError with the traceback when it ends otherwise."""
        done = subprocess.run(
            [self._program, "-c", code],
            env={"MICROPYPATH": self._path},
            capture_output=True,
            text=True,
            timeout=UNIX_LIMIT_S,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout


_RUN_ALL = """
import sys
from behaviour import {module}
for name in {names!r}:
    try:
        getattr({module}, name)()
    except Exception as error:
        print("FAILED", name)
        sys.print_exception(error)
    else:
        print("PASSED", name)
"""


class Rp2040:
    """An emulated Pico, booted once: the library and the tests as `.mpy` files in its flash.

    The first test of a module runs all of the module's tests in one go, since talking to the chip
    costs more than most tests; the others tell how theirs ended. Whatever is run finds the board
    as it was after booting.
    """

    def __init__(self, image: Path) -> None:
        self._board = Board(image, filesystem.build(_device_tree(), _board().filesystem_size))
        self._board.boot()
        self._outcomes: dict[str, str] = {}

    def run(self, module: str, name: str) -> None:
        if module not in self._outcomes:
            self._outcomes[module] = "did not end"
            self._outcomes[module] = self.execute(
                _RUN_ALL.format(module=module, names=cases(module))
            )
        outcome = re.search(
            rf"^(PASSED|FAILED) {name}\n((?:(?!PASSED |FAILED ).*\n)*)",
            self._outcomes[module],
            re.MULTILINE,
        )
        assert outcome is not None, f"{name} did not end; the module: {self._outcomes[module]}"
        assert outcome[1] == "PASSED", outcome[2]

    def evaluate(self, module: str, expression: str) -> Any:
        code = f"from behaviour.{module} import *\nprint(repr({expression}))"
        return ast.literal_eval(self.execute(code))

    def execute(self, code: str) -> str:
        """What `code` prints; AssertionError with the traceback when it raised."""
        output, failure = in_child(lambda: self._execute(code))
        assert not failure, failure
        return output

    def _execute(self, code: str) -> tuple[str, str]:
        try:
            return self._board.exec(code, EMULATED_LIMIT_NS), ""
        except DeviceError as error:
            return "", str(error)


def _board() -> boards.Board:
    return boards.load(boards.DEFAULT_BOARD)


def _device_tree() -> dict[str, bytes]:
    """Library and firmware as they are installed on a board, and the tests beside them."""
    modules = device_files.sources()
    modules |= {f"behaviour/{path.name}": path for path in BEHAVIOUR.glob("*.py")}
    return device_files.compile_modules(modules, _board().mpy_arch)
