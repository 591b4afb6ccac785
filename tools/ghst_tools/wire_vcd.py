"""The command `ghst vcd`."""

from __future__ import annotations

import heapq
from pathlib import Path

import click
import numpy as np

from ghst_tools import uart_bits, vcd_file
from ghst_tools.errors import GhstError
from ghst_tools.files import check_output, explained
from ghst_tools.frames import columns
from ghst_tools.frames.formats import FORMATS, Source
from ghst_tools.frames.recording import Recording, load
from ghst_tools.frames.timeline import Timeline
from ghst_tools.vcd_file import Change

SIGNALS = ("wire", "downlink")
"""The level of the wire, and whether the flight controller is sending a valid frame."""

_WIRE, _DOWNLINK = 0, 1
_IDLE_NS = 100_000  # before the first byte and behind the last


def changes(
    recording: Recording, start_s: float = 0.0, seconds: float | None = None
) -> tuple[list[Change], float, float]:
    """What the wire did, bit by bit, and from when to when, in nanoseconds of the recording.

    Those reads are taken that begin in the `seconds` from `start_s` on. `GhstError` if there are
    none, or no times.
    """
    if recording.reads is None or recording.times is None:
        raise GhstError(f"{recording.where}: has no times: only a log of `ghst sniff` has them")
    stop_s = np.inf if seconds is None else start_s + seconds
    begins_s = Timeline(recording.baud).add(recording.reads)
    limits = zip(
        begins_s.tolist(),
        [0, *recording.reads.ends.tolist()],
        recording.reads.ends.tolist(),
        strict=False,
    )
    wire: list[Change] = []
    end_ns = 0.0
    for begin_s, start, stop in limits:
        if start_s <= begin_s < stop_s:
            data = recording.pieces.data[start:stop]
            levels, end_ns = uart_bits.encode(data, begin_s * 1e9, recording.baud)
            wire += [(t_ns, _WIRE, int(level)) for t_ns, level in levels]
    if not wire:
        raise GhstError(f"{recording.where}: nothing was on the wire in that time")
    start_ns, end_ns = wire[0][0] - _IDLE_NS, end_ns + _IDLE_NS
    first: list[Change] = [(start_ns, _WIRE, 1), (start_ns, _DOWNLINK, 0)]
    down = [change for change in _downlink(recording) if start_ns <= change[0] <= end_ns]
    return first + list(heapq.merge(wire, down)), start_ns, end_ns


def _downlink(recording: Recording) -> list[Change]:
    assert recording.times is not None
    down = columns.downlink(recording.pieces)
    found: list[Change] = []
    for begin_s, end_s in zip(
        recording.times.begins_s[down].tolist(), recording.times.ends_s[down].tolist(), strict=True
    ):
        found += [(begin_s * 1e9, _DOWNLINK, 1), (end_s * 1e9, _DOWNLINK, 0)]
    return found


@click.command()
@click.argument("file", type=click.Path(path_type=Path, allow_dash=True))
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    help="VCD file to write.",
)
@click.option(
    "--start",
    "start_s",
    type=click.FloatRange(min=0),
    default=0.0,
    help="From this time of the log on, in seconds; default: all.",
)
@click.option(
    "--seconds",
    type=click.FloatRange(min=0, min_open=True),
    help="For so long; default: to the end.",
)
@click.option("--format", "format_", type=click.Choice(list(FORMATS)), help="As of ghst decode.")
def command(
    file: Path, output: Path, start_s: float, seconds: float | None, format_: str | None
) -> None:
    """Write the bits of a log as a VCD file, for PulseView and GTKWave.

    The bits are drawn anew from the bytes, at the baud rate of the log, back to back within each
    read: it shows what was said, not how the edges looked. PulseView expands the file to ten
    million samples for a second: of a long log write a part.
    """
    check_output(output, file)
    found, start_ns, end_ns = changes(load(Source(file, format_)), start_s, seconds)
    with explained(output):
        vcd_file.write(output, "log", SIGNALS, found, start_ns, end_ns)
    click.echo(
        f"{output}: {(end_ns - start_ns) / 1e9:.6f} s, from {start_ns / 1e9:.6f} s of the log on"
    )
