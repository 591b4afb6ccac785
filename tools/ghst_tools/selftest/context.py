"""What the checks share: the board, its pins and their names, the frames for them."""

from __future__ import annotations

from dataclasses import dataclass

from ghst import Receiver, encode  # type: ignore[import-not-found]
from ghst_tools.boards import Board
from ghst_tools.selftest.session import Session
from ghst_tools.selftest_picture import picture_path

HOLD = -1
"""`firmware.interrupts.HOLD`."""
FIXED_PULSE = 4800  # 1200 us
RACE = 6
PURE_RACE = 7
"""An RF mode with a downlink, and one without."""

_AUXILIARY = (0x10, 0x11, 0x12)
_TWELVE_BIT = 0x20
_CENTRES = (1984, 2048)


def link_frame(rf_mode: int = RACE) -> bytes:
    """Link data that tells an RF mode."""
    return bytes(encode.link_data(0x13, [_CENTRES[0]] * 4, lq=93, rssi_dbm=-71, rf_mode=rf_mode))


@dataclass(frozen=True)
class Stick:
    """Frames that bring a pulse width to each channel."""

    name: str
    frames: tuple[bytes, ...]

    @property
    def pulses(self) -> list[int]:
        """What the channels are, in quarter microseconds."""
        receiver = Receiver()
        for frame in self.frames:
            receiver.feed(frame)
        return list(receiver.pulses)


def sticks(channels: int) -> list[Stick]:
    """Positions for channels 1 to `channels`, all of them far apart, and the ends of the range."""
    kinds = _AUXILIARY[: max(1, (channels - 1) // 4)]
    rising = [4160 + 240 * number for number in range(16)]
    ends = [0, 4095, 0, 4095]
    return [
        Stick("legacy", tuple(encode.channels_from_pulses(kind, rising) for kind in kinds)),
        Stick(
            "12-bit",
            tuple(encode.channels_from_pulses(kind | _TWELVE_BIT, rising[::-1]) for kind in kinds),
        ),
        Stick(
            "ends of the range",
            tuple(encode.channels(kind, ends, [end >> 4 for end in ends]) for kind in kinds),
        ),
    ]


class Context:
    """One run of the self-test."""

    def __init__(self, session: Session, board: Board, clock_hz: int) -> None:
        """`clock_hz`: of the chip, as the board tells it."""
        assert board.selftest_pin is not None
        self.session = session
        self.board = board
        self.clock_hz = clock_hz
        self.wire_pin = int(board.defaults["wire"]["pin"])
        self.pin = board.selftest_pin
        outputs = board.defaults["outputs"]
        self.servos = {int(pin): int(output["channel"]) for pin, output in outputs.items()}
        pins = sorted(self.servos)
        # Two outputs that do something in failsafe; the others give no pulses.
        self.held, self.fixed = pins[0], pins[1]
        self.failsafe = {self.held: HOLD, self.fixed: FIXED_PULSE}
        self.sticks = sticks(max(self.servos.values()))

    def name(self, pin: int) -> str:
        """A pin as people find it on the board: its label, and its number where that differs."""
        label = self.board.label(pin)
        return label if label == f"GP{pin}" else f"{label} (GPIO {pin})"

    def names(self, pins: list[int]) -> str:
        """Several pins, or "none"."""
        return " and ".join(map(self.name, pins)) or "none"

    def edges(self, pins: list[int]) -> str:
        """How a check tells that pins have moved."""
        return f"edges at {', '.join(map(self.name, pins))}" if pins else "no edge"

    @property
    def picture(self) -> str:
        return picture_path(self.board.name)
