"""Measures and colours of the wiring pictures."""

GHOST = "#c2185b"
SERVO = "#f2a900"
GPS = "#1971c2"
I2C = "#2f9e44"
ANALOG = "#7048e8"
FIVE_VOLTS = "#e03131"
THREE_VOLTS = "#a5560b"
GROUND = "#212529"
GREY = "#5f6368"
# Fill and line of a box.
MODULE_BOX = ("#f8f9fa", "#868e96")
BOARD_BOX = ("#e6f4ea", "#1b5e20")

WIDTH = 1080
TOP = 122  # of the first row
ROW = 30
HALF = 22  # from a row to the edge of its box
GAP = 84  # from the last row of a box to the first of the next
MODULE_WIDTH = 190
LEFT = 80
LEFT_END = LEFT + MODULE_WIDTH
RIGHT = WIDTH - LEFT_END
BOARD_LEFT = 420
BOARD_RIGHT = WIDTH - BOARD_LEFT
MIDDLE = WIDTH // 2
SUPPLY_PIN = MIDDLE - 60
GROUND_PIN = MIDDLE + 60
JOINT = LEFT_END + 30  # of the parts at the Ghost wire
PART = LEFT_END + 84
DIVIDER = BOARD_RIGHT + 46
RAIL_5V = 52  # from either side
RAIL_GROUND = 28
BEC_LEFT = BOARD_LEFT + 20
BEC_RIGHT = BOARD_RIGHT - 20
