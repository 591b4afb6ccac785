"""`machine.UART`, `machine.Timer`, `machine.Pin` and `time` as the ESP32 port of MicroPython has
them, strict and in time, with a half-duplex wire and a Ghost receiver on it.

Modelled from the port's documentation: unknown arguments are errors, interrupts are soft (run
between two calls of the main program, one at a time, up to eight waiting), `UART.IRQ_RX` comes
when the line has been idle for a byte (timeout_char=1), hard interrupts are refused. Each call
takes time, and what the main program does between its calls as well.
"""

from __future__ import annotations

import heapq
import itertools
import random
from collections import deque
from collections.abc import Callable
from typing import Any

BAUD = 420_000
BYTE_US = 10e6 / BAUD
_WRAP = 1 << 30
_QUEUE_LENGTH = 8


class Board:
    """The chip, the wire and the time; `now_us` only moves in calls."""

    def __init__(self, seed: int = 1) -> None:
        self.now_us = 1_000.0
        self.random = random.Random(seed)
        self.tied = True
        # Bytes on the wire: start, end, value, who sends. A garbled one is nobody's.
        self.sent: list[tuple[float, float, int, str]] = []
        self.collisions: list[float] = []
        self.lost_callbacks = 0
        self._events: list[tuple[float, int, Callable[[], None]]] = []
        self._number = itertools.count()
        self._scheduled: deque[tuple[Callable[[Any], Any], Any]] = deque()
        self._in_callback = False
        self.uart: UART | None = None
        self.on_falling: Callable[[], None] | None = None

    # -- time ---------------------------------------------------------------------------------

    def ticks_us(self) -> int:
        self.spend(1.0)
        return int(self.now_us) % _WRAP

    def ticks_diff(self, end: int, start: int) -> int:
        assert 0 <= end < _WRAP and 0 <= start < _WRAP
        return (end - start + _WRAP // 2) % _WRAP - _WRAP // 2

    def ticks_add(self, ticks: int, delta: int) -> int:
        assert 0 <= ticks < _WRAP
        return (ticks + delta) % _WRAP

    def spend(self, us: float, *, collecting: bool = False) -> None:
        """Let time pass; soft interrupts run meanwhile, unless memory is being collected."""
        end = self.now_us + us
        while True:
            if not collecting:
                self._run_scheduled()
            if not self._events or self._events[0][0] > end:
                break
            t_us, _, event = heapq.heappop(self._events)
            self.now_us = max(self.now_us, t_us)
            event()
        self.now_us = max(self.now_us, end)

    def at(self, t_us: float, event: Callable[[], None]) -> None:
        heapq.heappush(self._events, (t_us, next(self._number), event))

    def schedule(self, callback: Callable[[Any], Any], argument: Any) -> None:
        if len(self._scheduled) == _QUEUE_LENGTH:
            self.lost_callbacks += 1
        else:
            self._scheduled.append((callback, argument))

    def _run_scheduled(self) -> None:
        while self._scheduled and not self._in_callback:
            callback, argument = self._scheduled.popleft()
            self._in_callback = True
            try:
                self.spend(self.random.uniform(5.0, 40.0))
                callback(argument)
            finally:
                self._in_callback = False

    # -- the wire -----------------------------------------------------------------------------

    @property
    def level(self) -> int:
        """The wire: low while a bit is low."""
        for start, end, value, _ in self.sent[-3:]:
            if start <= self.now_us < end:
                bit = int((self.now_us - start) / (end - start) * 10)
                return (value | 0x100) << 1 >> bit & 1
        return 1

    def put(self, who: str, start_us: float, value: int) -> float:
        """Send a byte from `start_us` on; returns the end of its stop bit."""
        end = start_us + BYTE_US
        for index in range(len(self.sent) - 1, max(-1, len(self.sent) - 40), -1):
            other_start, other_end, other, other_who = self.sent[index]
            if other_who != who and other_start < end and start_us < other_end:
                self.collisions.append(start_us)
                self.sent[index] = (other_start, other_end, other & value, other_who)
                value &= other
        self.sent.append((start_us, end, value, who))
        entry = len(self.sent) - 1
        if who == "receiver" or self.tied:
            self.at(end, lambda: self._heard(entry))
            levels = [1, *((value | 0x100) << 1 >> bit & 1 for bit in range(10))]
            for bit in range(10):
                if levels[bit] > levels[bit + 1]:
                    self.at(start_us + bit * BYTE_US / 10, self._fall)
        return end

    def _fall(self) -> None:
        if self.on_falling is not None:
            self.on_falling()

    def _heard(self, entry: int) -> None:
        if self.uart is not None:
            self.uart.receive(self.sent[entry][2])

    def send(self, data: bytes, at_us: float) -> float:
        """Have the receiver send `data`; returns its end."""
        for number, value in enumerate(data):
            start = at_us + number * BYTE_US
            self.at(start, lambda s=start, v=value: self.put("receiver", s, v))  # type: ignore
        return at_us + len(data) * BYTE_US

    def starts(self) -> list[float]:
        """When each frame of the board began."""
        times = [start for start, _, _, who in self.sent if who == "board"]
        return [t for i, t in enumerate(times) if not i or t - times[i - 1] > 1.5 * BYTE_US]


class UART:
    """One UART; made with the arguments of the port and no others."""

    IRQ_RX = 1
    IRQ_BREAK = 1 << 3
    IRQ_RXIDLE = 0x1000

    def __init__(
        self,
        board: Board,
        id: int,
        baudrate: int = 115_200,
        bits: int = 8,
        parity: int | None = None,
        stop: int = 1,
        *,
        tx: int,
        rx: int,
        txbuf: int = 256,
        rxbuf: int = 256,
        timeout: int = 0,
        timeout_char: int = 0,
        invert: int = 0,
        flow: int = 0,
    ) -> None:
        if not 0 <= id <= 2:
            raise ValueError(f"UART({id}) does not exist")
        if (bits, parity, stop, invert, flow) != (8, None, 1, 0, 0) or tx == rx:
            raise ValueError("not 8N1 on two pins")
        if abs(baudrate / BAUD - 1) > 0.03:
            raise ValueError("nothing but framing errors at this rate")
        if rxbuf < 256 or timeout:
            raise ValueError("rxbuf is at least 256, and `readinto` must not wait")
        self._board = board
        board.uart = self
        self._rxbuf = rxbuf
        self._idle_us = BYTE_US if timeout_char >= 1 else 0.0
        self._fifo = bytearray()
        self._ring = bytearray()
        self._last = 0
        self._handler: Callable[[Any], Any] | None = None
        self._trigger = 0
        self._tx_free_us = 0.0
        self.overruns = 0

    def receive(self, value: int) -> None:
        """A byte is complete."""
        self._fifo.append(value)
        self._last += 1
        board, number = self._board, self._last
        delay = self._idle_us + board.random.uniform(2.0, 12.0)
        board.at(board.now_us + delay, lambda: self._hand_over(number))

    def _hand_over(self, number: int) -> None:
        if number != self._last and self._idle_us:
            return  # a byte came meanwhile
        room = self._rxbuf - len(self._ring)
        self.overruns += max(0, len(self._fifo) - room)
        self._ring += self._fifo[:room]
        self._fifo.clear()
        if self._handler is not None and self._trigger & self.IRQ_RX:
            self._board.schedule(self._handler, self)

    def irq(
        self,
        handler: Callable[[Any], Any] | None = None,
        trigger: int = 0,
        hard: bool = False,
    ) -> None:
        if hard:
            raise ValueError("hard IRQ is not supported")
        if trigger & ~(self.IRQ_RX | self.IRQ_BREAK | self.IRQ_RXIDLE):
            raise ValueError(f"trigger 0x{trigger:04x} unsupported")
        self._board.spend(20.0)
        self._handler, self._trigger = handler, trigger

    def any(self) -> int:
        self._board.spend(4.0)
        return len(self._ring)

    def readinto(self, buffer: bytearray, length: int | None = None) -> int | None:
        wanted = len(buffer) if length is None else min(length, len(buffer))
        self._board.spend(8.0)
        if not self._ring:
            return None
        data = self._ring[:wanted]
        del self._ring[: len(data)]
        buffer[: len(data)] = data
        return len(data)

    def write(self, data: bytes) -> int:
        board = self._board
        start = max(board.now_us + board.random.uniform(5.0, 30.0), self._tx_free_us)
        for number, value in enumerate(data):
            at = start + number * BYTE_US
            board.at(at, lambda t=at, v=value: board.put("board", t, v))  # type: ignore
        self._tx_free_us = start + len(data) * BYTE_US
        board.spend(board.random.uniform(10.0, 40.0))
        return len(data)


class Timer:
    """A hardware timer; its callback is soft."""

    ONE_SHOT = 0
    PERIODIC = 1

    def __init__(self, board: Board, id: int) -> None:
        if not 1 <= id <= 3:
            raise ValueError("invalid Timer number, or that of IRQ_RXIDLE")
        self._board = board
        self._generation = 0

    def init(
        self,
        *,
        mode: int = PERIODIC,
        freq: float | None = None,
        period: int | None = None,
        callback: Callable[[Any], Any] | None = None,
    ) -> None:
        if mode != self.ONE_SHOT or callback is None or (freq is None) is (period is None):
            raise ValueError("one shot, a callback, and either freq or period")
        delay_us = 1e6 / freq if freq is not None else 1e3 * (period or 0)
        self._board.spend(self._board.random.uniform(10.0, 30.0))
        self._generation += 1
        generation = self._generation
        self._board.at(self._board.now_us + delay_us, lambda: self._expired(generation, callback))

    def _expired(self, generation: int, callback: Callable[[Any], Any]) -> None:
        if generation == self._generation:
            self._board.schedule(callback, self)

    def deinit(self) -> None:
        self._generation += 1


class Pin:
    """The pin of RX; its interrupt is soft."""

    IRQ_RISING = 1
    IRQ_FALLING = 2

    def __init__(self, board: Board) -> None:
        self._board = board

    def value(self) -> int:
        self._board.spend(1.0)
        return self._board.level

    def irq(
        self,
        handler: Callable[[Any], Any] | None = None,
        trigger: int = IRQ_RISING | IRQ_FALLING,
        wake: int | None = None,
    ) -> None:
        if trigger not in (1, 2, 3) or wake is not None:
            raise ValueError("bad trigger or wake value")
        board = self._board
        board.spend(board.random.uniform(5.0, 15.0))
        board.on_falling = None
        if handler is not None and trigger & self.IRQ_FALLING:
            board.on_falling = lambda: board.schedule(handler, self)
