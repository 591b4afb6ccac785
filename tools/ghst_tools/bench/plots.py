"""The histograms of docs/figures.md."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ghst_tools.bench.figures import Findings
from ghst_tools.bench.goals import LATENCY_US, SLOT_US
from ghst_tools.files import replacing

_BAR, _LIMIT, _GRID = "#1f5fa8", "#c2410c", "#d0d7de"
_DPI = 80
_BINS = 80

PLOTS = {
    "bench_latency.png": "Last stop bit to last compare register",
    "bench_slot.png": "Telemetry behind the control frame",
    "bench_pulses.png": "Pulse width at the pin against the frame",
}


def write(findings: Findings, folder: Path, note: str) -> None:
    """Draw `PLOTS` into `folder`; `note` stands below each: date, versions, what is emulated."""
    folder.mkdir(parents=True, exist_ok=True)
    latency, slot, pulses = PLOTS
    _draw(folder / latency, findings.latencies_us, (20.0, LATENCY_US + 1), (LATENCY_US,), note)
    _draw(folder / slot, findings.slots_us, (SLOT_US[0] - 1, SLOT_US[1] + 1), SLOT_US, note)
    errors = {"all servos": findings.pulse_errors_us}
    _draw(folder / pulses, errors, (-0.55, 0.55), (-0.5, 0.5), note)


def _draw(
    path: Path,
    samples: Mapping[str, Sequence[float]],
    across: tuple[float, float],
    limits: Sequence[float],
    note: str,
) -> None:
    # What is outside is shown all the same.
    values = [value for found in samples.values() for value in found]
    low, high = min(across[0], *values), max(across[1], *values)
    figure = Figure(figsize=(9, 1.25 * len(samples) + 1.4), dpi=_DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(samples), 1, sharex=True, squeeze=False)[:, 0]
    for plot, (name, found) in zip(axes, samples.items(), strict=True):
        plot.hist(found, bins=np.linspace(low, high, _BINS + 1).tolist(), color=_BAR)
        for limit in limits:
            plot.axvline(limit, color=_LIMIT, linewidth=1.2)
        plot.set_yscale("log")
        plot.set_ylim(0.7, 2 * max(len(found), 2))
        plot.set_title(f"{name}: {len(found)}", fontsize=9, loc="left")
        plot.grid(color=_GRID, linewidth=0.6)
        plot.set_axisbelow(True)
    axes[-1].set_xlabel(f"us (red: the limit)\n{note}", fontsize=8)
    figure.suptitle(PLOTS[path.name], x=0.01, ha="left", fontsize=11)
    with replacing(path) as file:
        # Nothing of the time or the versions of the machine: the same figures, the same file.
        figure.savefig(file, format="png", metadata={"Software": None})
