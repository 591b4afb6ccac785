"""Sending slot after slot, each at its time."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ghst_tools.simulate.uplink import Uplink

# For hours of slots no more memory than for the first.
_LATE_STEP_US, _LATE_BINS = 10, 10_000
_LONGEST_SLEEP_S = 0.05

Clock = Callable[[], float]
Sleep = Callable[[float], object]
Waits = Callable[[int], bool]


class Sent(NamedTuple):
    """One slot: its number, when it was due and when its bytes were handed over, in seconds.

    `octets` is empty if nothing was sent.
    """

    number: int
    due_s: float
    time_s: float
    octets: bytes


@dataclass
class Rhythm:
    """How well the slots kept their times."""

    slots: int = 0
    skipped: int = 0
    """Slots that had begun and ended while the computer did something else."""

    def __post_init__(self) -> None:
        self._late = np.zeros(_LATE_BINS + 1, np.int64)
        self._latest_s = self._first_s = self._last_s = 0.0

    def add(self, sent: Sent) -> None:
        """Take the next slot."""
        if not self.slots:
            self._first_s = sent.time_s
        self._last_s = sent.time_s
        self.skipped = sent.number - self.slots
        self.slots += 1
        late_s = max(0.0, sent.time_s - sent.due_s)
        self._latest_s = max(self._latest_s, late_s)
        self._late[min(_LATE_BINS, int(late_s * 1e6 / _LATE_STEP_US + 1e-3))] += 1

    @property
    def rate_hz(self) -> float:
        """Slots a second, as they really came."""
        passed_s = self._last_s - self._first_s
        return (self.slots - 1) / passed_s if passed_s > 0 else 0.0

    @property
    def late_us(self) -> tuple[float, float, float]:
        """By how much slots were late: the median, 99 of 100, both in whole 10 us; the latest."""
        passed = np.cumsum(self._late)
        half, most = np.searchsorted(passed, [self.slots * 0.5, self.slots * 0.99]) * _LATE_STEP_US
        return float(half), float(most), self._latest_s * 1e6


class Sender:
    """Writes what `uplink` has to the port `line`, by the absolute time of each slot.

    `start_s` is when the first slot begins. A slot is left out if the next one is due already: a
    receiver does not make up for lost time. `clock` gives seconds; `sleep` waits for some,
    and returns true if that is to be the end. Slots are left out, too, while `waits` is true; it
    is given the number of bursts so far, which `bursts` has.
    """

    def __init__(
        self,
        line: Any,
        uplink: Uplink,
        clock: Clock,
        sleep: Sleep,
        start_s: float = 0.0,
        waits: Waits = lambda bursts: False,
    ) -> None:
        self._line = line
        self._uplink = uplink
        self._clock = clock
        self._sleep = sleep
        self._start_s = start_s
        self._waits = waits
        self._index = 0
        self.bursts = 0
        self._sent: queue.SimpleQueue[Sent | Exception] = queue.SimpleQueue()

    def send_next(self) -> bool:
        """Wait for the next slot and send what is in it; false: there is none."""
        due_s = self._uplink.due_s(self._index)
        if due_s is None:
            return False
        wait_s = self._start_s + due_s - self._clock()
        if wait_s > 0 and self._sleep(wait_s):
            return False
        following_s = self._uplink.due_s(self._index + 1)
        while following_s is not None and self._clock() >= self._start_s + following_s:
            self._index += 1
            due_s, following_s = following_s, self._uplink.due_s(self._index + 1)
        if self._waits(self.bursts):
            self._index += 1
            return True
        octets = self._uplink.octets(self._index, due_s)
        now_s = self._clock()
        # First told, then written: who hears the echo knows already what it is.
        self._sent.put(Sent(self._index, self._start_s + due_s, now_s, octets))
        self._index += 1
        if octets:
            self.bursts += 1
            self._line.write(octets)
        return True

    def take(self) -> list[Sent]:
        """The slots since the last call. Raises what the port raised, when all are taken."""
        found: list[Sent] = []
        while not self._sent.empty():
            item = self._sent.get()
            if isinstance(item, Exception):
                if not found:
                    raise item
                self._sent.put(item)  # the last one
                break
            found.append(item)
        return found

    def failed(self, error: Exception) -> None:
        """Have `take` raise this."""
        self._sent.put(error)


class SenderThread:
    """Runs a sender beside the program, so that drawing delays no frame; `with` starts and stops.

    Keep Python's switch interval short meanwhile, as `sniff.listen.Listener` does.
    """

    def __init__(
        self, line: Any, uplink: Uplink, clock: Clock, start_s: float, waits: Waits
    ) -> None:
        self._stopping = threading.Event()
        self._clock = clock
        self.sender = Sender(line, uplink, clock, self._sleep, start_s, waits)
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> SenderThread:
        self._thread.start()
        return self

    def __exit__(self, *details: object) -> None:
        self.stop()

    @property
    def running(self) -> bool:
        """Whether there are slots left."""
        return self._thread.is_alive()

    def stop(self) -> None:
        """Send no more."""
        self._stopping.set()
        self._thread.join()

    def _sleep(self, seconds: float) -> bool:
        # Windows waits for an event in steps of 15.6 ms, but sleeps exactly.
        end_s = self._clock() + seconds
        while not self._stopping.is_set() and (left_s := end_s - self._clock()) > 0:
            time.sleep(min(left_s, _LONGEST_SLEEP_S))
        return self._stopping.is_set()

    def _run(self) -> None:
        try:
            while not self._stopping.is_set() and self.sender.send_next():
                pass
        except Exception as error:  # to be raised where somebody listens
            self.sender.failed(error)
