"""A board that has booted to the prompt, fresh for every test."""

from pathlib import Path

import pytest

from ghst_tools.emulator import Board


@pytest.fixture
def board(micropython_image: Path) -> Board:
    """A board without a file system, at the prompt."""
    board = Board(micropython_image)
    board.boot()
    return board
