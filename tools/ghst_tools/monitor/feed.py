"""Reads the status lines of a board in a thread, so that no view waits for the board."""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from typing import Any

from ghst_tools.board_console import ANSWER_S, BoardConsole
from ghst_tools.errors import GhstError
from ghst_tools.serial_port import is_network

_PATIENCE_S = 0.2
# A board that has been restarted says nothing before it is asked again.
_ASK_AGAIN_S = 5.0
_EMULATED_S = 600.0  # how long an emulated board may take to answer

Item = dict[str, Any] | str | GhstError


class Feed:
    """The console of a board that says its status again and again; use it in a `with` statement.

    The application on the board goes on: it is sent the command `status`, and at the end
    `status off`.
    """

    def __init__(self, port: str, interval_ms: int) -> None:
        """Opens the port; raises what `BoardConsole` does, also when the board does not answer."""
        self._items: queue.Queue[Item] = queue.Queue()
        self._stopping = threading.Event()
        self._ask = f"status {interval_ms}"
        self._console = BoardConsole(port, self._tell)
        try:
            patience_s = _EMULATED_S if is_network(port) else ANSWER_S
            self._items.put(self._console.ask(self._ask, "status", patience_s))
        except BaseException:
            self._console.close()
            raise
        self.port = port
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def __enter__(self) -> Feed:
        return self

    def __exit__(self, *details: object) -> None:
        self._stopping.set()
        self._thread.join()
        with contextlib.suppress(GhstError):
            self._console.send("status off")
        self._console.close()

    def _tell(self, text: str) -> None:
        # What an earlier reader has left of a line of JSON says nothing to anybody.
        if not text.endswith("}"):
            self._items.put(text)

    def send(self, line: str) -> None:
        """Send a command line; `GhstError` if the port is gone."""
        self._console.send(line)

    def take(self, timeout_s: float | None = None) -> Item | None:
        """The next message, line for people, or error that ended the reading; None = nothing.

        `timeout_s`: how long to wait for one.
        """
        try:
            return self._items.get(timeout_s is not None, timeout_s)
        except queue.Empty:
            return None

    def _run(self) -> None:
        heard_s = time.monotonic()
        try:
            while not self._stopping.is_set():
                message = self._console.read_message(_PATIENCE_S)
                if message is not None:
                    self._items.put(message)
                    heard_s = time.monotonic()
                elif time.monotonic() - heard_s > _ASK_AGAIN_S:
                    self._console.send(self._ask)
                    heard_s = time.monotonic()
        except GhstError as error:
            self._items.put(error)
