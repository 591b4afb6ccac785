"""A serial port that is not there: a pseudo-terminal, one end of which is the wire."""

from __future__ import annotations

import os
import pty
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from select import select

PATIENCE_S = 20.0


@dataclass
class Terminal:
    """`port`: what a command opens; `send` and `receive` are the other end."""

    port: str
    descriptor: int

    def send(self, data: bytes) -> None:
        os.write(self.descriptor, data)

    def receive(self, size: int) -> bytes:
        """`size` bytes, as soon as they have come."""
        found = b""
        while len(found) < size:
            assert select([self.descriptor], [], [], PATIENCE_S)[0], f"only {found.hex(' ')}"
            found += os.read(self.descriptor, size - len(found))
        return found

    def silent(self) -> bool:
        """Whether nothing waits."""
        return not select([self.descriptor], [], [], 0)[0]

    def unplug(self) -> None:
        os.close(self.descriptor)
        self.descriptor = -1


@contextmanager
def terminal() -> Iterator[Terminal]:
    ours, theirs = pty.openpty()
    tty.setraw(ours)
    tty.setraw(theirs)
    made = Terminal(os.ttyname(theirs), ours)
    try:
        yield made
    finally:
        os.close(theirs)
        if made.descriptor >= 0:
            made.unplug()
