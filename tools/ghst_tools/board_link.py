"""The way to a board: which serial port, what goes wrong there, and what runs on the board."""

import ast
import contextlib
import io
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from mpremote.transport import TransportError  # type: ignore[import-untyped]
from mpremote.transport_serial import SerialTransport  # type: ignore[import-untyped]
from serial.tools import list_ports  # type: ignore[import-untyped]

from ghst_tools.boards import Board
from ghst_tools.chips import CHIPS
from ghst_tools.errors import GhstError
from ghst_tools.serial_port import open_port

OLDEST_MICROPYTHON = (1, 25)

_RASPBERRY_PI = 0x2E8A
_DEBUG_PROBE = 0x000C
# What ESP32 boards have on USB: the chip itself, or a bridge by Silicon Labs or WCH.
_ESPRESSIF_AND_BRIDGES = (0x303A, 0x10C4, 0x1A86)

# What MicroPython calls boards whose radio chip has the pins of a Pico's LED and supply voltage.
_WITH_RADIO = ("Raspberry Pi Pico W ", "Raspberry Pi Pico 2 W ")

# Index: sys.implementation._mpy >> 10 (MicroPython's documentation of .mpy files).
_ARCHITECTURES = (
    *("bytecode only", "x86", "x64", "armv6", "armv6m", "armv7m", "armv7em"),
    *("armv7emsp", "armv7emdp", "xtensa", "xtensawin", "rv32imc"),
)

_IDENTIFY = """
import sys
i = sys.implementation
print(repr((i[0], tuple(i[1])[:3], getattr(i, '_machine', ''), getattr(i, '_mpy', 0))))
"""


@dataclass(frozen=True)
class Identity:
    """What a board says of itself in `sys.implementation`."""

    name: str
    version: tuple[int, ...]
    machine: str
    mpy: int

    @property
    def architecture(self) -> str:
        """Architecture of native code, as mpy-cross spells it."""
        # Bits 10 to 13; from 1.28 on there are flags above them.
        index = self.mpy >> 10 & 0xF
        return _ARCHITECTURES[index] if index < len(_ARCHITECTURES) else f"number {index}"

    def check(self, board: Board) -> None:
        """`GhstError` if the firmware for `board` would not run on this one."""
        found = ".".join(map(str, self.version))
        if self.name != "micropython":
            raise GhstError(f"the board runs {self.name} {found}: install MicroPython on it")
        if self.version < OLDEST_MICROPYTHON:
            oldest = ".".join(map(str, OLDEST_MICROPYTHON))
            raise GhstError(f"the board runs MicroPython {found}: install {oldest} or later on it")
        if self.machine.startswith(_WITH_RADIO):
            raise GhstError(
                f"the board says it is a {self.machine!r}: there is no board definition for it "
                "yet: use a board of docs/boards.md"
            )
        if self.architecture != board.mpy_arch:
            raise GhstError(
                f"the board ({self.machine}) has architecture {self.architecture}, "
                f"{board.name} has {board.mpy_arch}: check --board (make: BOARD=...)"
            )
        if self.machine != board.machine:
            raise GhstError(
                f"the board says it is a {self.machine!r}, {board.name} is a {board.machine!r}: "
                "check --board (make: BOARD=...) and its MicroPython image"
            )


def find_port(board: Board) -> str:
    """The serial port of the one board on USB that could be a `board`.

    `GhstError` if there is none, or more than one.
    """
    ports = [port for port in list_ports.comports() if _could_be(port, CHIPS[board.chip].is_rp2)]
    if not ports:
        raise GhstError(
            "no board found on USB: plug one in that runs MicroPython, or say which port with "
            "--port (make: PORT=...)"
        )
    if len(ports) > 1:
        known = ", ".join(f"{port.device} (serial number {port.serial_number})" for port in ports)
        raise GhstError(
            f"{len(ports)} boards found: {known}: say which with --port (make: PORT=...)"
        )
    return str(ports[0].device)


def _could_be(port: Any, is_rp2: bool) -> bool:
    if (port.manufacturer or "").startswith("MicroPython"):
        return True
    if is_rp2:
        return bool(port.vid == _RASPBERRY_PI and port.pid != _DEBUG_PROBE)
    return port.vid in _ESPRESSIF_AND_BRIDGES


@contextlib.contextmanager
def connect(port: str) -> Iterator[Any]:
    """Interrupt what runs on the board and give mpremote's transport, in the raw REPL.

    Without a soft reset: the running firmware is left through its own clean-up. A board that
    falls silent, or a port that vanishes, becomes a `GhstError`.
    """
    # mpremote does not tell why a port cannot be opened, so try it here first.
    open_port(port).close()
    try:
        transport = SerialTransport(port)
    except TransportError as error:
        raise GhstError(f"{port}: {error}") from error
    try:
        # On failure mpremote prints what it received.
        with contextlib.redirect_stdout(io.StringIO()):
            transport.enter_raw_repl(soft_reset=False)
    except (TransportError, OSError) as error:
        with contextlib.suppress(OSError):
            transport.close()
        raise GhstError(
            f"{port}: no MicroPython prompt there: another program has it open, or it is "
            "not a MicroPython board"
        ) from error
    try:
        yield transport
    except TransportError as error:
        lines = str(error).strip().splitlines() or ["no answer"]
        raise GhstError(f"{port}: the board failed: {lines[-1]}") from error
    except OSError as error:
        raise GhstError(f"{port}: the connection broke: {error}") from error
    finally:
        with contextlib.suppress(OSError):
            transport.close()


def identify(transport: Any) -> Identity:
    """Ask the board what it is."""
    return Identity(*ast.literal_eval(transport.exec(_IDENTIFY).decode()))
