"""The log of a recording, while it is being written."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import IO

from ghst_tools.errors import GhstError
from ghst_tools.files import explained, need_folder
from ghst_tools.frames import log

_FLUSH_EVERY_S = 0.2


class LogFile:
    """A log that grows; None for a path: none is kept."""

    def __init__(self, path: Path | None) -> None:
        self.path = path
        self._file: IO[str] | None = None
        self._flushed_s = 0.0

    @contextlib.contextmanager
    def open(self, source: str, baud: int) -> Iterator[None]:
        """Keep the log open. `GhstError` if the file exists: no recording is ever overwritten."""
        if self.path is None:
            yield
            return
        need_folder(self.path)
        with explained(self.path):
            try:
                self._file = self.path.open("x", encoding="ascii")
            except FileExistsError as error:
                raise GhstError(f"{self.path}: exists already: name a new file") from error
        try:
            with explained(self.path):
                self._file.write(log.header(source, datetime.now().astimezone(), baud))
            yield
        finally:
            with explained(self.path):
                self._file.close()

    def add(self, time_s: float, data: bytes) -> None:
        """Append one read. Whoever follows the file sees it within a fifth of a second."""
        if self._file is None:
            return
        with explained(str(self.path)):
            self._file.write(log.line(time_s, data))
            if time_s - self._flushed_s >= _FLUSH_EVERY_S:
                self._flushed_s = time_s
                self._file.flush()
