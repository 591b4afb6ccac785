"""The picture of a board's wiring, drawn from `boards/<name>/board.json`.

Modules stand left and right of the board, each row of pins on one height; two rails on either
side carry 5 V and ground from the BEC below.
"""

from ghst_tools import wiring_layout as layout
from ghst_tools.boards import Board
from ghst_tools.chips import CHIPS
from ghst_tools.svg import Drawing
from ghst_tools.wiring_supply import SupplyPin, draw_bec


class WiringPicture:
    """Draws one board, once."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self._defaults = board.defaults
        self._kinds = {"Ghost wire": layout.GHOST, "servo signal": layout.SERVO}
        self._supplies: list[SupplyPin] = []
        self._drawing = Drawing(
            layout.WIDTH,
            f"Wiring of the {board.title}",
            "Which pin is connected to the receiver, the servos, the sensors and the supply.",
        )

    def draw(self) -> bytes:
        """The SVG file."""
        rows_left = [3] + [2] * ("gps" in self._defaults) + [3] * ("i2c" in self._defaults)
        self._battery_rows = 3 if "current_pin" in self._defaults.get("battery", {}) else 2
        rows_right = [len(self._defaults["outputs"])]
        rows_right += [self._battery_rows] * ("battery" in self._defaults)
        bottom = layout.TOP + 66 + max(
            sum((rows - 1) * layout.ROW + layout.GAP for rows in side) - layout.GAP
            for side in (rows_left, rows_right)
        )  # fmt: skip
        self._outline(bottom)
        y = self._receiver(layout.TOP)
        if "gps" in self._defaults:
            y = self._gps(y)
        if "i2c" in self._defaults:
            self._sensors(y)
        y = self._servos(layout.TOP)
        if "battery" in self._defaults:
            self._battery(y)
        self._kinds |= {"5 V": layout.FIVE_VOLTS, "ground": layout.GROUND}
        below = draw_bec(self._drawing, self._board, bottom, self._supplies)
        return self._drawing.finish(self._legend(below))

    # -- the parts of modules -----------------------------------------------------------------

    def _module(self, title: str, y: int, rows: int, *, left: bool) -> int:
        """A box around `rows` rows from `y` on; returns the first row of the next box."""
        x = layout.LEFT if left else layout.RIGHT
        height = (rows - 1) * layout.ROW + 2 * layout.HALF
        self._drawing.box((x, y - layout.HALF), (layout.MODULE_WIDTH, height), *layout.MODULE_BOX)
        self._drawing.text((x + 4, y - layout.HALF - 9), title, bold=True)
        return y + (rows - 1) * layout.ROW + layout.GAP

    def _inner(self, y: int, text: str, *, left: bool) -> None:
        """The name of a module's pin that faces the board."""
        if left:
            self._drawing.text((layout.LEFT_END - 12, y + 5), text, anchor="end")
        else:
            self._drawing.text((layout.RIGHT + 12, y + 5), text)

    def _supply(self, y: int, text: str, *, left: bool) -> None:
        """A supply pin on the outer edge of a module."""
        if left:
            self._drawing.text((layout.LEFT + 12, y + 5), text)
        else:
            self._drawing.text((layout.WIDTH - layout.LEFT - 12, y + 5), text, anchor="end")
        self._supplies.append(SupplyPin(left, y, text == "5 V"))

    def _pin(self, y: int, label: str, gpio: int | None = None, *, left: bool) -> None:
        """The name of a pin of the board, and its number where that is another."""
        x, anchor = (layout.BOARD_LEFT + 12, "start") if left else (layout.BOARD_RIGHT - 12, "end")
        self._drawing.text((x, y + 5), label, anchor=anchor, bold=True)
        if gpio is not None and label not in (f"GP{gpio}", str(gpio)):
            beside = 11 * len(label) + 8
            x += beside if left else -beside
            self._drawing.text(
                (x, y + 5), f"GPIO {gpio}", anchor=anchor, size=11, colour=layout.GREY
            )

    def _connect(self, y: int, name: str, gpio: int, colour: str, *, left: bool) -> None:
        """A plain wire from a module's pin to one of the board."""
        ends = (
            [(layout.LEFT_END, y), (layout.BOARD_LEFT, y)]
            if left
            else [(layout.BOARD_RIGHT, y), (layout.RIGHT, y)]
        )
        self._drawing.wire(ends, colour)
        self._inner(y, name, left=left)
        self._pin(y, self._board.label(gpio), gpio, left=left)

    # -- modules ------------------------------------------------------------------------------

    def _receiver(self, y: int) -> int:
        drawing = self._drawing
        below = self._module("Ghost receiver", y, 3, left=True)
        wire_y, tx_y = y + layout.ROW, y + 2 * layout.ROW
        rows = [row for row in self._board.wiring if row.source == "receiver Tx" and row.part]
        for row in rows:
            tx = row.to == self._label_of("tx_pin")
            row_y = tx_y if tx else y
            drawing.wire(
                [(layout.JOINT, wire_y), (layout.JOINT, row_y), (layout.BOARD_LEFT, row_y)],
                layout.GHOST if tx else layout.THREE_VOLTS,
                dashed=row.optional,
            )
            text = row.part.replace("kOhm", "kΩ")
            if row.optional:
                text += " for long leads"
            if tx:
                drawing.diode((layout.PART, row_y))
                self._pin(row_y, row.to, self._defaults["wire"]["tx_pin"], left=True)
            else:
                drawing.resistor((layout.PART, row_y))
                self._pin(row_y, row.to, left=True)
                self._kinds["3.3 V"] = layout.THREE_VOLTS
            text_y = row_y + 24 if tx else row_y - 12
            drawing.text((layout.PART, text_y), text, anchor="middle", size=12)
        self._connect(wire_y, "Tx", self._defaults["wire"]["pin"], layout.GHOST, left=True)
        drawing.dot((layout.JOINT, wire_y), layout.GHOST)
        self._supply(y, "5 V", left=True)
        self._supply(tx_y, "GND", left=True)
        return below

    def _label_of(self, key: str) -> str | None:
        gpio = self._defaults["wire"].get(key)
        return None if gpio is None else self._board.label(gpio)

    def _gps(self, y: int) -> int:
        self._kinds["GPS"] = layout.GPS
        below = self._module("GPS", y, 2, left=True)
        self._connect(y, "RX", self._defaults["gps"]["tx_pin"], layout.GPS, left=True)
        self._connect(y + layout.ROW, "TX", self._defaults["gps"]["rx_pin"], layout.GPS, left=True)
        self._supply(y, "5 V", left=True)
        self._supply(y + layout.ROW, "GND", left=True)
        return below

    def _sensors(self, y: int) -> int:
        self._kinds |= {"I2C": layout.I2C, "3.3 V": layout.THREE_VOLTS}
        names = [name for name in ("barometer", "magnetometer") if name in self._defaults]
        below = self._module(", ".join(names).capitalize() or "I2C", y, 3, left=True)
        self._connect(y, "SDA", self._defaults["i2c"]["sda_pin"], layout.I2C, left=True)
        self._connect(
            y + layout.ROW, "SCL", self._defaults["i2c"]["scl_pin"], layout.I2C, left=True
        )
        y += 2 * layout.ROW
        self._drawing.wire([(layout.LEFT_END, y), (layout.BOARD_LEFT, y)], layout.THREE_VOLTS)
        self._inner(y, "3.3 V", left=True)
        self._pin(y, self._board.connection("sensors 3.3 V").to, left=True)
        self._supply(y, "GND", left=True)
        return below

    def _servos(self, y: int) -> int:
        outputs = {int(gpio): output for gpio, output in self._defaults["outputs"].items()}
        below = self._module("Servos", y, len(outputs), left=False)
        for number, (gpio, output) in enumerate(outputs.items()):
            name = f"channel {output['channel']}"
            self._connect(y + number * layout.ROW, name, gpio, layout.SERVO, left=False)
        self._supply(y, "5 V", left=False)
        self._supply(y + layout.ROW, "GND", left=False)
        return below

    def _battery(self, y: int) -> int:
        self._kinds["analog"] = layout.ANALOG
        drawing = self._drawing
        battery = self._defaults["battery"]
        below = self._module("Battery", y, self._battery_rows, left=False)
        self._connect(
            y,
            f"+, up to {self._board.battery_limit_v} V",
            battery["voltage_pin"],
            layout.ANALOG,
            left=False,
        )
        drawing.resistor((layout.RIGHT - 44, y))
        drawing.text(
            (layout.RIGHT - 44, y - 12), f"{battery['divider'] - 1:g} kΩ", anchor="middle", size=12
        )
        drawing.wire([(layout.DIVIDER, y), (layout.DIVIDER, y + 42)], layout.ANALOG)
        drawing.dot((layout.DIVIDER, y), layout.ANALOG)
        drawing.resistor((layout.DIVIDER, y + 22), vertical=True)
        drawing.text((layout.DIVIDER + 14, y + 27), "1 kΩ", size=12)
        drawing.ground((layout.DIVIDER, y + 42), layout.GROUND)
        self._supply(y, "GND", left=False)
        if "current_pin" in battery:
            name = "current sensor"
            self._connect(
                y + 2 * layout.ROW, name, battery["current_pin"], layout.ANALOG, left=False
            )
        return below

    # -- the board and its supply -------------------------------------------------------------

    def _outline(self, bottom: int) -> None:
        drawing = self._drawing
        drawing.text((28, 36), f"Wiring of the {self._board.title}", size=21, bold=True)
        hint = (
            "Pins are ordered by use, not as they lie on the board. "
            "A name that is there twice is one pin."
        )
        drawing.text((28, 60), hint, size=13, colour=layout.GREY)
        top = layout.TOP - layout.HALF
        drawing.box((layout.MIDDLE - 26, top - 12), (52, 24), "#dee2e6", "#868e96", radius=4)
        size = (layout.BOARD_RIGHT - layout.BOARD_LEFT, bottom - top)
        drawing.box((layout.BOARD_LEFT, top), size, *layout.BOARD_BOX, radius=12)
        drawing.text(
            (layout.MIDDLE, top - 17), "USB", anchor="middle", size=12, colour=layout.GREY
        )
        text = CHIPS[self._board.chip].title
        if "led" in self._defaults:
            text += f", LED on GPIO {self._defaults['led']['pin']}"
        drawing.text(
            (layout.MIDDLE, bottom - 37), text, anchor="middle", size=12, colour=layout.GREY
        )

    def _legend(self, y: int) -> int:
        """What the colours mean; returns the height of the drawing."""
        x = 28
        for name, colour in self._kinds.items():
            self._drawing.wire([(x, y + 40), (x + 28, y + 40)], colour)
            self._drawing.text((x + 36, y + 45), name, size=13)
            x += 62 + 8 * len(name)
        return y + 66
