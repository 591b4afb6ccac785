"""Writing VCD files, for PulseView or GTKWave."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from vcd import VCDWriter

from ghst_tools.files import replacing

# A VCD time scale is 1, 10 or 100 of one of these.
_UNITS_NS = {"s": 1e9, "ms": 1e6, "us": 1e3, "ns": 1.0, "ps": 1e-3, "fs": 1e-6}

Change = tuple[float, int, int | str]
"""A time in nanoseconds, the number of a signal, its new value: 0, 1, or `z`, which is none."""


def write(
    path: Path,
    scope: str,
    signals: Sequence[str],
    changes: Iterable[Change],
    start_ns: float,
    end_ns: float,
    resolution_ns: float = 100.0,
) -> None:
    """Write what `signals` did from `start_ns` to `end_ns`; `changes` come in the order of time.

    Times are rounded to `resolution_ns`, a power of ten, or ValueError. PulseView expands the file
    into one sample for each of it: 100 ns leaves 24 samples for a bit on the wire and takes ten
    million for a second; 0.001 ns keeps every edge as it was, for tools that do not expand.
    """
    timescale = _timescale(resolution_ns)
    with (
        replacing(path, "w", "ascii") as file,
        VCDWriter(file, timescale=timescale, date="", version="micropython-ghst") as writer,
    ):
        variables = [writer.register_var(scope, name, "wire", 1) for name in signals]
        for t_ns, signal, value in changes:
            writer.change(variables[signal], round((t_ns - start_ns) / resolution_ns), value)
        writer.close(round((end_ns - start_ns) / resolution_ns))


def _timescale(resolution_ns: float) -> str:
    for unit, unit_ns in _UNITS_NS.items():
        for number in (100, 10, 1):
            if math.isclose(resolution_ns, number * unit_ns, rel_tol=1e-9):
                return f"{number} {unit}"
    raise ValueError(f"a VCD file has no time scale of {resolution_ns} ns, only powers of ten")
