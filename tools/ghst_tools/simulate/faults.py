"""What goes wrong on purpose: lost link, dropouts, wrong CRC, noise; values that fall."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

_LONGEST_NOISE = 8
_ROUNDING_S = 1e-6  # what begins or ends in a slot does so at its beginning


class Loss(NamedTuple):
    """The link is lost at `start_s` for `seconds`."""

    start_s: float
    seconds: float


class Ramp(NamedTuple):
    """A value that goes evenly from `first` to `last` within `seconds`, and stays there."""

    first: int
    last: int
    seconds: float

    def at(self, t_s: float) -> int:
        """The value at this time."""
        part = min(1.0, t_s / self.seconds) if self.seconds else 1.0
        return round(self.first + (self.last - self.first) * part)


@dataclass
class Faults:
    """Spoils slots; what becomes of each depends on `seed` and its number alone.

    `drop`, `bad_crc`, `noise`: so many slots of 100 are left empty, have a CRC that is wrong in
    one bit or more, or begin with 1 to 8 random bytes.
    """

    losses: Sequence[Loss] = ()
    drop: float = 0.0
    bad_crc: float = 0.0
    noise: float = 0.0
    seed: int = 0
    lost_by_hand: bool = False
    """The link is lost as long as this is true, for whoever has a key for it."""

    def __post_init__(self) -> None:
        self.counts: Counter[str] = Counter()
        """Slots `lost` and `dropped`, frames with `bad_crc`, and `noise_bytes`."""

    def lost(self, t_s: float) -> bool:
        """Whether there is no link at this time."""
        return self.lost_by_hand or any(
            0 <= t_s - loss.start_s + _ROUNDING_S < loss.seconds for loss in self.losses
        )

    def apply(self, index: int, t_s: float, frame: bytes) -> bytes:
        """What goes over the wire in place of `frame`, in slot `index`; empty: nothing does."""
        if self.lost(t_s):
            self.counts["lost"] += 1
            return b""
        if not (self.drop or self.bad_crc or self.noise):
            return frame
        source = random.Random(f"{self.seed} {index}")
        dropped, bad, noisy = (source.random() * 100 for _ in range(3))
        if dropped < self.drop:
            self.counts["dropped"] += 1
            return b""
        if bad < self.bad_crc:
            self.counts["bad_crc"] += 1
            frame = frame[:-1] + bytes((frame[-1] ^ source.randint(1, 255),))
        if noisy < self.noise:
            octets = source.randbytes(source.randint(1, _LONGEST_NOISE))
            self.counts["noise_bytes"] += len(octets)
            frame = octets + frame
        return frame
