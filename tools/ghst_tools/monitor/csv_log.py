"""Status lines as CSV: a line each, and a file that replaces no other."""

from __future__ import annotations

import csv
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from ghst_tools.errors import GhstError
from ghst_tools.files import need_folder


class CsvLog:
    """A new file; its columns are those of the first status.

    `t_s`: seconds since the first line, by the clock of this computer.
    """

    def __init__(self, path: Path) -> None:
        """`GhstError` if there is such a file already, or it cannot be made."""
        need_folder(path)
        try:
            self._file: IO[str] = path.open("x", newline="", encoding="utf-8")
        except FileExistsError:
            raise GhstError(f"{path}: is there already: say another name") from None
        except OSError as error:
            raise GhstError(f"{path}: {error.strerror or error}") from error
        self.path = path
        self.lines = 0
        self._writer = csv.writer(self._file)
        self._columns: list[str] = []
        self._begun_s = 0.0

    def add(self, status: dict[str, Any]) -> None:
        """Write a line; `GhstError` if the disk is full or gone."""
        values = dict(_flat(status))
        now_s = time.monotonic()
        try:
            if not self._columns:
                self._columns = list(values)
                self._begun_s = now_s
                self._writer.writerow(["t_s", *self._columns])
            row = [values.get(column) for column in self._columns]
            self._writer.writerow([f"{now_s - self._begun_s:.3f}", *row])
            self._file.flush()
        except OSError as error:
            raise GhstError(f"{self.path}: {error.strerror or error}") from error
        self.lines += 1

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def new_path(folder: Path) -> Path:
    """A name with the time in it, in `folder`, that no file has yet."""
    stem = time.strftime("ghst-monitor-%Y%m%d-%H%M%S")
    names = [f"{stem}.csv", *(f"{stem}-{number}.csv" for number in range(2, 1000))]
    return next(folder / name for name in names if not (folder / name).exists())


def _flat(status: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Column and value: `channel_1_us`, `output_6_us`, `battery.voltage_mv`, ..."""
    for key, value in status.items():
        if key == "channels_us":
            for number, pulse in enumerate(value, 1):
                yield f"channel_{number}_us", pulse
        elif key == "outputs_us":
            for pin, pulse in value.items():
                yield f"output_{pin}_us", pulse
        elif isinstance(value, dict):
            for name, part in value.items():
                yield f"{key}.{name}", part
        elif key != "ghst":
            yield key, value
