"""Runs the examples of a document: every `$` line in a block of type `console`."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from ghst_tools import boards

_BLOCK = re.compile(
    r"(^(<!-- (?:measured|board) -->\n)?```console\n)(.*?)(^```$)", re.MULTILINE | re.DOTALL
)
_MEASURED = "<!-- measured -->\n"
_BOARD = "<!-- board -->\n"

Run = Callable[[str], str]


def render(document: str, run: Run | None = None, with_board: Run | None = None) -> str:
    """`document` with the output of each command as `run` gives it now.

    Commands in the blocks marked as a board's are given to `with_board`; what there is nothing to
    run with is left as it is.
    """

    def block(match: re.Match[str]) -> str:
        runner = with_board if match[2] == _BOARD else run
        if runner is None:
            return match[0]
        commands = [line for line in match[3].splitlines() if line.startswith("$ ")]
        shown = [f"{command}\n{runner(command[2:])}" for command in commands]
        return match[1] + "\n".join(shown) + match[4]

    return _BLOCK.sub(block, document)


def without_measurements(document: str) -> str:
    """`document` with only commands in the blocks marked as measured: their outputs differ."""

    def block(match: re.Match[str]) -> str:
        lines = match[3].splitlines(keepends=True)
        if match[2] == _MEASURED:
            lines = [line for line in lines if line.startswith("$ ")]
        return "".join([match[1], *lines, match[4]])

    return _BLOCK.sub(block, document)


def commands(document: str) -> list[str]:
    """All commands in the order of the document."""
    blocks = [match[3] for match in _BLOCK.finditer(document)]
    return [line[2:] for block in blocks for line in block.splitlines() if line.startswith("$ ")]


class Shell:
    """Runs commands in `folder`, which has the recordings of docs/examples in it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        root = boards.checkout()
        for example in (root / "docs" / "examples").iterdir():
            shutil.copy(example, folder)
        decoders = folder / ".share" / "libsigrokdecode" / "decoders"
        shutil.copytree(root / "tools" / "sigrok", decoders)
        self._environment = {
            **os.environ,
            "COLUMNS": "100",
            "LC_ALL": "C.UTF-8",
            "PYTHONPATH": os.pathsep.join(str(root / part) for part in ("lib", "tools")),
            "XDG_DATA_HOME": str(folder / ".share"),
        }
        interpreter = shlex.quote(sys.executable)
        self._prelude = f'ghst() {{ {interpreter} -m ghst_tools.cli "$@"; }}\n'

    def run(self, command: str) -> str:
        """What a command prints, on stdout and stderr together."""
        done = subprocess.run(
            ["sh", "-c", self._prelude + command],
            cwd=self.folder,
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        return done.stdout
