"""Which formats of recordings there are, how they are told apart, and reading them from a file."""

from __future__ import annotations

import codecs
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from ghst_tools.errors import GhstError
from ghst_tools.files import explained
from ghst_tools.frames.blocks import Block, Parser, RawParser
from ghst_tools.frames.hex_text import HexParser, Px4Parser
from ghst_tools.frames.log import SIGNATURE, LogParser

FORMATS: dict[str, type[Parser]] = {
    "hex": HexParser,
    "raw": RawParser,
    "log": LogParser,
    "px4": Px4Parser,
}

STANDARD_INPUT = Path("-")

_BLOCK_BYTES = 1 << 18
_LOOKED_AT_BYTES = 4096
_POLL_S = 0.1
_TEXT_CONTROLS = frozenset(b"\t\n\r")


def detect(beginning: bytes) -> str:
    """The format of what begins with these bytes; the first 4096 count.

    Text is what is valid UTF-8 and has no control characters but tab and line ends. Text is a log
    if it begins as one, a capture of PX4 if a line begins with `INPUT `, else hexadecimal. All
    else is raw bytes: an address, with which every frame begins, is no valid UTF-8.
    """
    beginning = beginning[:_LOOKED_AT_BYTES]
    if beginning.startswith(SIGNATURE):
        return "log"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(beginning)
    except UnicodeDecodeError:
        return "raw"
    if any(octet < 0x20 and octet not in _TEXT_CONTROLS for octet in beginning):
        return "raw"
    lines = beginning.split(b"\n")
    return "px4" if any(line.startswith(b"INPUT ") for line in lines) else "hex"


class Source:
    """A recording that is read block by block.

    `path` may be `-`, for standard input; `format` is one of FORMATS, or None to find out.
    """

    def __init__(self, path: Path, format: str | None = None, follow: bool = False) -> None:
        self.where = "standard input" if path == STANDARD_INPUT else str(path)
        self.format = format
        self._path = path
        self._follow = follow and path != STANDARD_INPUT
        self._parser: Parser | None = None

    @property
    def baud(self) -> int:
        """The baud rate of the wire; known with the first block."""
        return self._parser.baud if self._parser else Parser.baud

    def blocks(self) -> Iterator[Block]:
        """The blocks, each as soon as it can be had; without end if this follows the file.

        `GhstError` if the file cannot be read, or is not of its format. To be left, when it is
        followed, with KeyboardInterrupt; what is not a whole line then is dropped.
        """
        with explained(self.where):
            if self._path == STANDARD_INPUT:
                yield from self._parsed(_whats_there(sys.stdin.buffer))
                return
            with self._path.open("rb", buffering=0) as file:
                yield from self._parsed(_followed(file) if self._follow else _whats_there(file))

    def _parsed(self, contents: Iterator[bytes]) -> Iterator[Block]:
        for content in contents:
            if self._parser is None:
                self.format = self.format or detect(content)
                self._parser = FORMATS[self.format](self.where)
            yield self._parser.feed(content)
        if self._parser is not None:
            yield self._parser.finish()


def _whats_there(file: IO[bytes]) -> Iterator[bytes]:
    read = getattr(file, "read1", file.read)
    while content := read(_BLOCK_BYTES):
        yield content


def _followed(file: IO[bytes]) -> Iterator[bytes]:
    """As `tail -f`: what is added to the file."""
    while True:
        if content := file.read(_BLOCK_BYTES):
            yield content
            continue
        if os.fstat(file.fileno()).st_size < file.tell():
            raise GhstError(f"{file.name}: became shorter while it was followed: start again")
        time.sleep(_POLL_S)
