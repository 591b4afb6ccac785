"""What the simulated Ghost receiver sends: sticks that move, in legs of one kind of frame each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from ghst_tools import captures
from ghst_tools.control_frames import CENTRE, ROTATIONS, control_frame

RATE_HZ = 250
CHANNELS = 16

_FRAME_BYTES = 14
_12_BIT = 0x20
# Each frame has the sticks, and in turn four of the other channels or the link data.
_ROTATION = ROTATIONS[CHANNELS]
_RF_MODE = 10  # Race250: the one with telemetry at 250 Hz

# Out of 1: how the time of the flight is divided.
_SHARES = (0.3, 0.3, 0.25, 0.15)


@dataclass(frozen=True)
class Leg:
    """A piece of the flight: what it is, and the frames that the receiver sends, one a slot."""

    name: str
    frames: tuple[bytes, ...]


@dataclass(frozen=True)
class Flight:
    """The whole flight: the link is cut inside the frame `cut`, between `before` and `after`."""

    before: tuple[Leg, ...]
    cut: bytes
    after: Leg

    @property
    def legs(self) -> tuple[Leg, ...]:
        """All legs in their order."""
        return (*self.before, self.after)


def plan(seconds: float) -> Flight:
    """A flight of `seconds` of emulated time, not counting the time without a link.

    A part of the real receiver's capture is in it if the capture is there.
    """
    counts = [max(8, round(share * seconds * RATE_HZ)) for share in _SHARES]
    capture = _capture_leg(counts[2])
    if capture is None:
        counts[0] += counts[2] // 2
        counts[1] += counts[2] - counts[2] // 2
    first = counts[0]
    second = first + counts[1]
    third = second + counts[3]
    before = [
        Leg("12-bit frames 0x30-0x33", _stick_frames(_12_BIT, 0, first)),
        Leg("legacy frames 0x10-0x13", _stick_frames(0, first, second)),
    ]
    if capture is not None:
        before.append(capture)
    after = Leg("link back, 12-bit frames", _stick_frames(_12_BIT, second, third))
    return Flight(tuple(before), _stick_frame(_12_BIT, second), after)


def sticks(t_s: float, swing_us: float) -> list[int]:
    """Pulse widths of 16 channels at `t_s`, in quarter microseconds.

    The sticks (1-4) swing by `swing_us` around the centre; 5 and 6 are switches with two and three
    positions, 7 and 8 knobs; 9-16 are the others at half the swing.
    """

    def wave(hertz: float, phase: float) -> float:
        return math.sin(2 * math.pi * (hertz * t_s + phase))

    moves = [
        wave(1.1, 0.0),
        wave(0.9, 0.25),
        2 * abs(2 * (0.8 * t_s % 1) - 1) - 1,
        wave(1.7, 0.4),
        1.0 if t_s % 0.8 < 0.4 else -1.0,
        float(int(t_s / 0.3) % 3 - 1),
        0.8 * wave(0.5, 0.1),
        2 * (0.7 * t_s % 1) - 1,
    ]
    moves += [move / 2 for move in moves]
    return [CENTRE + round(4 * swing_us * move) for move in moves]


def pulses_in(frame: bytes) -> dict[int, int]:
    """Channel number -> pulse width in quarter microseconds of a valid control frame.

    Worked out from the bits by the table of the protocol's description, and not by `ghst`: the
    decoder under test must not be its own judge.
    """
    kind = frame[2]
    packed = int.from_bytes(frame[3:9], "little")
    primaries = [packed >> 12 * index & 0xFFF for index in range(4)]
    if kind & _12_BIT:
        values = {1 + i: CENTRE + (raw - 2048) for i, raw in enumerate(primaries)}
    else:
        values = {1 + i: CENTRE + (5 * (raw - 1984) >> 2) for i, raw in enumerate(primaries)}
    if kind & 0x0F <= 2:
        first = 5 + 4 * (kind & 0x0F)
        centre, step = (128, 16) if kind & _12_BIT else (124, 20)
        values |= {first + i: CENTRE + step * (raw - centre) for i, raw in enumerate(frame[9:13])}
    return values


def _stick_frames(scaling: int, start: int, stop: int) -> tuple[bytes, ...]:
    return tuple(_stick_frame(scaling, index) for index in range(start, stop))


def _stick_frame(scaling: int, index: int) -> bytes:
    # The legacy scaling reaches beyond -100..+100 %, and radios do send that: the sticks go to the
    # ends of what the frame can carry.
    pulses = sticks(index / RATE_HZ, 500 if scaling else 660)
    return control_frame(
        scaling | _ROTATION[index % len(_ROTATION)],
        pulses,
        lq=100 - index // 40 % 20,
        rssi_dbm=-60 - index // 20 % 40,
        rf_mode=_RF_MODE,
        telemetry=True,
    )


def _capture_leg(count: int) -> Leg | None:
    """The part of the real receiver's capture in which the sticks move most."""
    path = captures.px4_path()
    if not path.is_file():
        return None
    stream = b"".join(data for data, _ in captures.read_px4(path))
    frames = [stream[i : i + _FRAME_BYTES] for i in range(0, len(stream), _FRAME_BYTES)]
    frames = [frame for frame in frames if len(frame) == _FRAME_BYTES]
    moved = [0]
    for before, frame in pairwise(frames):
        now, then = pulses_in(frame), pulses_in(before)
        moved.append(moved[-1] + sum(abs(now[channel] - then[channel]) for channel in range(1, 5)))
    count = min(count, len(frames))
    first = max(range(len(frames) - count + 1), key=lambda i: moved[i + count - 1] - moved[i])
    name = f"real receiver, frames {first + 1} to {first + count} of {len(frames)}"
    return Leg(name, tuple(frames[first : first + count]))
