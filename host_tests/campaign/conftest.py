"""Boards for the campaign's tests."""

from pathlib import Path

import pytest

from ghst_tools.campaign.picos import Picos


@pytest.fixture(scope="session")
def picos(micropython_image: Path) -> Picos:
    """Boards with the firmware of this tree; trials run in forks of them."""
    return Picos(micropython_image)
