"""The firmware's own validator, of this checkout, and where in a file its complaints are."""

from __future__ import annotations

import importlib
import json
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from ghst_tools import boards
from ghst_tools.errors import GhstError

_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[{}\[\],:]|[^\s{}\[\],:"]+')


def firmware_module(name: str) -> ModuleType:
    """A module of the checkout's `firmware.configuration`."""
    root = str(boards.checkout())
    if root not in sys.path:
        sys.path.append(root)
    return importlib.import_module(f"firmware.configuration.{name}")


def check(tree: object, board: boards.Board) -> tuple[Mapping[Any, Any], list[tuple[str, str]]]:
    """What the board makes of a parsed file: values, and (key, text) of each problem."""
    checker = firmware_module("check")
    values, problems = checker.check(tree, json.loads(board.definition))
    return values, problems


def check_file(path: Path, board: boards.Board) -> list[str]:
    """A line for each problem of a file, with the line in the file; none if all is well.

    `GhstError` if the file cannot be read.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not UTF-8"
        raise GhstError(f"{path}: {reason}") from error
    try:
        tree = json.loads(text, parse_constant=_no_number)
    except json.JSONDecodeError as error:
        return [f"{path}:{error.lineno}: not valid JSON: {error.msg}"]
    except ValueError as error:
        return [f"{path}: not valid JSON: {error}"]
    lines = dict(_keys(text))
    _, problems = check(tree, board)
    return [f"{path}:{_line(lines, key)}: {problem}" for key, problem in problems]


def _no_number(name: str) -> None:
    raise ValueError(f"{name} is no number")


def _line(lines: Mapping[str, int], key: str) -> int:
    # What is missing is missed where its section begins.
    while key and key not in lines:
        key = key.rpartition(".")[0]
    return lines.get(key, 1)


def _keys(text: str) -> Iterator[tuple[str, int]]:
    """Each key of valid JSON text, such as "outputs.6.channel", with its line."""
    path: list[str] = []
    objects: list[bool] = []
    wanted = False
    for match in _TOKEN.finditer(text):
        token = match[0]
        if token in "{[":
            objects.append(token == "{")
            wanted = token == "{"
            path.append("")
        elif token in "}]":
            objects.pop()
            path.pop()
            wanted = False
        elif token == ",":
            wanted = objects[-1]
        elif token == ":":
            wanted = False
        elif wanted:
            path[-1] = json.loads(token)
            yield ".".join(part for part in path if part), text.count("\n", 0, match.start()) + 1
