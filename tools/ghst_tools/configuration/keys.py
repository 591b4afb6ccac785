"""Keys of a configuration, such as `outputs.6.reverse`: the known ones, and values by them."""

from __future__ import annotations

import copy
import difflib
import json
from collections.abc import Iterator, Mapping
from typing import Any

from ghst_tools.boards import Board
from ghst_tools.configuration.validator import DuplicateKeyError, firmware_module, parse
from ghst_tools.errors import GhstError

OUTPUTS = "outputs"


def points(key: str) -> Any:
    """The point that stands at a known key of a value; None for a section."""
    declared = firmware_module("configuration.points")
    section, _, name = key.rpartition(".")
    if section.startswith(f"{OUTPUTS}."):
        found = declared.OUTPUT
    else:
        found = declared.SECTIONS.get(section, ())
    return next((point for point in found if point.name == name), None)


def known(board: Board) -> list[str]:
    """Every key that a file for `board` may have, sections too."""
    declared = firmware_module("configuration.points")
    keys = []
    for section, found in declared.SECTIONS.items():
        keys += [section] if section else []
        keys += [f"{section}.{point.name}" if section else point.name for point in found]
    keys.append(OUTPUTS)
    for pin in sorted(_output_pins(board)):
        keys.append(f"{OUTPUTS}.{pin}")
        keys += [f"{OUTPUTS}.{pin}.{point.name}" for point in declared.OUTPUT]
    return keys


def check_known(key: str, board: Board) -> None:
    """`GhstError` that names the nearest known keys if `key` is none."""
    keys = known(board)
    if key in keys:
        return
    parts = key.split(".")
    if parts[0] == OUTPUTS and 1 < len(parts) <= 3:
        pins = sorted(_output_pins(board))
        if parts[1] not in map(str, pins):
            able = ", ".join(map(str, pins))
            raise GhstError(f"{key}: {parts[1]} is no output of {board.name}: there are {able}")
    # The name alone first: among the values of its section, or of all if it has none.
    section, _, name = key.rpartition(".")
    beside = [other for other in keys if section and other.rpartition(".")[0] == section]
    others = f"{OUTPUTS}.{min(map(int, board.defaults[OUTPUTS]))}."
    pool = beside or [
        other for other in keys if other.startswith(others) or not other.startswith(OUTPUTS)
    ]
    near = difflib.get_close_matches(name, [_last(other) for other in pool], n=3)
    found = [other for other in pool if _last(other) in near]
    if not found and beside:
        names = ", ".join(map(_last, beside))
        raise GhstError(f"{key} is unknown: there are {names}")
    found = found or difflib.get_close_matches(key, keys, n=3)
    if found:
        raise GhstError(f"{key} is unknown: did you mean {' or '.join(found[:3])}?")
    sections = ", ".join(other for other in keys if "." not in other)
    raise GhstError(f"{key} is unknown: there are {sections}")


def _last(key: str) -> str:
    return key.rpartition(".")[2]


def value_at(values: Mapping[Any, Any], key: str) -> Any:
    """The value in force at a known key, or the object of a section, as JSON has it.

    `values`: as `validator.check` returns them. `GhstError` for an output that is not used.
    """
    parts = key.split(".")
    if parts[0] == OUTPUTS and len(parts) > 1:
        pin = int(parts[1])
        if pin not in values[OUTPUTS]:
            raise GhstError(f"{key}: GPIO {pin} is not used as an output")
        found: Any = values[OUTPUTS][pin]
        return found if len(parts) == 2 else found[parts[2]]
    if len(parts) == 2:
        return values[parts[0]][parts[1]]
    return values[key] if key in values else values[""][key]


def parse_value(text: str) -> Any:
    """A value as a user types it: JSON, or else a word."""
    try:
        return parse(text.encode())
    except DuplicateKeyError as error:
        raise GhstError(f"{text}: {error}") from error
    except ValueError:
        return text


def with_value(tree: Mapping[str, Any], key: str, value: Any) -> dict[str, Any]:
    """A copy of what a file says, with `value` at `key`; the rest as it was, in its order."""
    changed = copy.deepcopy(dict(tree))
    inner = changed
    *path, name = key.split(".")
    for depth, part in enumerate(path, 1):
        inner = inner.setdefault(part, {})
        if not isinstance(inner, dict):
            raise GhstError(
                f"{'.'.join(path[:depth])} in the file is no JSON object: set it first"
            )
    inner[name] = value
    return changed


def flat(values: Mapping[Any, Any]) -> Iterator[tuple[str, Any]]:
    """(key, value) of everything that `validator.check` returns, in its order."""
    for section, found in values.items():
        if section == OUTPUTS:
            for pin, output in sorted(found.items()):
                for name, value in output.items():
                    yield f"{OUTPUTS}.{pin}.{name}", value
        else:
            for name, value in found.items():
                yield f"{section}.{name}" if section else name, value


def unit_of(key: str) -> str:
    """The unit of the value at a known key; "" if it has none."""
    return str(points(key).unit)


def shown(key: str, value: Any) -> str:
    """A value with its unit, as people read it."""
    text = json.dumps(value)
    unit = unit_of(key)
    return f"{text} {unit}" if unit and type(value) in (int, float) else text


def _output_pins(board: Board) -> list[int]:
    return [
        gpio
        for gpio, pin in board.pins.items()
        if "gpio" in pin.functions or "output" in pin.functions
    ]
