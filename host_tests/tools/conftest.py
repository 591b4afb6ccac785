"""Boards to flash."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from served_board import ServedBoard


@pytest.fixture
def empty_board(micropython_image: Path) -> Iterator[ServedBoard]:
    """A board with MicroPython and nothing else."""
    board = ServedBoard(micropython_image)
    yield board
    assert board.stop() == 0
