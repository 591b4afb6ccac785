"""The configuration on a board, over its serial port: read, checked there, replaced.

A running application is asked on its console, and goes on. A board at MicroPython's prompt runs
the same code (`firmware/config_command.py`) in the raw REPL.
"""

from __future__ import annotations

import base64
import contextlib
import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from mpremote.transport import TransportError  # type: ignore[import-untyped]

from ghst_tools import board_console
from ghst_tools.board_console import KIND, BoardConsole, NoApplicationError, message_of
from ghst_tools.board_link import connect
from ghst_tools.doctor.ports import only_board
from ghst_tools.errors import GhstError

FILE = "/ghst.json"

_PIECE = 45  # bytes: 60 characters of base64, and the console takes 80
_ATTEMPTS = 3
_LOAD = "from firmware.config_command import ConfigCommand\n_config = ConfigCommand()"

Ask = Callable[[str, str], dict[str, Any]]


@dataclass(frozen=True)
class State:
    """What a board says of its configuration."""

    board: str
    """Name in boards/."""
    id: str
    """The chip's number, in hex."""
    version: str
    """Of the firmware."""
    link: str | None
    """"searching", "linked" or "failsafe"; None at MicroPython's prompt."""
    problems: tuple[str, ...]
    """Why nothing moves; none if all is well."""
    size: int
    """Bytes of the file; 0 if there is none."""
    hash: str | None
    """Of the file; None if there is none."""
    restart: bool
    """Whether the file was replaced since the application started."""

    @property
    def linked(self) -> bool:
        """Whether writing flash would stop interrupts that are needed."""
        return self.link == "linked"


class BoardConfiguration:
    """What `open_configuration` gives; `ask(line, kind)` has the board answer a line."""

    def __init__(self, port: str, ask: Ask) -> None:
        self.port = port
        self._ask = ask

    def state(self) -> State:
        """What the board has, and what is in force."""
        answer = self._ask("config", "config")
        try:
            return State(
                board=answer["board"],
                id=answer["id"],
                version=answer["version"],
                link=answer["link"],
                problems=tuple(answer["problems"]),
                size=answer["size"] or 0,
                hash=answer["hash"],
                restart=answer["restart"],
            )
        except KeyError as error:
            raise GhstError(
                f"{self.port}: the board does not tell its {error}: flash this firmware (make "
                "flash)"
            ) from error

    def read(self) -> tuple[State, bytes | None]:
        """The state, and the file byte for byte; None if there is none."""
        for _ in range(_ATTEMPTS):
            state = self.state()
            if state.hash is None:
                return state, None
            content = b""
            while len(content) < state.size:
                answer = self._ask(f"config read {len(content)}", "config")
                piece = base64.b64decode(answer["data"])
                if not piece:
                    break
                content += piece
            # The board may have saved something of its own meanwhile.
            if digest(content) == state.hash:
                return state, content
        raise GhstError(f"{self.port}: {FILE} changes while it is read: try again")

    def send(self, content: bytes, base: str | None) -> list[tuple[str, str]]:
        """Send a new file, to be saved by `save`; returns (key, text) of each problem it has.

        `base`: the hash of the file that it may replace, None if there is none there.
        """
        self._ask(f"config begin {len(content)} {base or '-'}", "ok")
        for at in range(0, len(content), _PIECE):
            piece = base64.b64encode(content[at : at + _PIECE]).decode()
            self._ask(f"config put {at} {piece}", "ok")
        answer = self._ask(f"config check {digest(content)}", "config")
        return [(key, text) for key, text in answer["problems"]]

    def save(self, force: bool) -> int:
        """Make what was sent the board's file; returns how many ms that took.

        `force`: even while the link is up.
        """
        return int(self._ask("config save force" if force else "config save", "ok")["ms"])

    def restart(self, force: bool) -> None:
        """Have the board begin anew; the port is of no more use then."""
        self._ask("config restart force" if force else "config restart", "ok")


def port_or_found(port: str | None) -> str:
    """`port`, or that of the one board on USB.

    One with a USB-serial bridge is not looked for: another might be at the Ghost wire.
    """
    return port or only_board()


def digest(content: bytes) -> str:
    """The hash of a file, as boards tell it."""
    return hashlib.sha256(content).hexdigest()[:16]


@contextlib.contextmanager
def open_configuration(port: str) -> Iterator[BoardConfiguration]:
    """Connect to the application on a board, or to MicroPython's prompt if it stands there."""
    with contextlib.ExitStack() as stack:
        console = stack.enter_context(BoardConsole(port))
        try:
            console.ask("config", "config")
        except NoApplicationError:
            console.close()
            transport = stack.enter_context(connect(port))
            stack.callback(_leave, transport)
            yield BoardConfiguration(port, _prompt(port, transport))
        else:
            yield BoardConfiguration(port, console.ask)


def _prompt(port: str, transport: Any) -> Ask:
    """Has the firmware's code answer lines in the raw REPL."""

    def run(code: str) -> str:
        printed, error = transport.exec_raw(code, timeout=board_console.ANSWER_S)
        if error:
            raise GhstError(f"{port}: the board failed: {error.decode().strip().splitlines()[-1]}")
        return str(printed.decode(errors="replace"))

    try:
        run(_LOAD)
    except GhstError as error:
        raise GhstError(
            f"{port}: there is no micropython-ghst on the board: make flash"
        ) from error

    def ask(line: str, kind: str) -> dict[str, Any]:
        arguments = line.partition(" ")[2]
        if arguments.startswith("restart"):
            # The board is gone before it can answer.
            transport.exec_raw_no_follow("import machine; machine.reset()")
            return {KIND: kind}
        printed = run(f"_config({arguments!r})")
        for text in printed.splitlines():
            message = message_of(text)
            if message is not None and message[KIND] == "error":
                raise GhstError(f"{port}: {message['text']}")
            if message is not None and message[KIND] == kind:
                return message
        raise GhstError(f"{port}: no answer from the firmware's code: {printed.strip()[-80:]!r}")

    return ask


def _leave(transport: Any) -> None:
    """Back to the friendly prompt; the board may be gone."""
    with contextlib.suppress(TransportError, OSError):
        transport.exit_raw_repl()
