"""Recording pins and the wire in the VCD format, for PulseView or GTKWave."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from ghst_tools import vcd_file
from ghst_tools.emulator.board import Board
from ghst_tools.emulator.pins import Cause
from ghst_tools.emulator.wire import Wire


class VcdRecorder:
    """Records the level on each of `pins` (name to GPIO number), and of `wire` if given.

    `z` stands for a pin that nobody drives or pulls. The wire comes as two signals: `wire`, and
    `wire_device`, which tells whether the board drives it.
    """

    def __init__(self, board: Board, pins: Mapping[str, int], wire: Wire | None = None) -> None:
        self._board = board
        self._signals: list[str] = []
        self._changes: list[tuple[float, int, int | str]] = []
        for name, number in pins.items():
            signal = self._add(name, _value(board.pin(number).level))
            board.pin(number).watch_level(partial(self._pin_changed, signal))
        if wire is not None:
            level = self._add("wire", _value(wire.level))
            wire.watch(lambda edge: self._record(level, edge.level, edge.t_ns))
            drives = self._add("wire_device", int(wire.pin.device is not None))
            wire.pin.watch(lambda t_ns, pad: self._record(drives, pad is not None, t_ns))

    def write(self, path: Path, resolution_ns: float = 100.0) -> None:
        """Write everything recorded so far to `path`; see `vcd_file.write`."""
        start_ns = self._changes[0][0] if self._changes else 0.0
        end_ns = self._board.now_ns
        vcd_file.write(
            path, "board", self._signals, self._changes, start_ns, end_ns, resolution_ns
        )

    def _add(self, name: str, value: int | str) -> int:
        self._signals.append(name)
        signal = len(self._signals) - 1
        self._changes.append((self._board.now_ns, signal, value))
        return signal

    def _pin_changed(self, signal: int, t_ns: float, level: bool | None, _cause: Cause) -> None:
        self._record(signal, level, t_ns)

    def _record(self, signal: int, level: bool | None, t_ns: float) -> None:
        self._changes.append((t_ns, signal, _value(level)))


def _value(level: bool | None) -> int | str:
    return "z" if level is None else int(level)
