"""Serial ports and boards on USB, by what USB says of them; nothing is opened."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from serial.tools import list_ports  # type: ignore[import-untyped]

from ghst_tools.doctor.finding import GOOD, HINT, WRONG, Finding
from ghst_tools.errors import GhstError

_RASPBERRY_PI = 0x2E8A
_DEBUG_PROBE = 0x000C
_ESPRESSIF = 0x303A
_ADAPTERS = {0x0403: "FTDI", 0x10C4: "CP210x", 0x1A86: "CH34x", 0x067B: "PL2303"}
# The name of the drive that the boot ROM shows while BOOTSEL is held.
_DRIVES = {"RPI-RP2": "RP2040", "RP2350": "RP2350"}
_LABELS = Path("/dev/disk/by-label")
_VOLUMES = Path("/Volumes")

Ports = list[Any]


def known() -> Ports:
    """The serial ports of this computer that are on USB."""
    ports = [port for port in list_ports.comports() if port.vid is not None]
    return sorted(ports, key=lambda port: str(port.device))


def is_board(port: Any) -> bool:
    """Whether MicroPython may be behind a port."""
    if port.vid == _RASPBERRY_PI:
        return bool(port.pid != _DEBUG_PROBE)
    return port.vid == _ESPRESSIF or (port.manufacturer or "").startswith("MicroPython")


def only_board() -> str:
    """The port of the one board on USB; `GhstError` if there is none, or more than one."""
    boards = [str(port.device) for port in known() if is_board(port)]
    if not boards:
        raise GhstError("no board found on USB: say which port with --port, or ask ghst doctor")
    if len(boards) > 1:
        raise GhstError(f"{len(boards)} boards found: say which with --port: {', '.join(boards)}")
    return boards[0]


def look(ports: Ports, labels: Path = _LABELS, volumes: Path = _VOLUMES) -> Iterator[Finding]:
    """What USB says, port by port, and boards that wait for MicroPython."""
    waiting = False
    for name, chip in _DRIVES.items():
        if (labels / name).exists() or (volumes / name).is_dir():
            waiting = True
            yield Finding(
                HINT,
                f"drive {name}",
                f"an {chip} that waits for a program",
                "copy MicroPython's .uf2 file for your board to it",
            )
    for port in ports:
        yield from _port(port)
    if not waiting and not any(is_board(port) for port in ports):
        yield Finding(
            HINT,
            "boards",
            "none on USB",
            "plug one in with a cable that carries data, or hold BOOTSEL meanwhile if it is new",
        )


def _port(port: Any) -> Iterator[Finding]:
    ids = f"{port.vid:04x}:{port.pid:04x}"
    if port.vid == _RASPBERRY_PI and port.pid == _DEBUG_PROBE:
        what = "a debug probe, no board"
    elif is_board(port):
        what = f"a board, serial number {port.serial_number}"
    elif port.vid in _ADAPTERS:
        what = f"a {_ADAPTERS[port.vid]} USB-serial adapter: for the wire, or on an ESP32 board"
    else:
        what = str(port.description)
    yield Finding(GOOD, port.device, f"{what} ({ids})")
    if sys.platform.startswith("linux") and not os.access(port.device, os.R_OK | os.W_OK):
        yield Finding(WRONG, port.device, "no permission", permission_step(port.device))


def permission_step(device: str) -> str:
    """How a user gets to use a port on Linux."""
    import grp

    try:
        group = grp.getgrgid(os.stat(device).st_gid).gr_name
    except (OSError, KeyError):
        return "add yourself to the group that owns the port"
    if group == "root":
        return "it belongs to root alone: a udev rule has to give it to a group of yours"
    return f"sudo usermod -aG {group} $USER, then log in anew"
