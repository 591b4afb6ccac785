"""Makes the recordings in docs/examples on the emulated board, with a simulated receiver.

wire.log is what was on the wire, status.jsonl what the board said of itself right behind that.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path

from ghst_tools import boards, filesystem, micropython_image
from ghst_tools.control_frames import control_frame
from ghst_tools.demo.aircraft import Aircraft, Devices
from ghst_tools.emulator import Board, GhostReceiver, Wire
from ghst_tools.emulator.wire import BAUD
from ghst_tools.files import write_file
from ghst_tools.frames import log
from ghst_tools.uart_bits import DecodedByte

_RATE_HZ = 250.0
_SLOT_NS = 1e9 / _RATE_HZ
_BYTE_NS = 10e9 / BAUD
_RF_MODE = 10  # Race250
_ROTATION = (0x11, 0x13, 0x10, 0x12)
# The barometer takes a second for its zero, and the GPS finds a fix.
_WARM_UP_NS = 3e9
_RECORDED_NS = 0.4e9
_STATUS_NS = 2.5e9
_DAMAGED_AT, _NOISE_AT = 5, 9  # slots of the recording
_NOISE = b"\x5a\xa5\x00"


def record(path: Path, status_path: Path) -> None:
    """Boot the emulated board with its sensors, fly, and write what was on the wire and said."""
    definition = boards.load(boards.DEFAULT_BOARD)
    defaults = json.loads(definition.definition)["defaults"]
    board = Board(micropython_image.find(), filesystem.write())
    aircraft = Aircraft()
    _devices = Devices(board, aircraft, defaults)
    wire = Wire(board, defaults["wire"]["pin"])
    receiver = GhostReceiver(wire, _frame, _RATE_HZ)
    board.boot(until=b"link: searching")
    aircraft.takeoff_ns = board.now_ns
    first_ns = board.now_ns + 1e6
    receiver.start(first_ns)
    since_ns = first_ns + round(_WARM_UP_NS / _SLOT_NS) * _SLOT_NS - 1e6
    board.run_for(since_ns - board.now_ns)
    # A spike in the middle of a frame, and noise behind the telemetry slot.
    wire.glitch(since_ns + 1e6 + _DAMAGED_AT * _SLOT_NS + 5.5 * _BYTE_NS, 4e3)
    noise_ns = since_ns + 1e6 + (_NOISE_AT + 0.75) * _SLOT_NS
    board.run_for(noise_ns - 0.1e6 - board.now_ns)
    wire.send(_NOISE, noise_ns)
    board.run_for(since_ns + _RECORDED_NS - board.now_ns)
    write_file(path, _text(wire.decode(who=None, since=since_ns), since_ns).encode())
    write_file(status_path, _status(board))


def _frame(index: int, t_ns: float) -> bytes:
    pulses = [
        round(6000 + 1600 * math.sin(t_ns / 1e9 * (2 + channel / 3) * 3)) for channel in range(16)
    ]
    return control_frame(
        _ROTATION[index % len(_ROTATION)],
        pulses,
        lq=round(97 + 3 * math.sin(index / 40)),
        rssi_dbm=round(-66 + 6 * math.sin(index / 25)),
        rf_mode=_RF_MODE,
    )


def _status(board: Board) -> bytes:
    start = len(board.console.output)
    board.console.write(b"status 200\r")
    board.run_for(_STATUS_NS)
    whole = bytes(board.console.output[start:]).rpartition(b"\n")[0]
    lines = [line for line in whole.splitlines() if line.startswith(b"{")]
    return b"\n".join([*lines, b""])


def _text(octets: Iterable[DecodedByte], since_ns: float) -> str:
    """A log with one line for each burst, as an adapter without delay would read it."""
    lines = [log.header("the emulated wire", datetime(2026, 1, 1, tzinfo=UTC), BAUD)]
    burst = bytearray()
    end_ns = since_ns
    for octet in octets:
        if burst and octet.t_ns - end_ns > _BYTE_NS / 2:
            lines.append(log.line((end_ns - since_ns) / 1e9, bytes(burst)))
            burst.clear()
        burst.append(octet.value)
        end_ns = octet.t_ns + _BYTE_NS
    lines.append(log.line((end_ns - since_ns) / 1e9, bytes(burst)))
    return "".join(lines)
