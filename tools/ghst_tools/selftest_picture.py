"""The picture of a board's self-test, drawn from `boards/<name>/board.json`: one jumper."""

from ghst_tools import wiring_layout as layout
from ghst_tools.boards import Board
from ghst_tools.chips import CHIPS
from ghst_tools.svg import Drawing

_WIDTH = 900
_BOARD_LEFT = 330
_BOARD_RIGHT = 570
_MIDDLE = (_BOARD_LEFT + _BOARD_RIGHT) // 2
_TOP = 150  # of the first row
_JUMPER = _BOARD_LEFT - 70
_STUB = 34
_SENSORS_LEFT = 60
_SENSORS_RIGHT = 230


def picture_path(name: str) -> str:
    """Where a board's picture is, below the checkout."""
    return f"docs/img/selftest_{name}.svg"


class SelftestPicture:
    """Draws one board that has a pin for the self-test, once."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self._defaults = board.defaults
        self._drawing = Drawing(
            _WIDTH,
            f"Self-test of the {board.title}",
            "Which two pins a jumper ties, what may stay connected, and what must not be.",
        )

    def draw(self) -> bytes:
        """The SVG file."""
        outputs = self._defaults["outputs"]
        rows = max(len(outputs) + 2, 8)
        bottom = _TOP + (rows - 1) * layout.ROW + 66
        self._outline(bottom)
        self._jumper(_TOP)
        self._sensors(_TOP + 5 * layout.ROW)
        y = _TOP
        for gpio, output in outputs.items():
            self._open(y, int(gpio), f"channel {output['channel']}", layout.SERVO)
            y += layout.ROW
        self._open(
            y + layout.ROW, self._defaults["battery"]["voltage_pin"], "battery", layout.ANALOG
        )
        return self._drawing.finish(bottom + 30)

    def _outline(self, bottom: int) -> None:
        drawing = self._drawing
        drawing.text((28, 36), f"Self-test of the {self._board.title}", size=21, bold=True)
        hint = (
            "Pins are ordered by use, not as they lie on the board. No receiver, no servo, no "
            "motor, no BEC: USB alone."
        )
        drawing.text((28, 60), hint, size=13, colour=layout.GREY)
        top = _TOP - layout.HALF - 20
        drawing.box((_MIDDLE - 26, top - 12), (52, 24), "#dee2e6", "#868e96", radius=4)
        size = (_BOARD_RIGHT - _BOARD_LEFT, bottom - top)
        drawing.box((_BOARD_LEFT, top), size, *layout.BOARD_BOX, radius=12)
        text = "USB, to the computer"
        drawing.text((_MIDDLE, top - 18), text, anchor="middle", size=12, colour=layout.GREY)
        chip = CHIPS[self._board.chip].title
        drawing.text((_MIDDLE, bottom - 20), chip, anchor="middle", size=12, colour=layout.GREY)
        note = "read back at the pins: connect nothing"
        drawing.text((_BOARD_RIGHT + 16, top + 6), note, size=13, colour=layout.GREY)

    def _pin(self, y: int, gpio: int, *, left: bool) -> None:
        label = self._board.label(gpio)
        x, anchor = (_BOARD_LEFT + 12, "start") if left else (_BOARD_RIGHT - 12, "end")
        self._drawing.text((x, y + 5), label, anchor=anchor, bold=True)
        if label != f"GP{gpio}":
            beside = 11 * len(label) + 8
            x += beside if left else -beside
            self._drawing.text(
                (x, y + 5), f"GPIO {gpio}", anchor=anchor, size=11, colour=layout.GREY
            )

    def _jumper(self, y: int) -> None:
        """The one wire that is needed."""
        below = y + 2 * layout.ROW
        ends = [(_BOARD_LEFT, y), (_JUMPER, y), (_JUMPER, below), (_BOARD_LEFT, below)]
        self._drawing.wire(ends, layout.GHOST)
        pin = self._board.selftest_pin
        assert pin is not None
        gps = self._defaults.get("gps", {})
        player = "plays the receiver" + (", GPS off" if pin in gps.values() else "")
        for height, gpio, what in (
            (y, self._defaults["wire"]["pin"], "Ghost wire"),
            (below, pin, player),
        ):
            self._pin(height, gpio, left=True)
            at = (_JUMPER - 14, height + 5)
            self._drawing.text(at, what, anchor="end", size=13, colour=layout.GREY)
        self._drawing.text((_JUMPER - 14, y + layout.ROW + 5), "jumper", anchor="end", bold=True)

    def _sensors(self, y: int) -> None:
        """The bus, whose sensors may stay."""
        height = layout.ROW + 2 * layout.HALF
        corner = (_SENSORS_LEFT, y - layout.HALF)
        self._drawing.box(corner, (_SENSORS_RIGHT - _SENSORS_LEFT, height), *layout.MODULE_BOX)
        self._drawing.text((_SENSORS_LEFT + 4, y - layout.HALF - 9), "I2C sensors", bold=True)
        for number, name in enumerate(("SDA", "SCL")):
            row = y + number * layout.ROW
            self._drawing.wire(
                [(_SENSORS_RIGHT, row), (_BOARD_LEFT, row)], layout.I2C, dashed=True
            )
            self._drawing.text((_SENSORS_RIGHT - 12, row + 5), name, anchor="end")
            self._pin(row, self._defaults["i2c"][f"{name.lower()}_pin"], left=True)
        note = "may stay, supplied as ever"
        self._drawing.text((_SENSORS_LEFT + 4, y + height + 2), note, size=12, colour=layout.GREY)

    def _open(self, y: int, gpio: int, what: str, colour: str) -> None:
        """A pin that nothing is connected to."""
        self._drawing.wire([(_BOARD_RIGHT, y), (_BOARD_RIGHT + _STUB, y)], colour)
        self._pin(y, gpio, left=False)
        self._drawing.text((_BOARD_RIGHT + _STUB + 12, y + 5), f"{what}: open")
