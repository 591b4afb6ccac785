"""A TCP port that stands for a serial port: pyserial opens it as `socket://127.0.0.1:PORT`."""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Callable, Sequence

from ghst_tools.errors import GhstError

_CHUNK = 4096


class TcpPort:
    """Listens on 127.0.0.1; serves one client at a time, and hangs up on a second one.

    `received` is called with what the client sends, `opened` when there is one. `port` 0 lets the
    system choose; `address` tells. `GhstError` if the port is taken.
    """

    def __init__(
        self,
        received: Callable[[bytes], None],
        port: int = 0,
        opened: Callable[[], None] = lambda: None,
    ) -> None:
        self._received = received
        self._opened = opened
        self._client: socket.socket | None = None
        try:
            self._listener = socket.create_server(("127.0.0.1", port))
        except OSError as error:
            raise GhstError(f"TCP port {port}: {error.strerror}") from error

    @property
    def address(self) -> str:
        """What to give pyserial as the port."""
        return f"socket://127.0.0.1:{self._listener.getsockname()[1]}"

    @property
    def connected(self) -> bool:
        """Whether there is a client."""
        return self._client is not None

    def send(self, data: bytes) -> None:
        """Send to the client, if there is one."""
        if self._client is None or not data:
            return
        try:
            self._client.sendall(data)
        except OSError:
            self.hang_up()

    def hang_up(self) -> None:
        """Let the client go."""
        if self._client is not None:
            self._client.close()
            self._client = None

    def close(self) -> None:
        """Hang up and stop listening."""
        self.hang_up()
        self._listener.close()

    @property
    def sources(self) -> list[socket.socket]:
        """What to wait for."""
        return [self._listener, *([self._client] if self._client else [])]

    def attend(self, ready: Sequence[socket.socket]) -> None:
        """Take what has come from those of the sources that are `ready`."""
        # The client first: who reconnects at once is not a second one.
        if self._client in ready:
            self._receive(self._client)
        elif self._listener in ready:
            self._accept()

    def _receive(self, client: socket.socket | None) -> None:
        assert client is not None
        try:
            data = client.recv(_CHUNK)
        except OSError:
            data = b""
        if data:
            self._received(data)
        else:
            self.hang_up()

    def _accept(self) -> None:
        client, _ = self._listener.accept()
        if self._client is not None:
            client.close()
            return
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._client = client
        self._opened()


def attend(ports: Sequence[TcpPort], wait_s: float) -> None:
    """Take what comes to any of the ports within `wait_s`, and what has come before."""
    end = time.monotonic() + wait_s
    while True:
        sources = [source for port in ports for source in port.sources]
        ready, _, _ = select.select(sources, [], [], max(0.0, end - time.monotonic()))
        if not ready:
            return
        for port in ports:
            port.attend(ready)
