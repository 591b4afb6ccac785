"""Tells the echo of what was sent from what the flight controller says.

On one wire everything that is sent comes back to the adapter's own RX. With separate wires, or
where the adapter hides it, there is no echo.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

# With separate wires an echo is still looked for: somebody may plug in the other lead.
_LOOKED_BACK = 8
_ON_ITS_WAY_S = 0.05


class Stretch(NamedTuple):
    """Bytes that follow in what was read, and whether they are an echo."""

    octets: bytes
    is_echo: bool


class _Sent(NamedTuple):
    time_s: float
    octets: bytes


class EchoFilter:
    """Takes what was sent and what was read, gives what was read in stretches.

    `present`: whether there is an echo; None while that is not known. `intact`, `broken`: how many
    bursts came back as they were sent, and how many did not: something else drove the wire.
    There is none if nothing comes within `patience_s` of the first of `bursts` bursts.
    """

    def __init__(self, patience_s: float = 0.3, bursts: int = 8) -> None:
        self.present: bool | None = None
        self.intact = 0
        self.broken = 0
        self._patience_s = patience_s
        self._bursts = bursts
        self._waiting: deque[_Sent] = deque()
        self._told = 0
        self._read = b""

    def sent(self, time_s: float, octets: bytes) -> None:
        """These bytes go onto the wire; told before `read` is given their echo."""
        self._waiting.append(_Sent(time_s, octets))
        self._told += 1

    def read(self, octets: bytes, now_s: float) -> list[Stretch]:
        """Take the bytes that were read next; returns the stretches that are certain now.

        Also to be called without bytes, as time goes on.
        """
        self._read += octets
        found: list[Stretch] = []
        while self._waiting and self._step(found):
            pass
        self._lose_patience(now_s, found)
        if not self._waiting:
            self._foreign(len(self._read), found)
        return found

    @property
    def settled(self) -> int:
        """Of how many bursts it is known what became of their echo."""
        return self._told - len(self._waiting)

    def finish(self, now_s: float) -> list[Stretch]:
        """Nothing more comes. What was sent just now may be on its way: that is no collision."""
        found: list[Stretch] = []
        if self.present:
            self.broken += sum(now_s - sent.time_s > _ON_ITS_WAY_S for sent in self._waiting)
        self._waiting.clear()
        self._foreign(len(self._read), found)
        return found

    def _step(self, found: list[Stretch]) -> bool:
        """Find the next echo in what was read; false: it is not there yet."""
        places = [self._read.find(sent.octets) for sent in self._waiting]
        there = [(at, number) for number, at in enumerate(places) if at >= 0]
        if not there:
            return False
        at, number = min(there)
        self._foreign(at, found)
        for _ in range(number):
            self._waiting.popleft()
            # Before the first echo it is not known that there was to be one.
            self.broken += bool(self.present)
        octets = self._waiting.popleft().octets
        self.present = True
        self.intact += 1
        found.append(Stretch(octets, True))
        self._read = self._read[len(octets) :]
        return True

    def _lose_patience(self, now_s: float, found: list[Stretch]) -> None:
        waiting = self._waiting
        if self.present is None:
            enough = len(waiting) >= self._bursts
            if enough and now_s - waiting[0].time_s > self._patience_s:
                self.present = False
        if self.present is False:
            while len(waiting) > _LOOKED_BACK:
                waiting.popleft()
            # Everything is of the other side, but for what may be the beginning of an echo.
            held = max((_overlap(self._read, sent.octets) for sent in waiting), default=0)
            self._foreign(len(self._read) - held, found)
        elif self.present:
            while waiting and now_s - waiting[0].time_s > self._patience_s:
                waiting.popleft()
                self.broken += 1

    def _foreign(self, count: int, found: list[Stretch]) -> None:
        if count:
            found.append(Stretch(self._read[:count], False))
            self._read = self._read[count:]


def _overlap(read: bytes, octets: bytes) -> int:
    """How many bytes at the end of `read` are the beginning of `octets`."""
    for size in range(min(len(read), len(octets)), 0, -1):
        if octets.startswith(read[-size:]):
            return size
    return 0
