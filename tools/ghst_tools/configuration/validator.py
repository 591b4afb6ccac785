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
from ghst_tools.files import explained


class DuplicateKeyError(ValueError):
    """A key stands more than once in an object; of the values JSON parsers keep one."""

    def __init__(self, key: str) -> None:
        super().__init__(f"the key {json.dumps(key)} stands more than once in an object")
        self.key = key


_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[{}\[\],:]|[^\s{}\[\],:"]+')


def firmware_module(name: str) -> ModuleType:
    """A module of the firmware, such as "configuration.points"."""
    root = str(boards.resources())
    if root not in sys.path:
        sys.path.append(root)
    return importlib.import_module(f"firmware.{name}")


def check(tree: object, board: boards.Board) -> tuple[Mapping[Any, Any], list[tuple[str, str]]]:
    """What the board makes of a parsed file: values, and (key, text) of each problem."""
    checker = firmware_module("configuration.check")
    values, problems = checker.check(tree, json.loads(board.definition))
    return values, problems


def check_file(path: Path, board: boards.Board) -> list[str]:
    """A line for each problem of a file, with the line in the file; none if all is well.

    `GhstError` if the file cannot be read.
    """
    with explained(path):
        content = path.read_bytes()
    return check_content(content, str(path), board)


def check_content(content: bytes, name: str, board: boards.Board) -> list[str]:
    """A line for each problem of a file's contents, as `check_file`; `name` is what it is called.

    A key that stands there twice is a problem, too: the board takes the last one.
    """
    largest = firmware_module("json_text").LARGEST
    if len(content) > largest:
        return [f"{name}: {len(content)} bytes, must be at most {largest}"]
    try:
        tree = parse(content)
    except json.JSONDecodeError as error:
        return [f"{name}:{error.lineno}: not valid JSON: {error.msg}"]
    except DuplicateKeyError as error:
        return [_duplicate(content.decode(), name, error)]
    except (ValueError, RecursionError) as error:
        return [f"{name}: not valid JSON: {error}"]
    lines = dict(_keys(content.decode()))
    _, problems = check(tree, board)
    return [f"{name}:{_line(lines, key)}: {problem}" for key, problem in problems]


def parse(content: bytes) -> Any:
    """What JSON text in UTF-8 says; `ValueError` if it is none, or has a key twice."""
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ValueError(f"line {line} is not UTF-8") from error
    tree = json.loads(text, parse_constant=_no_number)
    # Once more, so that what is no JSON at all is told first.
    json.loads(text, object_pairs_hook=_need_unique)
    return tree


def _no_number(name: str) -> Any:
    raise ValueError(f"{name} is no number")


def _need_unique(pairs: list[tuple[str, Any]]) -> None:
    seen = set()
    for key, _ in pairs:
        if key in seen:
            raise DuplicateKeyError(key)
        seen.add(key)


def _duplicate(text: str, name: str, error: DuplicateKeyError) -> str:
    """The line that tells of a duplicate key in valid JSON, with the places of both."""
    first: dict[str, int] = {}
    for key, line in _keys(text):
        if key in first and key.endswith(error.key):
            return f"{name}:{line}: {key} stands there a second time, the first is in line " + str(
                first[key]
            )
        first.setdefault(key, line)
    return f"{name}: {error}"


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
