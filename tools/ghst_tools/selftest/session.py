"""The way to the board that tests itself: code goes there, what it prints comes back."""

from __future__ import annotations

import contextlib
import json
import time
from types import TracebackType
from typing import Any, Protocol

from mpremote.transport import TransportError  # type: ignore[import-untyped]

from ghst_tools import hello
from ghst_tools.board_console import BoardConsole
from ghst_tools.board_link import connect
from ghst_tools.errors import GhstError

RESTARTED = "restarted by the watchdog"
"""What the firmware says after its hello."""

HELLO_TIMEOUT_S = 30.0
"""How long the firmware may take to start."""

# Of silence: no step takes a second on a board, and the emulated one is slower by far.
_TIMEOUT_S = 120.0
_LAST_LINE = "main loop: stood still"  # of what the firmware says to Enter


class Session(Protocol):
    """A board at MicroPython's prompt, which keeps what it is told from one call to the next."""

    def run(self, code: str) -> str:
        """Run `code` to its end; returns what it printed. `GhstError` if it raised."""

    def run_into_reset(self, code: str) -> str | None:
        """Run `code`, which ends in a reset of the chip, and let the firmware start.

        Returns what the firmware says then, None if there was no reset; either way the board is
        at the prompt again.
        """


def ask(session: Session, expression: str) -> Any:
    """The value of an expression on the board, by way of JSON."""
    return json.loads(session.run(f"import json\nprint(json.dumps({expression}))"))


class BoardSession:
    """A board on a serial port; its memory is fresh at the beginning."""

    def __init__(self, port: str) -> None:
        self.port = port
        self._stack = contextlib.ExitStack()
        self.transport: Any = None

    def __enter__(self) -> BoardSession:
        self._connect()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stack.__exit__(kind, error, trace)

    def _connect(self) -> None:
        self.transport = self._stack.enter_context(connect(self.port))

    def forget(self) -> None:
        """Restart MicroPython, without `main.py`: what the firmware left in memory goes."""
        self.transport.enter_raw_repl(soft_reset=True, timeout_overall=_TIMEOUT_S)

    def run(self, code: str) -> str:
        output, errors = self.transport.exec_raw(code, timeout=_TIMEOUT_S)
        if errors:
            lines = errors.decode(errors="replace").strip().splitlines()
            raise GhstError(f"{self.port}: the self-test failed on the board: {lines[-1]}")
        return str(output.decode(errors="replace"))

    def run_into_reset(self, code: str) -> str | None:
        self.transport.exec_raw_no_follow(code)
        try:
            self.transport.follow(_TIMEOUT_S)
            return None
        except (OSError, TransportError):
            # The port has gone, and comes back with another device behind it.
            self._stack.close()
        text = hello.wait_for_hello(self.port, HELLO_TIMEOUT_S) + "\n" + self._told()
        self._connect()
        return text

    def _told(self) -> str:
        """What the firmware says when Enter is pressed, as far as `RESTARTED`.

        It answers when it has loaded its sensors.
        """
        lines: list[str] = []
        end = time.monotonic() + HELLO_TIMEOUT_S
        with BoardConsole(self.port) as console:
            console.send("")
            while RESTARTED not in lines and time.monotonic() < end:
                line = console.read_line(end - time.monotonic())
                if line is None or line.startswith(_LAST_LINE):
                    break
                lines.append(line)
        return "\n".join(lines)

    def restart(self) -> str:
        """Reset the board, so that its firmware runs; returns its hello. Ends the session."""
        # It may be in the middle of something.
        self.transport.enter_raw_repl(soft_reset=False)
        self.transport.exec_raw_no_follow("import machine; machine.reset()")
        self._stack.close()
        return hello.wait_for_hello(self.port, HELLO_TIMEOUT_S)
