"""The log of `ghst sniff`: what was read from the wire, and when.

    # ghst log 1
    # 420000 baud, /dev/ttyUSB0, 2026-05-01T12:00:00+02:00
    # seconds since the beginning, when the last byte was there; the bytes of one read
    0.018274 820c1088f37ec4477c7c7c7c7c9a
    0.019651 890c239006900b7b000000000069

One line for each read from the serial port. Lines that begin with `#` are comments.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime

import numpy as np

from ghst.protocol import BAUD_RATE  # type: ignore[import-not-found]
from ghst_tools.errors import GhstError
from ghst_tools.frames.blocks import Block, TextParser
from ghst_tools.frames.timeline import Reads

SIGNATURE = b"# ghst log "
_VERSION = 1
_NO_READ = (b"", b"#")
_BAUD = re.compile(rb"^#.*?\b(\d+) baud\b", re.MULTILINE)


def header(source: str, begun: datetime, baud: int = BAUD_RATE) -> str:
    """The first lines of a log."""
    return (
        f"{SIGNATURE.decode()}{_VERSION}\n"
        f"# {baud} baud, {source}, {begun.isoformat(timespec='seconds')}\n"
        "# seconds since the beginning, when the last byte was there; the bytes of one read\n"
    )


def line(time_s: float, data: bytes) -> str:
    """One line of a log."""
    return f"{time_s:.6f} {data.hex()}\n"


class LogParser(TextParser):
    """Reads a log."""

    def __init__(self, where: str) -> None:
        super().__init__(where)
        self._last_s = 0.0

    def parse(self, text: bytes, first_line: int) -> Block:
        self._read_header(text, first_line)
        lines = [line for line in map(bytes.strip, text.split(b"\n")) if line[:1] not in _NO_READ]
        words = b" ".join(lines).split()
        try:
            return self._block(words[0::2], words[1::2], len(lines))
        except ValueError:
            self._explain(text, first_line)
            raise

    def finish(self) -> Block:
        """The file is over. A last line that was cut off, in a recording that was, is left out."""
        try:
            return super().finish()
        except GhstError:
            return Block(b"", Reads(np.zeros(0, np.int64), np.zeros(0)))

    def _block(self, times: Sequence[bytes], data: Sequence[bytes], count: int) -> Block:
        sizes = np.fromiter(map(len, data), np.int64, len(data))
        if len(times) != len(data) or len(data) != count or np.any(sizes % 2):
            raise ValueError("not a time and whole bytes in every line")
        times_s = np.array(times, "S").astype(np.float64) if times else np.zeros(0)
        if np.any(np.diff(times_s, prepend=self._last_s) < 0) or not np.all(np.isfinite(times_s)):
            raise ValueError("the time goes back")
        octets = bytes.fromhex(b"".join(data).decode("ascii"))
        if len(times_s):
            self._last_s = float(times_s[-1])
        return Block(octets, Reads(np.cumsum(sizes // 2), times_s))

    def _read_header(self, text: bytes, first_line: int) -> None:
        if first_line != 1:
            return
        version = text.removeprefix(SIGNATURE).split(b"\n")[0].strip()
        if text.startswith(SIGNATURE) and version != str(_VERSION).encode():
            raise GhstError(
                f"{self.where}: a log of version {version.decode(errors='replace')}, this ghst "
                f"reads version {_VERSION}: use the ghst that wrote it"
            )
        if (baud := _BAUD.search(text)) and int(baud[1]) > 0:
            self.baud = int(baud[1])

    def _explain(self, text: bytes, first_line: int) -> None:
        """Raise a `GhstError` for the first line that is wrong."""
        for number, one in enumerate(text.split(b"\n"), first_line):
            if one.strip()[:1] in _NO_READ:
                continue
            words = one.split()
            before_s = self._last_s
            try:
                self._block(words[0::2], words[1::2], 1)
            except ValueError as error:
                where = f"{self.where}:{number}"
                if len(words) == 2 and _is_earlier(words[0], before_s):
                    raise GhstError(
                        f"{where}: the time goes back, from {before_s:.6f} to "
                        f"{words[0].decode()}: is this more than one recording?"
                    ) from error
                raise GhstError(
                    f"{where}: not a time in seconds and bytes in hexadecimal"
                ) from error


def _is_earlier(word: bytes, before_s: float) -> bool:
    try:
        return float(word) < before_s
    except ValueError:
        return False
