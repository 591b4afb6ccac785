"""What is connected to a UART of the emulated board."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ghst_tools.emulator.pins import Pin
from ghst_tools.emulator.uart_pins import UartPins
from ghst_tools.uart_bits import decode, encode

if TYPE_CHECKING:
    from ghst_tools.emulator.uart import Uart


class UartPeer:
    """What is connected to a UART: a GPS receiver, another flight controller.

    `received` is what the board has sent, `times` the end of each byte's stop bit in ns.
    `on_byte`, if set, is called with each byte then.
    """

    def __init__(self, uart: Uart, clock: Any) -> None:
        self.received = bytearray()
        self.times: list[float] = []
        self.on_byte: Callable[[int], None] | None = None
        self._uart = uart
        self._clock = clock
        self._queue: deque[tuple[float, int, bool]] = deque()
        self._alarm = clock.create_alarm(self._arrive)
        self._busy_until = 0.0

    @property
    def board_baud(self) -> float:
        """Bits a second that the board's UART is set to; 0 while it is not."""
        return self._uart.baud

    @property
    def busy_until_ns(self) -> float:
        """When the line to the board falls idle."""
        return self._busy_until

    def send(self, data: bytes, baud: float, at_ns: float | None = None) -> float:
        """Send `data` at `baud`, from `at_ns` or the end of what is queued on. Returns its end.

        The board reads the waveform at its own rate as it is set now: at a wrong rate it gets
        wrong bytes and framing errors.
        """
        earliest = max(self._clock.nanos, self._busy_until)
        start = earliest if at_ns is None else at_ns
        if start < earliest:
            raise ValueError(f"the line is taken to {earliest:.0f} ns")
        changes, self._busy_until = encode(data, start, baud)
        board_baud = self._uart.baud or baud
        idle = not self._queue
        for t_ns, value, ok in decode(changes, board_baud):
            self._queue.append((t_ns + 9.5e9 / board_baud, value, ok))
        if idle and self._queue:
            self._alarm.schedule(self._queue[0][0] - self._clock.nanos)
        return self._busy_until

    def connect(self, tx: Pin, rx: Pin) -> UartPins:
        """Join the UART to two pins of the board that are tied together, bit by bit."""
        self._uart.pins = UartPins(self._uart, self._uart.rp2040, tx, rx)
        return self._uart.pins

    def take(self, value: int) -> None:
        """Take a byte that the board has sent."""
        self.received.append(value)
        self.times.append(self._clock.nanos)
        if self.on_byte is not None:
            self.on_byte(value)

    def _arrive(self) -> None:
        _, value, ok = self._queue.popleft()
        if self._queue:
            self._alarm.schedule(max(0.0, self._queue[0][0] - self._clock.nanos))
        self._uart.receive(value, ok)
