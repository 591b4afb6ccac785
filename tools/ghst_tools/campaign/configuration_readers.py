"""What the firmware makes of a configuration's files, on host, unix port and emulated board."""

from __future__ import annotations

import ast
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ghst_tools import boards, filesystem, micropython_image
from ghst_tools.campaign import corruption
from ghst_tools.campaign.picos import Picos
from ghst_tools.campaign.verdict import Wrong
from ghst_tools.configuration.validator import firmware_module
from ghst_tools.emulator import Board
from ghst_tools.emulator.repl import DeviceError

USER, BOARD = "ghst.json", "board.json"
ON_BOARD = "/texts/"
"""The folder that the emulated board has the broken files in."""
Outcome = tuple[Any, ...]
"""("valid", values), ("problems", line, outputs that move), ("board", line of the error), or
("raised", exception)."""

# Printed on the two targets with MicroPython, and read by `ast.literal_eval`.
_OUTCOME = """
from firmware.configuration import load
def outcome():
    try:
        made = load.load()
    except load.BoardError as error:
        return ("board", str(error))
    except Exception as error:
        return ("raised", type(error).__name__ + ": " + str(error))
    if made.problems:
        return ("problems", made.problems[0], len(made.values["outputs"]))
    return ("valid", made.values)
"""
_UNIX = """
load.FILE, load.BOARD_FILE = {paths!r}
size = bytearray(4)
with open({source!r}, "rb") as source:
    while source.readinto(size):
        with open({target!r}, "wb") as target:
            target.write(source.read(size[0] | size[1] << 8 | size[2] << 16))
        print(repr(outcome()))
"""
# The emulated board's USB takes longer to print all values than the firmware to check them: what
# is printed are those that differ, by value or by type, from the whole file's.
_BOARD = """
import gc
whole = outcome()[1]
def differences(values):
    found = []
    for section, named in values.items():
        standard = whole.get(section, {})
        if section == "outputs":
            if repr(named) != repr(standard):
                found.append((section, named))
            continue
        for name, value in named.items():
            if name not in standard or repr(value) != repr(standard[name]):
                found.append((section, name, value))
    for section, named in whole.items():
        for name in named:
            if section != "outputs" and name not in values.get(section, {}):
                found.append(("missing", section, name))
    if set(values) != set(whole):
        found.append(("sections",) + tuple(values))
    return found
def told():
    gc.collect()
    found = outcome()
    print(("valid", differences(found[1])) if found[0] == "valid" else found)
print(whole)
"""
_AT_ONCE = 32
"""Files that a board gets in its flash: there is room for more, but to open one takes longer."""


class _Files:
    """The two files in a folder, one of them to be written by a trial."""

    def __init__(self, folder: Path) -> None:
        self.paths = (str(folder / USER), str(folder / BOARD))
        self.write(USER, corruption.user_file())
        self.write(BOARD, corruption.board_file())

    def path(self, which: str) -> str:
        return self.paths[0] if which == USER else self.paths[1]

    def write(self, which: str, text: bytes) -> None:
        Path(self.path(which)).write_bytes(text)


def configuration_case(which: str, text: bytes) -> dict[str, Any]:
    """A broken file as a case that can be saved."""
    return {"kind": "configuration", "file": which, "text": text.hex()}


def on_host(which: str, texts: Sequence[bytes]) -> list[Outcome]:
    """What the firmware's code makes of each text on CPython."""
    load: Any = firmware_module("configuration.load")
    names: dict[str, Any] = {}
    exec(_OUTCOME, names)
    before = load.FILE, load.BOARD_FILE
    outcomes = []
    with tempfile.TemporaryDirectory() as folder:
        files = _Files(Path(folder))
        load.FILE, load.BOARD_FILE = files.paths
        try:
            for text in texts:
                files.write(which, text)
                outcomes.append(names["outcome"]())
        finally:
            load.FILE, load.BOARD_FILE = before
    return outcomes


def on_unix(which: str, texts: Sequence[bytes]) -> list[Outcome]:
    """The same on MicroPython's unix port."""
    root = boards.checkout()
    with tempfile.TemporaryDirectory() as folder:
        files = _Files(Path(folder))
        source = Path(folder) / "texts"
        source.write_bytes(b"".join(len(text).to_bytes(4, "little") + text for text in texts))
        program = _OUTCOME + _UNIX.format(
            paths=files.paths, source=str(source), target=files.path(which)
        )
        done = subprocess.run(
            [micropython_image.unix_micropython(), "-c", program],
            env={"MICROPYPATH": f"{root / 'lib'}:{root}:.frozen"},
            capture_output=True,
            text=True,
            timeout=60 + len(texts),
        )
    lines = done.stdout.splitlines()
    if done.returncode or len(lines) != len(texts):
        case = configuration_case(which, texts[min(len(lines), len(texts) - 1)])
        raise Wrong(f"unix port: {done.stdout[-300:]}{done.stderr[-300:]}", case)
    return [ast.literal_eval(line) for line in lines]


def on_board(picos: Picos, which: str, texts: Sequence[bytes]) -> list[Outcome]:
    """The same on the emulated board, from its flash."""
    outcomes = []
    for first in range(0, len(texts), _AT_ONCE):
        outcomes += _on_one_board(picos, which, texts[first : first + _AT_ONCE])
    return outcomes


def _on_one_board(picos: Picos, which: str, texts: Sequence[bytes]) -> list[Outcome]:
    files = {path: data for path, data in picos.files.items() if path != "/main.py"}
    files |= {f"/{USER}": corruption.user_file(), f"/{BOARD}": corruption.board_file()}
    files |= {f"{ON_BOARD}{number}": text for number, text in enumerate(texts)}
    board = Board(picos.image, filesystem.build(files, picos.filesystem_size))
    board.boot()
    whole = ast.literal_eval(board.exec(_OUTCOME + _BOARD))
    path = "FILE" if which == USER else "BOARD_FILE"
    outcomes = []
    for number, text in enumerate(texts):
        try:
            printed = board.exec(f"load.{path} = '{ON_BOARD}{number}'; told()")
        except (TimeoutError, DeviceError) as error:
            case = configuration_case(which, text)
            raise Wrong(f"emulated board: {type(error).__name__}: {error}", case) from error
        kind, *said = ast.literal_eval(printed)
        outcomes.append((kind, _patched(whole, said[0])) if kind == "valid" else (kind, *said))
    return outcomes


def _patched(whole: dict[str, Any], differences: list[Any]) -> dict[str, Any]:
    """All values of a configuration, from what it has in other ways than the whole file."""
    values = {section: dict(named) for section, named in whole.items()}
    for section, *changed in differences:
        if section == "sections":
            values = {name: values.get(name, {}) for name in changed}
        elif section == "missing":
            del values[changed[0]][changed[1]]
        elif section == "outputs":
            values[section] = changed[0]
        else:
            name, value = changed
            values.setdefault(section, {})[name] = value
    return values
