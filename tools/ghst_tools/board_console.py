"""The console of a board whose application runs: command lines go in, lines of JSON come out.

    with BoardConsole("/dev/ttyACM0") as console:
        state = console.ask("config", "config")
        print(state["hash"])

The application goes on: nothing here sends Ctrl-C, and a port is opened as every program opens
it. DTR and RTS rise together, which resets no board (the reset circuit of ESP32 boards needs one
without the other) and which a board with USB of its own waits for before it sends.

What a board says to programs is one line of JSON with the key "ghst", which tells its kind; all
other lines are for people.
"""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Callable
from types import TracebackType
from typing import Any

from ghst_tools.errors import GhstError
from ghst_tools.serial_port import open_port, unplugged

KIND = "ghst"
"""The key of every answer: "ok", "error", or what the command answers with."""

TO = "to"
"""The key that some answers have: the two words behind the command that they are the answer to."""

ANSWER_S = 20.0
"""How long an answer may take: a board may load modules first, and an emulated one is slow."""

_LEAVE_RAW = (
    b"\x02"  # Ctrl-B: from the raw REPL, where a program may have left a board, to the prompt
)
_DROP_LINE = b"\x15"  # Ctrl-U: here and at MicroPython's prompt, what was typed before is gone
_PROMPT = b">>> "
_UNKNOWN = "no command "  # how the application's console begins its answer (firmware/console.py)
_PATIENCE_S = 0.2
_MOST_WAITING = 65536
_WRITE_S = 2.0
_CONNECT_AGAIN = "connect it again, or press its reset button"


class NoApplicationError(GhstError):
    """The board stands at MicroPython's prompt."""


class BoardConsole:
    """An open console, for this program alone; use it in a `with` statement.

    `on_text` is called with each line that is meant for people. Errors are `GhstError`s: no such
    port, busy, no permission, unplugged, no answer, and what the board itself refuses.
    """

    def __init__(self, port: str, on_text: Callable[[str], None] | None = None) -> None:
        """`port`: a serial port, or socket://HOST:PORT of an emulated board."""
        self.port = port
        self._on_text = on_text
        self._received = b""
        self._first = _LEAVE_RAW
        self._line: Any = open_port(port)
        self._line.write_timeout = _WRITE_S

    def __enter__(self) -> BoardConsole:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the port; the application goes on."""
        # RTS first: DTR low and RTS high is what resets an ESP32 board.
        with contextlib.suppress(OSError):
            self._line.rts = False
            self._line.dtr = False
        with contextlib.suppress(OSError):
            self._line.close()

    def send(self, line: str) -> None:
        """Type `line`, ASCII without a line feed, and Enter."""
        with unplugged(self.port, _CONNECT_AGAIN):
            self._line.write(self._first + _DROP_LINE + line.encode("ascii") + b"\r")
        self._first = b""

    def read_line(self, timeout_s: float) -> str | None:
        """The next whole line without its end; None if there is none within `timeout_s`."""
        end = time.monotonic() + timeout_s
        while b"\n" not in self._received:
            if time.monotonic() >= end:
                return None
            self._receive()
        line, _, self._received = self._received.partition(b"\n")
        return line.decode(errors="replace").rstrip("\r")

    def read_message(self, timeout_s: float) -> dict[str, Any] | None:
        """The next line of JSON; None if there is none within `timeout_s`."""
        end = time.monotonic() + timeout_s
        while True:
            line = self.read_line(max(0.0, end - time.monotonic()))
            if line is None:
                return None
            message = message_of(line)
            if message is not None:
                return message
            self._tell(line)

    def ask(self, line: str, kind: str = "ok", timeout_s: float | None = None) -> dict[str, Any]:
        """Send a command, return its answer of this kind; what came before it is passed over.

        Raises `NoApplicationError` at a prompt, `GhstError` with the text of an answer of the
        kind "error", and if there is no answer within `timeout_s` (default: `ANSWER_S`).
        """
        timeout_s = ANSWER_S if timeout_s is None else timeout_s
        asked = " ".join(line.split()[1:3])
        self._drop_waiting()
        self.send(line)
        end = time.monotonic() + timeout_s
        while time.monotonic() < end:
            text = self.read_line(_PATIENCE_S)
            if text is None:
                if self._received.endswith(_PROMPT):
                    raise NoApplicationError(
                        f"{self.port}: the board stands at MicroPython's prompt: main() or Ctrl-D "
                        "there starts the application"
                    )
                continue
            message = message_of(text)
            if message is None:
                if text.startswith(_UNKNOWN):
                    break
                self._tell(text)
            elif message.get(TO, asked) != asked:
                continue  # late: the answer to what was asked before
            elif message[KIND] == "error":
                raise GhstError(f"{self.port}: {message.get('text', 'the board refuses')}")
            elif message[KIND] == kind:
                return message
        else:
            raise GhstError(
                f"{self.port}: no answer within {timeout_s:g} s: does it run micropython-ghst?"
            )
        raise GhstError(
            f"{self.port}: the board does not know {line.split()[0]!r}: its firmware is older "
            "than this program: make flash"
        )

    def _drop_waiting(self) -> None:
        """Pass over what has come already: it may be the answer to an earlier question."""
        with unplugged(self.port, _CONNECT_AGAIN):
            while self._line.in_waiting and len(self._received) < _MOST_WAITING:
                self._received += self._line.read(self._line.in_waiting)
        lines = self._received.split(b"\n")
        self._received = b""
        for line in lines[:-1]:
            text = line.decode(errors="replace").rstrip("\r")
            if message_of(text) is None:
                self._tell(text)

    def _tell(self, text: str) -> None:
        if self._on_text is not None:
            self._on_text(text)

    def _receive(self) -> None:
        """Take what has come, waiting 0.1 s for it."""
        with unplugged(self.port, _CONNECT_AGAIN):
            self._received += self._line.read(max(1, self._line.in_waiting))


def message_of(line: str) -> dict[str, Any] | None:
    """What a line says to programs; None if it is for people."""
    if not line.startswith("{"):
        return None
    try:
        message = json.loads(line)
    except ValueError:
        return None
    return message if isinstance(message, dict) and KIND in message else None
