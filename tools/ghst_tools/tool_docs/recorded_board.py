"""The console of a board that says what a real run of the firmware has said."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import cycle
from pathlib import Path

EVERY_S = 0.2


class RecordedBoard:
    """Answers the console command `status` with the lines of a recording, again and again."""

    def __init__(self, recording: Path) -> None:
        self._lines: Iterator[bytes] = cycle(recording.read_bytes().splitlines())
        self._typed = b""
        self._streaming = False

    def hear(self, octets: bytes) -> bytes:
        """Take what is typed; returns what the board says at once."""
        self._typed += octets
        said = b""
        *commands, self._typed = self._typed.split(b"\r")
        for command in commands:
            name, _, arguments = command.rpartition(b"\x15")[2].strip().partition(b" ")
            if name == b"status":
                self._streaming = arguments not in (b"", b"off")
                said += b'{"ghst": "ok"}\r\n' if arguments == b"off" else self._line()
            elif name:
                said += b"no command '" + name + b"': type help\r\n"
            else:
                said += b"link: linked\r\n"
        return said

    def tick(self) -> bytes:
        """What the board says every `EVERY_S` by itself."""
        return self._line() if self._streaming else b""

    def _line(self) -> bytes:
        return next(self._lines) + b"\r\n"
