"""A Pico with the firmware of this tree, fresh for every test."""

from pathlib import Path

import pytest
from rig import Pico

from ghst_tools import boards, device_files


@pytest.fixture(scope="session")
def firmware_files() -> dict[str, bytes]:
    """What goes on boards/rpi_pico, compiled from the tree as it is."""
    return device_files.collect(boards.load("rpi_pico"))


@pytest.fixture
def pico(micropython_image: Path, firmware_files: dict[str, bytes]) -> Pico:
    """A fresh Pico, powered off."""
    return Pico(micropython_image, firmware_files, boards.load("rpi_pico").filesystem_size)
