"""Boards that start from what a failure of the power has left."""

from __future__ import annotations

import json
from functools import partial

import pytest

from ghst_tools import filesystem
from ghst_tools.campaign.cut_starts import start
from ghst_tools.campaign.picos import Picos, forked
from ghst_tools.campaign.power import BROKEN, NEW, OLD
from ghst_tools.campaign.verdict import Wrong


def image(picos: Picos, files: dict[str, bytes]) -> bytes:
    return filesystem.build(picos.files | files, picos.filesystem_size)


def test_a_new_file_that_has_not_its_name_yet_is_flown(picos: Picos) -> None:
    left = {"/ghst.json.new": json.dumps(NEW).encode(), "/ghst.json.broken": BROKEN}
    happened = forked(partial(start, picos, image(picos, left), NEW, None))
    assert "failsafe after 400 ms" in happened


def test_what_is_not_as_due_is_noticed(picos: Picos) -> None:
    old = image(picos, {"/ghst.json": json.dumps(OLD).encode()})
    with pytest.raises(Wrong, match=r"/ghst.json after the start"):
        forked(partial(start, picos, old, NEW, None))
    with pytest.raises(Wrong, match=r"what it tells"):
        forked(partial(start, picos, old, {}, "/ghst.json is broken: no valid JSON"))
