"""Tables of everything that a board goes by."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rich.table import Table
from rich.text import Text

from ghst_tools.boards import Board
from ghst_tools.configuration.keys import OUTPUTS, flat, points, shown, unit_of
from ghst_tools.configuration.validator import check

_OUTPUTS_BESIDE = 8  # outputs in a table: with more it would not fit on a screen
_DEFAULT = "default"


def tables(values: Mapping[Any, Any], board: Board) -> Iterator[Table]:
    """What is in force, as `validator.check` returns it, with all that is not set marked so."""
    standard = dict(flat(check({}, board)[0]))
    yield _sections(values, standard)
    pins = sorted(values[OUTPUTS])
    for first in range(0, len(pins), _OUTPUTS_BESIDE):
        yield _outputs(values[OUTPUTS], pins[first : first + _OUTPUTS_BESIDE], standard, board)


def _sections(values: Mapping[Any, Any], standard: Mapping[str, Any]) -> Table:
    table = Table("key", "value", "default", box=None, pad_edge=False)
    for section, found in values.items():
        if section == OUTPUTS:
            continue
        for name, value in found.items():
            # What is switched off has no values that are in force.
            if found.get("enabled") is False and name != "enabled":
                continue
            key = f"{section}.{name}" if section else name
            if value == standard[key]:
                table.add_row(key, shown(key, value), Text(_DEFAULT, style="dim"))
            else:
                default = shown(key, standard[key])
                table.add_row(key, Text(shown(key, value), style="bold"), default)
    return table


def _outputs(
    outputs: Mapping[int, Mapping[str, Any]],
    pins: Sequence[int],
    standard: Mapping[str, Any],
    board: Board,
) -> Table:
    labels = [board.label(pin) for pin in pins]
    table = Table("output", *labels, box=None, pad_edge=False, title_justify="left")
    table.add_row("outputs.", *[Text(str(pin), style="bold") for pin in pins])
    for name in outputs[pins[0]]:
        cells = []
        for pin in pins:
            key = f"{OUTPUTS}.{pin}.{name}"
            value = outputs[pin][name]
            # Of an output that the board does not have by default, the declaration's.
            default = standard[key] if key in standard else points(key).default
            text = value if isinstance(value, str) else json.dumps(value)
            cells.append(
                Text(f"({text})", "dim") if value == default else Text(text, style="bold")
            )
        unit = unit_of(f"{OUTPUTS}.{pins[0]}.{name}")
        table.add_row(f"  {name}, {unit}" if unit else f"  {name}", *cells)
    return table
