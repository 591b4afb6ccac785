"""Outputs that do not show what is due make each trial fail that looks at them."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from ghst_tools import boards, device_files
from ghst_tools.campaign.areas import AREAS
from ghst_tools.campaign.effort import SEED, SHORT
from ghst_tools.campaign.picos import Picos
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Wrong

# Where the firmware is broken: file, what stands in it, what does then.
BREAKS = {
    "all outputs follow channel 2": (
        "firmware/outputs.py",
        "uctypes.addressof(receiver.pulses) + 2 * (output.channel - 1)",
        "uctypes.addressof(receiver.pulses) + 2",
    ),
    "the first output keeps its pulse in every other tick": (
        "firmware/interrupts.py",
        "                ptr32(slice[0])[0] = (high << 16) | low\n",
        "                if at == c[TABLE] and c[TICKS] & 1:\n"
        "                    low = ptr32(slice[0])[0] & 0xFFFF\n"
        "                ptr32(slice[0])[0] = (high << 16) | low\n",
    ),
}
# One of each kind; those on the same board stand together.
TRIALS = {
    "line": (
        "line stuck low, in flight, for 200 ms",
        "glitches, 10 ns, one anywhere in each frame",
        "slow edges, all rising edges 300 ns late",
        "baud rate off, by -2.5 %",
        "second talker in our slot",
        "receiver doubles its frames, 0 us apart",
        "echo missing",
    ),
    "time": (
        "link lost",
        "rates",
        "changing rate",
        "clock wraps, in flight, at 2^32 us",
        "clock wraps, whole application, at 2^32 us",
    ),
    "cpu": ("SystemExit", "deaf"),
    "flight": ("flight",),
    "bytes": ("wire",),
}


@pytest.fixture(scope="module", params=BREAKS)
def broken(
    request: pytest.FixtureRequest,
    micropython_image: Path,
    tmp_path_factory: pytest.TempPathFactory,
) -> Picos:
    """Boards whose firmware is broken."""
    name, old, new = BREAKS[request.param]
    root = tmp_path_factory.mktemp("broken")
    for part in ("firmware", "lib"):
        shutil.copytree(boards.checkout() / part, root / part)
    text = (root / name).read_text(encoding="utf-8")
    assert text.count(old) == 1
    (root / name).write_text(text.replace(old, new), encoding="utf-8")
    picos = Picos(micropython_image)
    picos.files = device_files.collect(boards.load(boards.DEFAULT_BOARD), root)
    return picos


@pytest.mark.parametrize(
    ("area", "begin"), [(area, begin) for area, begins in TRIALS.items() for begin in begins]
)
def test_wrong_outputs_are_noticed(broken: Picos, area: str, begin: str) -> None:
    setting = Setting(broken.image, SHORT, SEED)
    setting.__dict__["picos"] = broken
    trial = next(trial for name, trial in AREAS[area].trials(setting) if name.startswith(begin))
    with pytest.raises(Wrong, match=r"compare values|on GP|compare write"):
        trial()
