"""A UART as `machine.UART` is, and the line behind it, on a clock that a test moves.

The line takes the simulated GPS receivers of the emulated board; bytes take their time, at a rate
other than the sender's they become other bytes, and what does not fit into the buffer is lost.
What would block on a board fails here.
"""

from __future__ import annotations

import heapq
import itertools
from collections import deque
from collections.abc import Callable

from ghst_tools.uart_bits import decode, encode


class Clock:
    """Emulated time, with alarms."""

    def __init__(self) -> None:
        self.nanos = 0.0
        self._numbers = itertools.count()
        self._queue: list[tuple[float, int, Alarm]] = []

    def create_alarm(self, callback: Callable[[], None]) -> Alarm:
        return Alarm(self, callback)

    def run_until(self, nanos: float) -> None:
        """Move time on, alarm by alarm."""
        while self._queue and self._queue[0][0] <= nanos:
            due, number, alarm = heapq.heappop(self._queue)
            if alarm.number == number:
                self.nanos = max(self.nanos, due)
                alarm.number = None
                alarm.callback()
        self.nanos = nanos

    def push(self, due: float, alarm: Alarm) -> int:
        number = next(self._numbers)
        heapq.heappush(self._queue, (due, number, alarm))
        return number


class Alarm:
    """Calls back once, `schedule` nanoseconds from when it was set."""

    def __init__(self, clock: Clock, callback: Callable[[], None]) -> None:
        self.callback = callback
        self.number: int | None = None
        self._clock = clock

    def schedule(self, nanos: float) -> None:
        self.number = self._clock.push(self._clock.nanos + nanos, self)

    def cancel(self) -> None:
        self.number = None


class SimulatedUart:
    """Both ends: the board's side has the methods of `machine.UART`, the other one of a peer."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.on_byte: Callable[[int], None] | None = None
        self.board_baud = 115200.0
        self.busy_until_ns = 0.0
        # One after the other, each different from the one before.
        self.baudrates: list[int] = []
        self.lost = 0
        self._coming: deque[tuple[float, int]] = deque()
        self._buffer: deque[int] = deque()
        self._rxbuf = self._txbuf = 256
        self._sent_ns = 0.0

    # -- the board's side ---------------------------------------------------------------------

    def init(
        self,
        *,
        baudrate: int,
        bits: int,
        parity: int | None,
        stop: int,
        rxbuf: int = 256,
        txbuf: int = 256,
    ) -> None:
        assert (bits, parity, stop) == (8, None, 1)
        self._arrive()
        self._buffer.clear()
        self.board_baud = float(baudrate)
        self._rxbuf, self._txbuf = rxbuf, txbuf
        if self.baudrates[-1:] != [baudrate]:
            self.baudrates.append(baudrate)

    def any(self) -> int:
        self._arrive()
        return len(self._buffer)

    def readinto(self, buffer: bytearray, count: int) -> int:
        assert 0 < count <= len(self._buffer), "this would wait for bytes"
        for at in range(count):
            buffer[at] = self._buffer.popleft()
        return count

    def txdone(self) -> bool:
        return self.clock.nanos >= self._sent_ns

    def write(self, data: bytes) -> int:
        assert self.txdone() and len(data) <= self._txbuf, "this would wait for room"
        byte_ns = 10e9 / self.board_baud
        for number, value in enumerate(data):
            alarm = self.clock.create_alarm(lambda value=value: self._take(value))
            alarm.schedule((number + 1) * byte_ns)
        # The last byte is still on its way when the buffer is empty.
        self._sent_ns = self.clock.nanos + (len(data) - 1) * byte_ns
        return len(data)

    # -- the other side -----------------------------------------------------------------------

    def send(self, data: bytes, baud: float) -> None:
        start = max(self.clock.nanos, self.busy_until_ns)
        changes, self.busy_until_ns = encode(data, start, baud)
        if baud == self.board_baud:
            ends = (start + (n + 1) * 10e9 / baud for n in range(len(data)))
            self._coming.extend(zip(ends, data, strict=True))
        else:
            for t_ns, value, ok in decode(changes, self.board_baud):
                if value or ok:  # MicroPython does not pass breaks on
                    self._coming.append((t_ns + 9.5e9 / self.board_baud, value))

    def _take(self, value: int) -> None:
        if self.on_byte is not None:
            self.on_byte(value)

    def _arrive(self) -> None:
        while self._coming and self._coming[0][0] <= self.clock.nanos:
            _, value = self._coming.popleft()
            if len(self._buffer) < self._rxbuf:
                self._buffer.append(value)
            else:
                self.lost += 1
