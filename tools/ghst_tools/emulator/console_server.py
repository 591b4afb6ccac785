"""The emulated board behind TCP ports: `ghst emulate`.

Bytes go between the board's USB console and one TCP client, mpremote or `ghst flash`; and, on
request, between the Ghost wire and another client, `ghst simulate` or `ghst sniff`. Emulated time
never runs ahead of real time, so that a program which waits for the board finds it as slow as a
real one, or slower.
"""

import contextlib
import json
import signal
import time
from collections.abc import Callable
from pathlib import Path

import click

from ghst_tools import boards, filesystem, micropython_image
from ghst_tools.emulator.board import Board
from ghst_tools.emulator.jumper import Jumper
from ghst_tools.emulator.meters import PulseMeter
from ghst_tools.emulator.tcp_port import TcpPort, attend
from ghst_tools.emulator.wire import Wire
from ghst_tools.emulator.wire_server import WireServer
from ghst_tools.errors import GhstError

_SLICE_NS = 2_000_000
_UNREAD = 256  # CFG_TUD_CDC_TX_BUFSIZE of MicroPython's rp2 port


class ConsoleServer:
    """Serves the board's console on a TCP port, see `TcpPort`; and the wire, if there is one."""

    def __init__(self, board: Board, port: int = 0, wire: WireServer | None = None) -> None:
        self.board = board
        self._sent = 0
        self._resets = 0
        self._console = TcpPort(board.console.write, port, self._opened)
        self._wire = wire
        self._ports = [self._console, *([wire.port] if wire else [])]

    @property
    def address(self) -> str:
        """What to give mpremote as the port."""
        return self._console.address

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
                self._console.hang_up()
            if self._wire:
                self._wire.step()
            attend(self._ports, due - time.monotonic())

    def close(self) -> None:
        """Hang up and stop listening."""
        for port in self._ports:
            port.close()

    def _opened(self) -> None:
        # While nobody has the port open, the board's transmit FIFO keeps the newest bytes.
        self._sent = max(self._sent, len(self.board.console.output) - _UNREAD)

    def _to_client(self) -> None:
        output = self.board.console.output
        if self._console.connected and self._sent != len(output):
            new = bytes(output[self._sent :])
            self._sent = len(output)
            self._console.send(new)


@click.command()
@click.option("--board", "name", default=boards.DEFAULT_BOARD, show_default=True)
@click.option(
    "--tcp-port",
    type=click.IntRange(0, 65_535),
    default=0,
    help="Port to listen on; default: a free one.",
)
@click.option(
    "--filesystem",
    "image",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="File-system image; default: what `ghst image` writes.",
)
@click.option("--empty", is_flag=True, help="Start with an empty file system, like a new board.")
@click.option(
    "--wire-port",
    type=click.IntRange(0, 65535),
    help="Put the Ghost wire on this TCP port, too; 0: a free one.",
)
@click.option("--selftest", is_flag=True, help="Tie the pins as ghst selftest needs it.")
def command(
    name: str,
    tcp_port: int,
    image: Path | None,
    empty: bool,
    wire_port: int | None,
    selftest: bool,
) -> None:
    """Run the emulated board with its console on a TCP port, until Ctrl-C.

    With --wire-port a serial adapter is on its Ghost wire, for ghst simulate, sniff and replay,
    and the pulses at the servo pins are shown every 250 ms of emulated time. A busy board runs
    slower than real time, a fifth of it and less, and its wire with it.
    """
    definition = boards.load(name)
    pico = boards.load(boards.DEFAULT_BOARD)
    if definition.micropython_board != pico.micropython_board:
        raise GhstError(
            f"{name} cannot be emulated: only boards that run {pico.micropython_board}"
        )
    micropython = micropython_image.find(board=name)
    if image is None and not empty:
        image = filesystem.write(name)
    board = Board(micropython, image)
    if selftest and definition.selftest_pin is not None:
        Jumper(board, definition.defaults["wire"]["pin"], definition.selftest_pin)
    wire = None
    if wire_port is not None:
        defaults = json.loads(definition.definition)["defaults"]
        meter = PulseMeter(board, map(int, defaults["outputs"]))
        wire = WireServer(Wire(board, defaults["wire"]["pin"]), meter, wire_port, click.echo)
    server = ConsoleServer(board, tcp_port, wire)
    # Not the handler of SIGINT: in a background job of a shell that one is ignored.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    click.echo(f"{name} is at {server.address}: mpremote connect {server.address}")
    if wire:
        click.echo(f"its wire is at {wire.address}: ghst simulate --port {wire.address}")
    with contextlib.suppress(KeyboardInterrupt):
        server.serve()
    server.close()
