"""Sticks from a file: CSV, or JSON lines as `ghst decode --json` prints them."""

from __future__ import annotations

import csv
import json
import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from ghst_tools.errors import GhstError
from ghst_tools.files import explained
from ghst_tools.simulate.sticks import CHANNELS, Pulses, at_rest

# What a channel can be told: beyond this no frame carries it.
_LOWEST_US, _HIGHEST_US = 880, 2160
_TIMES = ("t", "t_s", "time", "time_s", "seconds")
_CHANNEL = re.compile(r"(?:ch|channel)[ _]?(\d+)(?:_us)?", re.IGNORECASE)


class Row(NamedTuple):
    """A line: when, and channel index -> quarter microseconds of those that it names."""

    t_s: float
    changes: dict[int, int]


class StickFile:
    """Holds what each line says until the next; `loop`: begins again behind the last.

    The first line is the beginning, whatever its time. The last line is held as long as the one
    before it.
    """

    def __init__(self, path: Path, loop: bool = False) -> None:
        """`GhstError` names the line that is wrong."""
        rows = _read(path)
        if not rows:
            raise GhstError(f"{path}: no line with a time and channels in microseconds")
        for number, (before, row) in enumerate(pairwise(rows), 2):
            if row.t_s < before.t_s:
                raise GhstError(
                    f"{path}: entry {number}: the time goes back from {before.t_s} to {row.t_s} s"
                )
        self._times = [row.t_s - rows[0].t_s for row in rows]
        self._states: list[Pulses] = []
        state = at_rest()
        for row in rows:
            for index, pulse in row.changes.items():
                state[index] = pulse
            self._states.append(list(state))
        last_s = self._times[-1] - self._times[-2] if len(rows) > 1 else 1.0
        self._length_s = self._times[-1] + (last_s or 1.0)
        self._loop = loop
        self.end_s = None if loop else self._length_s

    def pulses(self, t_s: float) -> Pulses:
        """As `Sticks.pulses`."""
        if self._loop:
            t_s %= self._length_s
        # Times of a file are decimal: what is equal but for rounding is equal.
        at = bisect_right(self._times, t_s + 1e-9) - 1
        return list(self._states[at])


def _read(path: Path) -> list[Row]:
    with explained(path):
        content = path.read_bytes()
    try:
        lines = content.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise GhstError(f"{path}: not text in UTF-8") from error
    first = next((line for line in map(str.strip, lines) if line), "")
    read = _json_rows if first.startswith("{") else _csv_rows
    return list(read(path, lines))


def _json_rows(path: Path, lines: Iterable[str]) -> Iterator[Row]:
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        where = f"{path}:{number}"
        try:
            entry = json.loads(line)
        except ValueError as error:
            raise GhstError(f"{where}: not an object of JSON in one line") from error
        if not isinstance(entry, dict):
            raise GhstError(f"{where}: not an object of JSON")
        if entry.get("channels_us") is None:
            continue  # a frame without channels
        values = entry["channels_us"]
        if not isinstance(values, list) or len(values) > CHANNELS:
            raise GhstError(f"{where}: channels_us is no list of at most {CHANNELS} numbers")
        yield _row(where, entry.get("t"), list(enumerate(values)))


def _csv_rows(path: Path, lines: list[str]) -> Iterator[Row]:
    time_at, columns = 0, dict(enumerate(range(CHANNELS), 1))
    begun = False
    for number, cells in enumerate(csv.reader(lines), 1):
        cells = [cell.strip() for cell in cells]
        if not any(cells) or cells[0].startswith("#"):
            continue
        where = f"{path}:{number}"
        if not begun and not _is_number(cells[0]):
            time_at, columns = _header(where, cells)
        elif len(cells) <= time_at:
            raise GhstError(f"{where}: no time in it")
        else:
            named = [(index, cells[at]) for at, index in columns.items() if at < len(cells)]
            yield _row(where, cells[time_at], named)
        begun = True


def _header(where: str, cells: list[str]) -> tuple[int, dict[int, int]]:
    """Column of the time, and column -> channel index; other columns are left alone."""
    times = [at for at, cell in enumerate(cells) if cell.lower() in _TIMES]
    named = {at: found for at, cell in enumerate(cells) if (found := _CHANNEL.fullmatch(cell))}
    columns = {at: int(found[1]) - 1 for at, found in named.items()}
    columns = {at: index for at, index in columns.items() if 0 <= index < CHANNELS}
    if not times or not columns:
        raise GhstError(f"{where}: name the columns t, ch1, ch2 ... to ch{CHANNELS}")
    return times[0], columns


def _row(where: str, time: Any, values: list[tuple[int, Any]]) -> Row:
    if not _is_number(time):
        raise GhstError(f"{where}: the time is {time!r}, must be a number of seconds")
    changes = {}
    for index, value in values:
        if value is None or value == "":
            continue
        if not _is_number(value) or not _LOWEST_US <= float(value) <= _HIGHEST_US:
            raise GhstError(
                f"{where}: channel {index + 1} is {value!r}, must be {_LOWEST_US} to "
                f"{_HIGHEST_US} us"
            )
        changes[index] = round(4 * float(value))
    return Row(float(time), changes)


def _is_number(value: Any) -> bool:
    if isinstance(value, bool):
        return False
    try:
        return abs(float(value)) < float("inf")
    except (TypeError, ValueError):
        return False
