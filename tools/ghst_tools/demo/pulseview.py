"""Makes a VCD file coarse enough for PulseView.

PulseView expands a VCD file into samples, one for each unit of its time scale: seconds in
picoseconds would take terabytes of memory. A tenth of a microsecond takes a hundred megabytes for
five seconds, and leaves 24 samples for a bit on the wire.
"""

from __future__ import annotations

from pathlib import Path

_FINE = "$timescale 1 ps $end"
_COARSE = "$timescale 100 ns $end"
_UNITS = 100_000


def coarsen(path: Path) -> None:
    """Rewrite a VCD file in picoseconds to tenths of a microsecond, in place."""
    text = path.read_text(encoding="ascii")
    header, _, body = text.partition("$enddefinitions $end\n")
    if _FINE not in header:
        raise ValueError(f"{path}: not in picoseconds")
    lines: list[str] = []
    last = -1
    for line in body.splitlines():
        if line.startswith("#"):
            now = (int(line[1:]) + _UNITS // 2) // _UNITS
            if now == last:
                continue
            last = now
            line = f"#{now}"
        lines.append(line)
    header = header.replace(_FINE, _COARSE)
    path.write_text(f"{header}$enddefinitions $end\n" + "\n".join(lines) + "\n", encoding="ascii")
