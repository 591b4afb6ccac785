"""The supply in a wiring picture: the BEC below the board, and the rails on either side."""

import textwrap
from dataclasses import dataclass

from ghst_tools import wiring_layout as layout
from ghst_tools.boards import Board
from ghst_tools.svg import Drawing


@dataclass(frozen=True)
class SupplyPin:
    """A supply pin on the outer edge of a module."""

    on_left: bool
    y: int
    five_volts: bool
    """Else ground."""


def draw_bec(drawing: Drawing, board: Board, bottom: int, pins: list[SupplyPin]) -> int:
    """Draw what is below the board, whose lower edge is `bottom`; returns the height below it."""
    top = bottom + 84
    supply = board.connection("BEC 5 V")
    ground = board.connection("ground")
    for x, row, colour in (
        (layout.SUPPLY_PIN, supply, layout.FIVE_VOLTS),
        (layout.GROUND_PIN, ground, layout.GROUND),
    ):
        drawing.wire([(x, top), (x, bottom)], colour)
        drawing.text((x, bottom - 12), row.to, anchor="middle", bold=True)
    note = supply.note
    if supply.part:
        drawing.diode((layout.SUPPLY_PIN, bottom + 42), upwards=True)
        note = f"{supply.part}, {note}"
    for number, line in enumerate(textwrap.wrap(note[:1].upper() + note[1:], 46)):
        at = (layout.SUPPLY_PIN - 24, bottom + 38 + 17 * number)
        drawing.text(at, line, anchor="end", size=12, colour=layout.GREY)
    size = (layout.BEC_RIGHT - layout.BEC_LEFT, 84)
    drawing.box((layout.BEC_LEFT, top), size, *layout.MODULE_BOX)
    drawing.text((layout.MIDDLE, top + 47), "BEC", anchor="middle", bold=True)
    for left in (True, False):
        _rails(drawing, left, top, [pin for pin in pins if pin.on_left is left])
    return top + 84


def _rails(drawing: Drawing, left: bool, top: int, pins: list[SupplyPin]) -> None:
    """The rails of one side; ground lies outside and hops over the other."""
    way = 1 if left else -1
    side, edge, bec = (
        (0, layout.LEFT, layout.BEC_LEFT)
        if left
        else (layout.WIDTH, layout.WIDTH - layout.LEFT, layout.BEC_RIGHT)
    )
    inner = side + way * layout.RAIL_5V
    outer = side + way * layout.RAIL_GROUND
    highest = min(pin.y for pin in pins if pin.five_volts)
    for five, rail, y, name, colour in (
        (True, inner, top + 28, "5 V", layout.FIVE_VOLTS),
        (False, outer, top + 58, "GND", layout.GROUND),
    ):
        heights = sorted(pin.y for pin in pins if pin.five_volts is five)
        drawing.wire([(bec, y), (rail, y), (rail, heights[0])], colour)
        drawing.text((bec + way * 12, y + 5), name, anchor="start" if left else "end")
        for height in heights:
            if five or height < highest:
                drawing.wire([(edge, height), (rail, height)], colour)
            else:
                drawing.hopping_wire((edge, height), rail, inner, colour)
            if height != heights[0]:
                drawing.dot((rail, height), colour)
