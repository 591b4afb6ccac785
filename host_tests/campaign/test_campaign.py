"""The short form of the campaign."""

from __future__ import annotations

from pathlib import Path

import pytest

from ghst_tools.campaign.areas import AREAS
from ghst_tools.campaign.effort import SEED, SHORT
from ghst_tools.campaign.picos import Picos
from ghst_tools.campaign.setting import Setting

# The names of the trials need no image.
TRIALS = [
    (area, name) for area in AREAS for name, _ in AREAS[area].trials(Setting(Path(), SHORT, SEED))
]


@pytest.mark.parametrize(("area", "name"), TRIALS)
def test_the_short_form(area: str, name: str, picos: Picos) -> None:
    setting = Setting(picos.image, SHORT, SEED)
    setting.__dict__["picos"] = picos
    rows = dict(AREAS[area].trials(setting))[name]()
    assert rows and all(row.fault and row.done and row.happened for row in rows)
