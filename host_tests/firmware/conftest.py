"""A Pico with the firmware of this tree, fresh for every test, or a copy of a started one."""

from pathlib import Path

import pytest
from rig import Pico

from forked import forked
from ghst_tools import boards, device_files

MARKERS = ("boot", "run")
KEPT = 4
"""Started boards that wait for the next test: each takes a hundred megabytes."""


def pytest_configure(config: pytest.Config) -> None:
    """Register the markers that start the board before the test."""
    config.addinivalue_line("markers", "boot(...): `pico` has done `boot` with these arguments")
    config.addinivalue_line("markers", "run(...): `pico` has done `run` with these arguments")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Have tests of a board that was started before run in a fork: others start from it, too."""
    for item in items:
        if isinstance(item, pytest.Function) and _start_of(item):
            item.obj = forked(item.obj)


def _start_of(item: pytest.Item) -> pytest.Mark | None:
    return next((mark for mark in item.iter_markers() if mark.name in MARKERS), None)


@pytest.fixture(scope="session")
def firmware_files() -> dict[str, bytes]:
    """What goes on boards/rpi_pico, compiled from the tree as it is."""
    return device_files.collect(boards.load("rpi_pico"))


_started: dict[str, Pico] = {}


@pytest.fixture
def pico(
    micropython_image: Path, firmware_files: dict[str, bytes], request: pytest.FixtureRequest
) -> Pico:
    """A Pico, powered off, or started as the test's marker says."""
    mark = _start_of(request.node)
    key = repr(mark and (mark.name, mark.args, mark.kwargs))
    if key in _started:
        # The one that was needed longest ago goes first.
        _started[key] = _started.pop(key)
        return _started[key]
    pico = Pico(micropython_image, firmware_files, boards.load("rpi_pico").filesystem_size)
    if mark:
        getattr(pico, mark.name)(*mark.args, **mark.kwargs)
        while len(_started) >= KEPT:
            del _started[next(iter(_started))]
        _started[key] = pico
    return pico
