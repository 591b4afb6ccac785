"""Recording pins and the wire in the VCD format, for PulseView or GTKWave."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from vcd import VCDWriter

from ghst_tools.emulator.board import Board
from ghst_tools.emulator.pins import Cause
from ghst_tools.emulator.wire import Wire

# A VCD time scale is 1, 10 or 100 of one of these.
_UNITS_NS = {"s": 1e9, "ms": 1e6, "us": 1e3, "ns": 1.0, "ps": 1e-3, "fs": 1e-6}


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
        """Write everything recorded so far to `path`, times rounded to `resolution_ns`.

        `resolution_ns` is a power of ten, or ValueError. PulseView expands the file into one
        sample for each of it: 100 ns leaves 24 samples for a bit on the wire and takes ten million
        for a second; 0.001 ns keeps every edge as it was, for tools that do not expand.
        """
        timescale = _timescale(resolution_ns)
        with (
            path.open("w", encoding="ascii") as file,
            VCDWriter(file, timescale=timescale, date="", version="micropython-ghst") as writer,
        ):
            start = self._changes[0][0] if self._changes else 0.0
            variables = [writer.register_var("board", name, "wire", 1) for name in self._signals]
            for t_ns, signal, value in self._changes:
                writer.change(variables[signal], round((t_ns - start) / resolution_ns), value)
            writer.close(round((self._board.now_ns - start) / resolution_ns))

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


def _timescale(resolution_ns: float) -> str:
    for unit, unit_ns in _UNITS_NS.items():
        for number in (100, 10, 1):
            if math.isclose(resolution_ns, number * unit_ns, rel_tol=1e-9):
                return f"{number} {unit}"
    raise ValueError(f"a VCD file has no time scale of {resolution_ns} ns, only powers of ten")
