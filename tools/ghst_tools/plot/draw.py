"""Draws a recording: channels, link, and the rhythm of the wire."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec

from ghst.protocol import RF_MODES  # type: ignore[import-not-found]
from ghst_tools.files import replacing
from ghst_tools.frames import columns
from ghst_tools.frames.recording import Recording
from ghst_tools.frames.timeline import Seconds

_CHANNEL, _LQ, _RSSI, _INTERVAL, _SLOT = "#1f5fa8", "#2b8a3e", "#c2410c", "#4f6d8f", "#8e44ad"
_GRID, _MUTED = "#d0d7de", "#57606a"
_COLUMNS = 4
_ROW_INCHES, _LINK_INCHES, _RHYTHM_INCHES = 1.25, 1.9, 2.5
_DPI = 120
_PULSE_LIMITS_US = (830, 2210)  # a little beyond what a frame can carry
_BINS = 60
_EMPTY_BINS = 20  # to either side, so that a narrow distribution looks narrow
# Of so many distances the shortest and the longest do not widen a histogram.
_FEW, _OUTLIERS = 20, 0.005


def write(recording: Recording, path: Path) -> None:
    """Draw `recording` into `path`, SVG or PNG by its name."""
    figure = _draw(recording)
    with replacing(path) as file:
        # No date inside: the same recording gives the same file.
        dated = {"Date": None} if path.suffix.lower() == ".svg" else None
        figure.savefig(file, format=path.suffix[1:].lower(), dpi=_DPI, metadata=dated)


def _draw(recording: Recording) -> Figure:
    channels = columns.channels(recording.pieces)
    seen = np.flatnonzero(~np.all(np.isnan(channels.pulses_us), axis=0)).tolist()
    rows = max(1, math.ceil(len(seen) / _COLUMNS))
    timed = recording.times is not None
    heights = [_ROW_INCHES] * rows + [_LINK_INCHES] + [_RHYTHM_INCHES] * timed
    figure = Figure(figsize=(14, sum(heights) + 1.2), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(len(heights), _COLUMNS, height_ratios=heights)
    x, unit = _axis(recording)
    _channels(figure, grid, channels, seen, x)
    _link(figure, grid, rows, recording, x, unit)
    if timed:
        _rhythm(figure, grid, rows + 1, recording)
    figure.suptitle(_title(recording), x=0.01, ha="left", fontsize=12)
    return figure


def _axis(recording: Recording) -> tuple[Seconds, str]:
    """Where each piece stands on the horizontal axis, and what that axis is."""
    if recording.times is not None:
        return recording.times.begins_s, "time, s"
    return np.arange(len(recording.pieces.starts), dtype=np.float64), "frames (no times recorded)"


def _span(x: Seconds) -> tuple[float, float]:
    return float(x[0]), float(x[-1]) if x[-1] > x[0] else float(x[0]) + 1.0


def _channels(
    figure: Figure,
    grid: GridSpec,
    channels: columns.Channels,
    seen: Sequence[int],
    x: Seconds,
) -> None:
    first: Axes | None = None
    last_row = (len(seen) - 1) // _COLUMNS
    for index, number in enumerate(seen):
        row, column = divmod(index, _COLUMNS)
        axes = figure.add_subplot(grid[row, column], sharex=first, sharey=first)
        first = first or axes
        pulses_us = channels.pulses_us[:, number]
        carried = ~np.isnan(pulses_us)
        axes.step(
            x[channels.frames[carried]],
            pulses_us[carried],
            where="post",
            color=_CHANNEL,
            linewidth=1.2,
            rasterized=int(np.sum(carried)) > 20_000,
        )
        axes.set_xlim(*_span(x))
        axes.set_ylim(*_PULSE_LIMITS_US)
        axes.set_yticks((1000, 1500, 2000))
        axes.set_title(f"channel {number + 1}", loc="left", fontsize=9, pad=3)
        _plain(axes)
        axes.tick_params(labelleft=column == 0, labelbottom=row == last_row)
        if column == 0:
            axes.set_ylabel("us", fontsize=9)


def _link(
    figure: Figure, grid: GridSpec, row: int, recording: Recording, x: Seconds, unit: str
) -> None:
    link = columns.link(recording.pieces)
    half = _COLUMNS // 2
    for place, values, color, title, limits in (
        (grid[row, :half], link.lq_percent, _LQ, "link quality, %", (-4, 104)),
        (grid[row, half:], link.rssi_dbm, _RSSI, "RSSI, dBm", None),
    ):
        axes = figure.add_subplot(place)
        axes.set_title(title, loc="left", fontsize=9, pad=3)
        axes.set_xlabel(unit, fontsize=9)
        _plain(axes)
        if not len(values):
            _nothing(axes, "no link data recorded")
            continue
        axes.step(x[link.frames], values, where="post", color=color, linewidth=1.0)
        low, high = limits or (int(values.min()) - 3, int(values.max()) + 3)
        axes.set_ylim(low, high)
        axes.set_xlim(*_span(x))


def _rhythm(figure: Figure, grid: GridSpec, row: int, recording: Recording) -> None:
    half = _COLUMNS // 2
    timing = recording.timing
    for place, distances_us, unknown, color, title, none in (
        (
            grid[row, :half],
            timing.intervals_us,
            timing.intervals_unknown,
            _INTERVAL,
            "from control frame to control frame, us",
            "no two control frames",
        ),
        (
            grid[row, half:],
            timing.slots_us,
            timing.slots_unknown,
            _SLOT,
            "slot: from a control frame's end to the telemetry's start, us",
            "no telemetry behind a control frame",
        ),
    ):
        axes = figure.add_subplot(place)
        axes.set_title(title, loc="left", fontsize=9, pad=3)
        _plain(axes)
        if not len(distances_us):
            _nothing(axes, f"{unknown} came in one read: not measured" if unknown else none)
            continue
        _histogram(axes, np.array(distances_us), unknown, color)


def _histogram(axes: Axes, values_us: Seconds, unknown: int, color: str) -> None:
    median = float(np.median(values_us))
    ordered = np.sort(values_us)
    left_out = math.ceil(len(ordered) * _OUTLIERS) if len(ordered) >= _FEW else 0
    low, high = float(ordered[left_out]), float(ordered[-1 - left_out])
    # The median in the middle of a bin of at least 1 us: no log is finer.
    bin_us = max(1.0, 1.2 * (high - low) / _BINS)
    below = math.ceil((median - low) / bin_us) + _EMPTY_BINS
    above = math.ceil((high - median) / bin_us) + _EMPTY_BINS
    edges_us = median + (np.arange(-below, above + 2) - 0.5) * bin_us
    axes.hist(values_us, bins=edges_us.tolist(), color=color)
    axes.set_xlim(edges_us[0], edges_us[-1])
    axes.set_ylabel("count", fontsize=9)
    axes.margins(y=0.12)
    axes.axvline(median, color="black", linewidth=0.8, linestyle=":")
    beyond = int(np.sum((values_us < edges_us[0]) | (values_us > edges_us[-1])))
    lines = [
        f"{len(values_us)} measured",
        f"median {median:.1f} us",
        f"{values_us.min():.1f} to {values_us.max():.1f} us",
    ]
    lines += [f"{beyond} beyond this range"] if beyond else []
    lines += [f"{unknown} not measured (one read)"] if unknown else []
    axes.text(
        0.985, 0.95, "\n".join(lines), transform=axes.transAxes, ha="right", va="top", fontsize=9
    )


def _title(recording: Recording) -> str:
    count = int(np.sum(columns.valid(recording.pieces)))
    parts = [f"{recording.where}: {count} frames"]
    if recording.times is not None and len(recording.times.begins_s):
        parts.append(f"{recording.times.ends_s[-1] - recording.times.begins_s[0]:.2f} s")
    modes = np.unique(columns.link(recording.pieces).rf_mode).tolist()
    parts += [RF_MODES[mode][0] if mode in RF_MODES else f"RF mode {mode}" for mode in modes]
    wrong = len(recording.pieces.starts) - count
    parts += [f"{wrong} pieces of garbage or damaged frames"] if wrong else []
    return ", ".join(parts)


def _plain(axes: Axes) -> None:
    axes.grid(color=_GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=8, colors=_MUTED, length=2)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(_GRID)


def _nothing(axes: Axes, why: str) -> None:
    axes.text(
        0.5, 0.5, why, transform=axes.transAxes, ha="center", va="center", color=_MUTED, fontsize=9
    )
    axes.set_xticks([])
    axes.set_yticks([])
