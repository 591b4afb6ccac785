"""A board that has booted to the prompt, fresh for every test."""

from pathlib import Path

import pytest

from ghst_tools.emulator import Board


@pytest.fixture
def board(micropython_image: Path) -> Board:
    """A board without a file system, at the prompt, with nothing left to do."""
    board = Board(micropython_image)
    board.boot()
    # MicroPython is interrupted at the frames of the bus for 10 ms behind the port's opening.
    board.run_for(20e6)
    return board
