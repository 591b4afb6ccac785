"""Bytes of the wire in pieces, as they come out of a file."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from ghst.protocol import BAUD_RATE  # type: ignore[import-not-found]
from ghst_tools.frames.timeline import Reads


@dataclass(frozen=True)
class Block:
    """Bytes of the wire; `reads` tells when they came, None if the file does not."""

    data: bytes
    reads: Reads | None = None


class Parser(ABC):
    """Turns the content of a file into bytes of the wire; `where` names it in errors."""

    baud: int = BAUD_RATE

    def __init__(self, where: str) -> None:
        self.where = where

    @abstractmethod
    def feed(self, content: bytes) -> Block:
        """Take what follows in the file, of any size. `GhstError` names a line that is wrong."""

    @abstractmethod
    def finish(self) -> Block:
        """The file is over."""


class RawParser(Parser):
    """The bytes themselves."""

    def feed(self, content: bytes) -> Block:
        return Block(content)

    def finish(self) -> Block:
        return Block(b"")


class TextParser(Parser):
    """Splits text into whole lines, for parsers of lines."""

    def __init__(self, where: str) -> None:
        super().__init__(where)
        self._rest = b""
        self._line = 1

    def feed(self, content: bytes) -> Block:
        text = self._rest + content
        end = text.rfind(b"\n") + 1
        text, self._rest = text[:end], text[end:]
        return self._parse(text)

    def finish(self) -> Block:
        text, self._rest = self._rest, b""
        return self._parse(text)

    def _parse(self, text: bytes) -> Block:
        first = self._line
        self._line += text.count(b"\n")
        return self.parse(text, first)

    @abstractmethod
    def parse(self, text: bytes, first_line: int) -> Block:
        """Read whole lines, the first of which has this number in the file."""
