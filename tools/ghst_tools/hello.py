"""Waits for the firmware's hello on a board that has just been reset."""

import contextlib
import re
import time
from typing import Any

import serial  # type: ignore[import-untyped]

from ghst_tools.errors import GhstError
from ghst_tools.serial_port import open_port

HELLO = re.compile(r"micropython-ghst \d")
"""What the application's first line on the console begins with: its name and version."""

TIMEOUT_S = 10.0

# A board that restarts leaves USB. What it said before the port was open again may be lost, and
# Enter makes the application say it again. One that does not run is started by a soft reset after
# this time without a word, and after twice as long each next time, for one that is slow to start.
_ASK_AGAIN_S = 3.0
_ENTER_S = 0.5
_ENTER = b"\r"
_SOFT_RESET = b"\r\x03\x03\x02\x04"


def wait_for_hello(port: str, timeout_s: float = TIMEOUT_S) -> str:
    """Wait until the application says hello on the console; returns that line.

    The port may vanish and come back meanwhile. `GhstError` quotes the last error that the board
    showed; it comes before the time is over if the application has ended.
    """
    end = time.monotonic() + timeout_s
    console = _Console(port)
    patience_s = _ASK_AGAIN_S
    ask_at = time.monotonic() + patience_s
    enter_at = time.monotonic() + _ENTER_S
    restarted_at: int | None = None
    ended = False
    with contextlib.closing(console):
        while not ended and time.monotonic() < end:
            if console.read():
                ask_at = time.monotonic() + patience_s
            for line in console.text.split("\n")[:-1]:
                if HELLO.match(line):
                    return line.strip()
            if restarted_at is not None:
                # The prompt: main.py is over.
                _, restarted, text = console.text[restarted_at:].partition("soft reboot")
                ended = bool(restarted) and text.endswith("\n>>> ")
            # Once: at a prompt each would be answered, and there would be no silence any more.
            if time.monotonic() > enter_at and console.write(_ENTER):
                enter_at = end
            if time.monotonic() > ask_at and console.write(_SOFT_RESET):
                restarted_at = len(console.text)
                patience_s *= 2
                ask_at = time.monotonic() + patience_s
    when = "it has ended" if ended else f"waited {timeout_s:.0f} s"
    errors = re.findall(r"^\w*(?:Error|Exception|Interrupt)\b.*$", console.text, re.MULTILINE)
    shown = f"the last error it showed is {errors[-1].strip()}" if errors else "no error was shown"
    if not console.opened:
        raise GhstError(f"{port}: the board did not come back within {timeout_s:.0f} s")
    raise GhstError(f"{port}: no hello from the firmware ({when}): {shown}")


class _Console:
    """A serial port that may be gone for a while, and the text that came from it."""

    def __init__(self, port: str) -> None:
        self._port = port
        self._line: Any = None
        self._received = b""
        self.opened = False

    @property
    def text(self) -> str:
        return self._received.decode(errors="replace").replace("\r\n", "\n")

    def read(self) -> bool:
        """Take what has come, waiting 0.1 s for it; open the port first if need be.

        Returns whether anything came.
        """
        try:
            if self._line is None:
                self._line = open_port(self._port)
                self.opened = True
            data = self._line.read(256)
        except (GhstError, serial.SerialException):
            self.close()
            time.sleep(0.1)
            return False
        self._received += data
        return bool(data)

    def write(self, data: bytes) -> bool:
        """Send, if the port is open; returns whether."""
        if self._line is None:
            return False
        try:
            self._line.write(data)
        except serial.SerialException:
            self.close()
            return False
        return True

    def close(self) -> None:
        line, self._line = self._line, None
        if line is not None:
            with contextlib.suppress(serial.SerialException, OSError):
                line.close()
