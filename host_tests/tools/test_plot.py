"""`ghst plot`: what is in the picture."""

from __future__ import annotations

import re
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.axes import Axes
from recordings import log_text, pack, pulses, reads, uplink

from ghst import encode
from ghst_tools.cli import ghst
from ghst_tools.frames.formats import Source
from ghst_tools.frames.recording import load
from ghst_tools.plot import draw

COUNT = 60


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "flight.log"
    path.write_text(log_text(COUNT))
    return path


def drawn(path: Path) -> dict[str, Axes]:
    """The diagrams by their titles."""
    figure = draw._draw(load(Source(path)))
    return {axes.get_title(loc="left"): axes for axes in figure.axes}


def test_channels_and_link_are_those_of_the_recording(log: Path) -> None:
    diagrams = drawn(log)
    assert list(diagrams)[:12] == [f"channel {number}" for number in range(1, 13)]
    begins_s = [0.01 + 0.004 * index for index in range(COUNT)]
    (first,) = diagrams["channel 1"].lines
    assert first.get_xdata() == pytest.approx(begins_s, abs=1e-6)
    raw = [encode.raw_primary(0x10, pulses(index)[0]) for index in range(COUNT)]
    sent_us = [(6000 + (5 * (value - 1984) >> 2)) / 4 for value in raw]
    assert first.get_ydata() == pytest.approx(sent_us)
    # Channel 9 comes with every third frame, the first one among them.
    (ninth,) = diagrams["channel 9"].lines
    assert ninth.get_xdata() == pytest.approx(begins_s[0::3], abs=1e-6)
    (quality,) = diagrams["link quality, %"].lines
    assert list(quality.get_ydata()) == [99 - index % 7 for index in range(1, COUNT, 3)]
    (rssi,) = diagrams["RSSI, dBm"].lines
    assert set(rssi.get_ydata()) == {-70}


def test_the_histograms_count_what_was_measured(log: Path) -> None:
    diagrams = drawn(log)
    intervals = diagrams["from control frame to control frame, us"]
    slots = diagrams["slot: from a control frame's end to the telemetry's start, us"]
    assert sum(bar.get_height() for bar in intervals.patches) == COUNT - 1
    assert sum(bar.get_height() for bar in slots.patches) == COUNT // 4
    assert intervals.texts[0].get_text().startswith("59 measured\nmedian 4000.0 us\n")
    assert re.match(r"15 measured\nmedian 1000\.\d us\n", slots.texts[0].get_text())


def test_what_came_in_one_read_is_not_in_a_histogram(tmp_path: Path) -> None:
    path = tmp_path / "bursts.log"
    frames = uplink(6)
    lines = [f"{0.1 * n:.3f} {(frames[2 * n] + frames[2 * n + 1]).hex()}\n" for n in range(3)]
    path.write_text("# ghst log 1\n" + "".join(lines) + f"0.4 {(frames[0] + pack(1)).hex()}\n")
    diagrams = drawn(path)
    intervals = diagrams["from control frame to control frame, us"]
    assert sum(bar.get_height() for bar in intervals.patches) == 3
    assert "3 not measured (one read)" in intervals.texts[0].get_text()
    slots = diagrams["slot: from a control frame's end to the telemetry's start, us"]
    assert slots.texts[0].get_text() == "1 came in one read: not measured"


@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_pictures(log: Path, tmp_path: Path, suffix: str) -> None:
    out = tmp_path / f"picture{suffix}"
    result = CliRunner().invoke(ghst, ["plot", str(log), "-o", str(out)])
    assert (result.exit_code, result.stdout) == (0, f"{out}\n")
    before = out.read_bytes()
    if suffix == ".png":
        picture = matplotlib.image.imread(out)
        assert picture.shape[1] == 14 * 120
        assert np.std(picture[:, :, 0]) > 0.05
    else:
        assert before.startswith(b"<?xml")
    CliRunner().invoke(ghst, ["plot", str(log), "-o", str(out)])
    assert len(out.read_bytes()) == len(before)


def test_a_recording_without_times_is_drawn_over_its_frames(tmp_path: Path) -> None:
    path = tmp_path / "raw"
    path.write_bytes(b"".join(data for _, data in reads(8)))
    diagrams = drawn(path)
    assert "from control frame to control frame, us" not in diagrams
    (first,) = diagrams["channel 1"].lines
    # Every fourth control frame has telemetry behind it.
    assert list(first.get_xdata()) == [0, 1, 2, 3, 5, 6, 7, 8]
    assert diagrams["RSSI, dBm"].get_xlabel() == "frames (no times recorded)"


def test_a_recording_of_telemetry_alone(tmp_path: Path) -> None:
    path = tmp_path / "raw"
    path.write_bytes(pack(1))
    assert list(drawn(path)) == ["link quality, %", "RSSI, dBm"]


def test_a_kind_of_picture_that_it_does_not_draw(log: Path) -> None:
    result = CliRunner().invoke(ghst, ["plot", str(log), "-o", "picture.jpg"])
    assert (result.exit_code, result.stderr) == (
        1,
        "ghst: picture.jpg: say .svg or .png for the kind of picture\n",
    )
