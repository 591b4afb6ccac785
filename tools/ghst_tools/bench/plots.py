"""The histograms of docs/figures.md."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from ghst_tools.bench.figures import Findings
from ghst_tools.bench.goals import AIM_US, LATENCY_US, PULSE_US, SLOT_US
from ghst_tools.bench.kinds import EIGHT_PLAIN
from ghst_tools.files import replacing

_BAR, _LIMIT, _AIM, _GRID = "#1f5fa8", "#c2410c", "#15803d", "#d0d7de"
_DPI = 80
_BINS = 80
_MARGIN_US = 0.1
"""On either side of what was measured, where the limits are too far away to be shown."""

PLOTS = {
    "bench_latency.png": "Last stop bit to last compare register",
    "bench_slot.png": "Telemetry behind the control frame",
    "bench_pulses.png": "Pulse width at the pin against the frame",
}


@dataclass(frozen=True)
class _Plot:
    """What is drawn: samples, each with a name, above one another."""

    samples: Mapping[str, Sequence[float]]
    counted: str
    limits: Sequence[float]
    across: tuple[float, float] | None = None
    """What is shown at least; None: what was measured."""
    aim: float | None = None


def write(findings: Findings, folder: Path, note: str) -> None:
    """Draw `PLOTS` into `folder`; `note` stands below each: date, versions, what is emulated."""
    folder.mkdir(parents=True, exist_ok=True)
    latencies: dict[str, Sequence[float]] = {
        f"{EIGHT_PLAIN} outputs, {load}": us for load, us in findings.latencies_us.items()
    }
    for kind, found in findings.kinds_us.items():
        latencies[f"{kind} outputs, all loads"] = [us for each in found.values() for us in each]
    plots = (
        _Plot(latencies, "frames", (LATENCY_US,), (AIM_US - 5, LATENCY_US + 1), AIM_US),
        _Plot(findings.slots_us, "frames", SLOT_US),
        _Plot(
            {"all servos": findings.pulse_errors_us},
            "pulses",
            (-PULSE_US, PULSE_US),
            (-PULSE_US - 0.05, PULSE_US + 0.05),
        ),
    )
    for name, plot in zip(PLOTS, plots, strict=True):
        _draw(folder / name, plot, note)


def _draw(path: Path, plot: _Plot, note: str) -> None:
    values = [value for found in plot.samples.values() for value in found]
    low, high = min(values) - _MARGIN_US, max(values) + _MARGIN_US
    if plot.across:
        # What is outside is shown all the same.
        low, high = min(low, plot.across[0]), max(high, plot.across[1])
    count = len(plot.samples)
    figure = Figure(figsize=(9, 1.25 * count + 1.9), dpi=_DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    for panel, (name, found) in zip(axes, plot.samples.items(), strict=True):
        panel.hist(found, bins=np.linspace(low, high, _BINS + 1).tolist(), color=_BAR)
        _mark(panel, plot, low, high)
        panel.set_yscale("log")
        panel.set_ylim(0.7, 2 * max(len(found), 2))
        ticks = [10**power for power in range(len(f"{len(found)}"))]
        panel.set_yticks(ticks, [f"{tick}" for tick in ticks], fontsize=8)
        panel.yaxis.set_minor_locator(NullLocator())
        panel.set_ylabel(f"{plot.counted} (log.)", fontsize=8)
        panel.set_title(f"{name}: {len(found)}", fontsize=9, loc="left")
        panel.grid(color=_GRID, linewidth=0.6)
        panel.set_axisbelow(True)
    axes[-1].ticklabel_format(axis="x", useOffset=False)
    axes[-1].set_xlabel(f"{_legend(plot, low, high)}\n{note}", fontsize=8)
    figure.suptitle(PLOTS[path.name], x=0.01, ha="left", fontsize=11)
    with replacing(path) as file:
        # Nothing of the time or the versions of the machine: the same figures, the same file.
        figure.savefig(file, format="png", metadata={"Software": None})


def _mark(panel: Axes, plot: _Plot, low: float, high: float) -> None:
    for limit in plot.limits:
        if low <= limit <= high:
            panel.axvline(limit, color=_LIMIT, linewidth=1.2)
    if plot.aim is not None:
        panel.axvline(plot.aim, color=_AIM, linewidth=1.2, linestyle="--")
    panel.set_xlim(low, high)


def _legend(plot: _Plot, low: float, high: float) -> str:
    """What stands below the axis: the unit, and what the lines are or where there are none."""
    limits = " and ".join(f"{limit:g} us" for limit in plot.limits)
    if all(low <= limit <= high for limit in plot.limits):
        text = f"us; red: the limit, {limits}"
    else:
        text = f"us; the limits, {limits}, lie outside of what is shown"
    return text if plot.aim is None else f"{text}; green: the aim, {plot.aim:g} us"
