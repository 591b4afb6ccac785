"""Bytes written as hexadecimal text."""

from __future__ import annotations

import re

from ghst_tools import captures
from ghst_tools.errors import GhstError
from ghst_tools.frames.blocks import Block, Parser, TextParser

_COMMENT = re.compile(rb"#[^\n]*")
_PREFIX = re.compile(rb"\b0[xX](?=[0-9a-fA-F])")
_SEPARATORS = bytes.maketrans(b",;:", b"   ")


class HexParser(TextParser):
    """Two digits a byte, with or without `0x` before them and blanks, `,`, `;`, `:` behind them.

    A digit alone is a byte too. `#` begins a comment. Lines mean nothing: a frame may be split.
    """

    def parse(self, text: bytes, first_line: int) -> Block:
        try:
            return Block(bytes.fromhex(_plain(text).decode("ascii")))
        except ValueError:
            lines = text.split(b"\n")
            octets = [self._line_of(one, number) for number, one in enumerate(lines, first_line)]
            return Block(b"".join(octets))

    def _line_of(self, text: bytes, number: int) -> bytes:
        found = bytearray()
        for word in _plain(text).split():
            try:
                digits = word.decode("ascii")
                found += bytes.fromhex(digits.zfill(2) if len(digits) == 1 else digits)
            except ValueError as error:
                shown = word.decode("utf-8", "replace")
                raise GhstError(
                    f"{self.where}:{number}: {shown!r} is not bytes in hexadecimal: name another "
                    "format with --format, or make it a comment with #"
                ) from error
        return bytes(found)


def _plain(text: bytes) -> bytes:
    text = text.removeprefix(b"\xef\xbb\xbf")  # byte order mark of UTF-8
    if b"#" in text:
        text = _COMMENT.sub(b"", text)
    text = text.translate(_SEPARATORS)
    if b"x" in text or b"X" in text:
        text = _PREFIX.sub(b"", text)
    return text


class Px4Parser(Parser):
    """A capture in the format of PX4's GHST test (`ghst_tools.captures`); read when it is over."""

    def __init__(self, where: str) -> None:
        super().__init__(where)
        self._content = b""

    def feed(self, content: bytes) -> Block:
        self._content += content
        return Block(b"")

    def finish(self) -> Block:
        reads = captures.parse_px4(self._content, self.where)
        return Block(b"".join(octets for octets, _ in reads))
