"""The picture of a run: what was sent and what was measured, over time."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ghst_tools.demo.report import Points, Report, Span, Trace

_SENT, _MEASURED, _FAILSAFE = "#7f8c99", "#d9480f", "#e03131"
_BANDS = ("#eef3f8", "#ffffff")
_DPI = 110


def write(report: Report, path: Path) -> None:
    """Draw `report` into `path`, a PNG file."""
    count = len(report.traces)
    rows = math.ceil(count / 2)
    figure = Figure(figsize=(16, 2.0 * rows + 2.6), dpi=_DPI, layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(rows + 1, 2, height_ratios=[*(1.0 for _ in range(rows)), 0.7])
    first: Axes | None = None
    for index, trace in enumerate(report.traces):
        axes = figure.add_subplot(grid[index % rows, index // rows], sharex=first, sharey=first)
        first = first or axes
        _channel(axes, trace, report)
        if index % rows == 0:
            _names(axes, report.spans)
        axes.tick_params(labelbottom=index % rows == rows - 1)
    errors = figure.add_subplot(grid[rows, :])
    _errors(errors, report)
    if first is not None:
        handles, labels = first.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=len(labels), fontsize=10)
    verdict = "every pulse right" if not report.failures else f"NOT RIGHT: {report.failures[0]}"
    figure.suptitle(f"micropython-ghst: {report.title}; {verdict}", x=0.01, ha="left", fontsize=13)
    figure.savefig(path)


def _channel(axes: Axes, trace: Trace, report: Report) -> None:
    _shade(axes, report.spans)
    end = report.spans[-1].end
    sent = [*trace.sent, (end, trace.sent[-1][1])] if trace.sent else []
    times, values = _split(_gaps(sent))
    axes.step(times, values, where="post", color=_SENT, linewidth=1.3, label="sent by the radio")
    times, values = _split(_gaps(trace.measured))
    axes.plot(times, values, ".", color=_MEASURED, markersize=4, label=report.measured)
    axes.set_ylim(800, 2240)
    axes.set_yticks((1000, 1500, 2000))
    axes.grid(axis="y", color="#d0d7de", linewidth=0.6)
    axes.set_ylabel(f"{trace.output} ch {trace.channel}\nus".strip(), fontsize=9)
    axes.set_xlim(report.spans[0].start - 0.06, end)


def _errors(axes: Axes, report: Report) -> None:
    _shade(axes, report.spans)
    for trace in report.traces:
        axes.plot(*_split(trace.errors), ".", color=_MEASURED, markersize=3, alpha=0.5)
    axes.axhline(0, color=_SENT, linewidth=0.8)
    largest = max((abs(e) for trace in report.traces for _, e in trace.errors), default=0.0)
    axes.set_ylim(-max(0.3, 1.1 * largest), max(0.3, 1.1 * largest))
    axes.set_ylabel("off the channel's\nvalue, us", fontsize=9)
    axes.set_xlabel("time, s", fontsize=10)
    axes.set_xlim(report.spans[0].start - 0.06, report.spans[-1].end)


def _shade(axes: Axes, spans: list[Span]) -> None:
    for index, span in enumerate(spans):
        if span.failsafe:
            axes.axvspan(span.start, span.end, color=_FAILSAFE, alpha=0.10, linewidth=0)
            axes.axvline(span.start, color=_FAILSAFE, linewidth=1)
            axes.axvline(span.end, color=_FAILSAFE, linewidth=1, linestyle=":")
        else:
            axes.axvspan(span.start, span.end, color=_BANDS[index % 2], linewidth=0, zorder=0)


def _names(axes: Axes, spans: list[Span]) -> None:
    for span in spans:
        axes.annotate(
            textwrap.fill(span.name, 15),
            ((span.start + span.end) / 2, 1.02),
            xycoords=("data", "axes fraction"),
            ha="center",
            va="bottom",
            fontsize=8,
            color=_FAILSAFE if span.failsafe else "#495057",
        )


def _split(points: Points) -> tuple[list[float], list[float]]:
    return [t for t, _ in points], [us for _, us in points]


def _gaps(points: Points) -> Points:
    """Put a gap in the place of 0 us, which is no pulse."""
    return [(t, us if us else math.nan) for t, us in points]
