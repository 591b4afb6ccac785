"""The emulated board behind a TCP port, for mpremote and `ghst flash`: `ghst emulate`.

Bytes go between the board's USB console and one TCP client; pyserial, and so mpremote, connects
to it with `socket://127.0.0.1:PORT`. Emulated time never runs ahead of real time, so that a
program which waits for the board finds it as slow as a real one, or slower.
"""

import contextlib
import select
import signal
import socket
import time
from collections.abc import Callable
from pathlib import Path

import click

from ghst_tools import boards, filesystem, micropython_image
from ghst_tools.emulator.board import Board
from ghst_tools.errors import GhstError

_SLICE_NS = 2_000_000
_CHUNK = 4096
_UNREAD = 256  # CFG_TUD_CDC_TX_BUFSIZE of MicroPython's rp2 port


class ConsoleServer:
    """Listens on 127.0.0.1; serves one client at a time, and hangs up on a second one.

    `port` 0 lets the system choose; `address` tells. `GhstError` if the port is taken.
    """

    def __init__(self, board: Board, port: int = 0) -> None:
        self.board = board
        self._sent = 0
        self._resets = 0
        self._client: socket.socket | None = None
        try:
            self._listener = socket.create_server(("127.0.0.1", port))
        except OSError as error:
            raise GhstError(f"TCP port {port}: {error.strerror}") from error

    @property
    def address(self) -> str:
        """What to give mpremote as the port."""
        return f"socket://127.0.0.1:{self._listener.getsockname()[1]}"

    def serve(self, running: Callable[[], bool] = lambda: True) -> None:
        """Run the board and carry bytes until `running()` is false; it is asked every 2 ms."""
        # What is late stays late: after a busy stretch the board does not hurry to catch up.
        due = time.monotonic()
        while running():
            self.board.run_for(_SLICE_NS)
            due = max(due + _SLICE_NS / 1e9, time.monotonic())
            self._to_client()
            if len(self.board.resets) != self._resets:
                # A chip that resets drops off USB, and the port with it.
                self._resets = len(self.board.resets)
                self._hang_up()
            self._from_clients(due - time.monotonic())

    def close(self) -> None:
        """Hang up and stop listening."""
        self._hang_up()
        self._listener.close()

    def _from_clients(self, wait_s: float) -> None:
        end = time.monotonic() + wait_s
        while True:
            sources = [self._listener, *([self._client] if self._client else [])]
            ready, _, _ = select.select(sources, [], [], max(0.0, end - time.monotonic()))
            if not ready:
                return
            # The client first: who reconnects at once is not a second one.
            if self._client in ready:
                self._receive(self._client)
            else:
                self._accept()

    def _receive(self, client: socket.socket) -> None:
        try:
            data = client.recv(_CHUNK)
        except OSError:
            data = b""
        if data:
            self.board.console.write(data)
        else:
            self._hang_up()

    def _accept(self) -> None:
        client, _ = self._listener.accept()
        if self._client is not None:
            client.close()
            return
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._client = client
        # While nobody has the port open, the board's transmit FIFO keeps the newest bytes.
        self._sent = max(self._sent, len(self.board.console.output) - _UNREAD)

    def _to_client(self) -> None:
        output = self.board.console.output
        if self._client is None or self._sent == len(output):
            return
        new = bytes(output[self._sent :])
        self._sent = len(output)
        try:
            self._client.sendall(new)
        except OSError:
            self._hang_up()

    def _hang_up(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None


@click.command()
@click.option("--board", "name", default=boards.DEFAULT_BOARD, show_default=True)
@click.option("--tcp-port", default=0, help="Port to listen on; default: a free one.")
@click.option(
    "--filesystem",
    "image",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="File-system image; default: what `ghst image` writes.",
)
@click.option("--empty", is_flag=True, help="Start with an empty file system, like a new board.")
def command(name: str, tcp_port: int, image: Path | None, empty: bool) -> None:
    """Run the emulated board with its console on a TCP port, until Ctrl-C."""
    definition = boards.load(name)
    pico = boards.load(boards.DEFAULT_BOARD)
    if definition.micropython_board != pico.micropython_board:
        raise GhstError(
            f"{name} cannot be emulated: only boards that run {pico.micropython_board}"
        )
    micropython = micropython_image.find(board=name)
    if image is None and not empty:
        image = filesystem.write(name)
    server = ConsoleServer(Board(micropython, image), tcp_port)
    # Not the handler of SIGINT: in a background job of a shell that one is ignored.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    click.echo(f"{name} is at {server.address}: mpremote connect {server.address}")
    with contextlib.suppress(KeyboardInterrupt):
        server.serve()
    server.close()
