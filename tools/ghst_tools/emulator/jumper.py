"""Jumpers: wires from one pin of the board to another."""

from __future__ import annotations

from ghst_tools.emulator.board import Board


class Jumper:
    """A wire between two pins, there from the beginning.

    Both have the level that either makes: where one drives low and the other high it is low, and
    a pull-up wins over a pull-down. A jumper cannot be joined to a pin that has one already.
    """

    def __init__(self, board: Board, one: int, other: int) -> None:
        """`one`, `other`: GPIO numbers."""
        self._pins = (board.pin(one), board.pin(other))
        for pin in self._pins:
            pin.join(self._pins)

    def remove(self) -> None:
        """Take the wire away."""
        for pin in self._pins:
            pin.join((pin,))
