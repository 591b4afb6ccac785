"""Single key presses from the terminal, on Linux, macOS and Windows."""

from __future__ import annotations

import contextlib
import os
import select
import sys
from collections.abc import Iterator
from typing import Any

from ghst_tools.errors import GhstError

# What terminals and Windows' console send for the arrow keys.
_ARROWS = {"A": "up", "B": "down", "C": "right", "D": "left"}
_WINDOWS_ARROWS = {"H": "up", "P": "down", "M": "right", "K": "left"}
_READ_BYTES = 64


def split(text: str) -> list[str]:
    """The keys in what a terminal sends: characters, or `up`, `down`, `left`, `right`.

    Other keys that send an escape sequence are left out.
    """
    found = []
    at = 0
    while at < len(text):
        if text[at] != "\x1b":
            found.append(text[at])
            at += 1
            continue
        at += 1
        if at < len(text) and text[at] in "[O":
            at += 1
            while at < len(text) and not text[at].isalpha() and text[at] != "~":
                at += 1
            if at < len(text) and text[at] in _ARROWS:
                found.append(_ARROWS[text[at]])
            at += 1
    return found


class Keys:
    """Reads keys as they are pressed; `with` changes the terminal and restores it at the end.

    Ctrl-C still interrupts. `GhstError` if the standard input is no terminal.
    """

    def __init__(self) -> None:
        self._restoring = contextlib.ExitStack()

    def __enter__(self) -> Keys:
        if not sys.stdin.isatty():
            raise GhstError("--keyboard: the standard input is no terminal: run it in one")
        if sys.platform != "win32":
            self._restoring.enter_context(_one_by_one(sys.stdin.fileno()))
        return self

    def __exit__(self, *details: object) -> None:
        self._restoring.close()

    def pressed(self) -> list[str]:
        """The keys since the last call; does not wait."""
        if sys.platform == "win32":
            return _pressed_on_windows()
        descriptor = sys.stdin.fileno()
        if not select.select([descriptor], [], [], 0)[0]:
            return []
        return split(os.read(descriptor, _READ_BYTES).decode("utf-8", "ignore"))


@contextlib.contextmanager
def _one_by_one(descriptor: int) -> Iterator[None]:
    import termios
    import tty

    before = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor)
        yield
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


def _pressed_on_windows() -> list[str]:
    import msvcrt

    console: Any = msvcrt
    found = []
    while console.kbhit():
        key = console.getwch()
        if key in ("\x00", "\xe0"):
            key = _WINDOWS_ARROWS.get(console.getwch(), "")
        if key:
            found.append(key)
    return found
