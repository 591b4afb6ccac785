"""Sticks that follow keys."""

from __future__ import annotations

from ghst_tools.control_frames import CENTRE
from ghst_tools.simulate.sticks import HIGHEST_US, LOWEST_US, THROTTLE, Pulses, at_rest

STEP_US = 25
HELP = (
    "arrows: channels 1, 2   w s: throttle (3)   a d: channel 4   5-8: switch that channel   "
    "space: sticks to the middle   x: throttle low   l: link lost or back   q: end"
)

_LOW, _HIGH = 4 * LOWEST_US, 4 * HIGHEST_US
# Key -> channel and direction, in the order aileron, elevator, throttle, rudder.
_MOVES = {
    "right": (1, 1),
    "left": (1, -1),
    "up": (2, 1),
    "down": (2, -1),
    "w": (THROTTLE, 1),
    "s": (THROTTLE, -1),
    "d": (4, 1),
    "a": (4, -1),
}
_SWITCHES = "5678"
_POSITIONS = (_LOW, CENTRE, _HIGH)


class Keyboard:
    """Channels that keys move; `lost` and `ended` are what the keys for these say."""

    end_s: float | None = None

    def __init__(self) -> None:
        self.lost = False
        self.ended = False
        self._pulses = at_rest()
        for channel in map(int, _SWITCHES):
            self._pulses[channel - 1] = _LOW

    def pulses(self, t_s: float) -> Pulses:
        """As `Sticks.pulses`."""
        return list(self._pulses)

    def press(self, key: str) -> None:
        """Take a key; those that mean nothing are left alone."""
        key = key if key in _MOVES else key.lower()
        pulses = self._pulses
        if key in _MOVES:
            channel, direction = _MOVES[key]
            pulse = pulses[channel - 1] + 4 * STEP_US * direction
            pulses[channel - 1] = max(_LOW, min(_HIGH, pulse))
        elif key in _SWITCHES:
            at = _POSITIONS.index(pulses[int(key) - 1])
            pulses[int(key) - 1] = _POSITIONS[(at + 1) % len(_POSITIONS)]
        elif key == " ":
            for channel in (1, 2, 4):
                pulses[channel - 1] = CENTRE
        elif key == "x":
            pulses[THROTTLE - 1] = _LOW
        elif key == "l":
            self.lost = not self.lost
        elif key == "q":
            self.ended = True
