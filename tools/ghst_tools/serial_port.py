"""Opening serial ports, and what goes wrong with them, in one line that says what to do."""

from __future__ import annotations

import contextlib
import errno
import socket
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

import serial  # type: ignore[import-untyped]
from serial.tools import list_ports  # type: ignore[import-untyped]
from serial.urlhandler import protocol_socket  # type: ignore[import-untyped]

from ghst.protocol import BAUD_RATE  # type: ignore[import-not-found]
from ghst_tools.errors import GhstError

_SOCKET = "socket://"
_WRITE_TIMEOUT_S = 1.0
_PEEKED_BYTES = 4096


class _SocketPort(protocol_socket.Serial):  # type: ignore[misc]
    """Tells how many bytes wait: pyserial's own tells whether there are any."""

    @property
    def in_waiting(self) -> int:
        if not super().in_waiting:
            return 0
        with contextlib.suppress(BlockingIOError):
            return len(self._socket.recv(_PEEKED_BYTES, socket.MSG_PEEK))
        return 0


def explain(port: str, error: Exception) -> GhstError:
    """Why a serial port could not be opened, in one line that says what to do."""
    number = error.errno if isinstance(error, OSError) else None
    if number in (errno.EACCES, errno.EPERM):
        return GhstError(f"{port}: no permission: add yourself to the group that owns the port")
    if number in (errno.EBUSY, errno.EAGAIN):
        return GhstError(f"{port}: busy: close the program that has it open (mpremote, Thonny)")
    if number in (errno.ENOENT, errno.ENXIO, errno.ENODEV):
        return GhstError(f"{port}: there is no such port")
    return GhstError(f"{port}: cannot be opened: {error}")


def open_port(port: str) -> Any:
    """Open a board's console (or `socket://HOST:PORT`) for this program alone."""
    return _open(port, baudrate=115200, timeout=0.1)


def open_wire(port: str | None, baud: int = BAUD_RATE, timeout_s: float = 0.05) -> Any:
    """Open the serial adapter that is on the Ghost wire, for this program alone; 8N1.

    None for `port` is an error that names the ports there are.
    """
    if port is None:
        raise GhstError(f"say which port with --port: {_known_ports()}")
    line = _open(port, baudrate=baud, timeout=timeout_s, write_timeout=_WRITE_TIMEOUT_S)
    # FTDI adapters gather bytes for 16 ms unless told otherwise; others refuse, or need it not.
    with contextlib.suppress(AttributeError, OSError, ValueError):
        line.set_low_latency_mode(True)
    return line


def is_network(port: str) -> bool:
    """Whether a port is one of another computer or program, and its time not that of a wire."""
    return "://" in port


@contextlib.contextmanager
def unplugged(port: str, what_now: str) -> Iterator[None]:
    """Turn the errors of a port that vanishes into a `GhstError`, which ends with `what_now`."""
    try:
        yield
    except serial.SerialTimeoutException as error:
        raise GhstError(f"{port}: takes no bytes: is it the right port? {what_now}") from error
    except OSError as error:
        raise GhstError(f"{port}: gone (unplugged?): {what_now}") from error


def _open(port: str, **settings: Any) -> Any:
    if port.startswith(_SOCKET):
        _check_address(port)
    make = _SocketPort if port.startswith(_SOCKET) else serial.serial_for_url
    try:
        return make(port, exclusive=True, **settings)
    except (OSError, ValueError) as error:
        raise explain(port, error) from error


def _check_address(port: str) -> None:
    """`GhstError` if a network address is none; pyserial's words for that help nobody."""
    try:
        parts = urlsplit(port)
        good = bool(parts.hostname and parts.port)
    except ValueError:
        good = False
    if not good:
        raise GhstError(f"{port}: must be socket://HOST:PORT with a PORT of 1..65535")


def _known_ports() -> str:
    ports = sorted(list_ports.comports(), key=lambda port: str(port.device))
    if not ports:
        return "there is none on this computer: plug in a USB-serial adapter"
    return ", ".join(f"{port.device} ({port.description})" for port in ports)
