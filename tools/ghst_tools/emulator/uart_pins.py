"""A UART as levels on two pins that are tied together: bit by bit, and its own echo heard.

The PL011 takes a start bit for one if the line is still low in its middle, reads a byte when the
middle of the stop bit has come, and waits for the line to rise before it looks for the next one
(RP2040 datasheet, section 4.2).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ghst_tools.emulator.pins import Cause, Pin
from ghst_tools.uart_bits import SerialDecoder, encode

if TYPE_CHECKING:
    from ghst_tools.emulator.uart import Uart

_IO_BANK = 0x40014
_CONTROL_SIZE = 8
_FUNCTION_UART = 2


class UartPins:
    """The levels of a UART: what TX drives is on the RX pin as well, whoever reads it there.

    `diode`: whether TX only pulls low. Otherwise the two are tied straight.
    """

    def __init__(self, uart: Uart, mcu: Any, tx: Pin, rx: Pin) -> None:
        self._uart = uart
        self._clock = mcu.clock
        self._tx_gpio = mcu.gpio[tx.number]
        self._rx = rx
        self.diode = False
        self._high = True
        self._queue: list[tuple[float, bool]] = []
        self._edge_alarm = self._clock.create_alarm(self._edge)
        self._decoder: SerialDecoder | None = None  # of the byte that is coming in
        self._start_alarm = self._clock.create_alarm(self._middle_of_start_bit)
        self._stop_alarm = self._clock.create_alarm(self._middle_of_stop_bit)
        rx.watch_level(self._level_changed)
        self._watch_function(mcu.peripherals[_IO_BANK], tx.number)

    def transmit(self, value: int, baud: float) -> None:
        """Begin to send a byte; the line is idle, or its last stop bit has just ended."""
        self._queue, _ = encode(bytes((value,)), self._clock.nanos, baud)
        self._edge()

    def _edge(self) -> None:
        _, self._high = self._queue.pop(0)
        if self._queue:
            self._edge_alarm.schedule(self._queue[0][0] - self._clock.nanos)
        self._drive()

    def _drive(self) -> None:
        switched = self._tx_gpio.function_select == _FUNCTION_UART
        drives = switched and not (self._high and self.diode)
        self._rx.tie(self._high if drives else None)

    def _watch_function(self, io_bank: Any, number: int) -> None:
        # rp2040py tells nobody of a change of function that does not change the pad's level.
        write = io_bank.write_uint32

        def write_uint32(offset: int, value: int) -> None:
            write(offset, value)
            if offset == _CONTROL_SIZE * number + 4:
                self._drive()

        io_bank.write_uint32 = write_uint32

    def _level_changed(self, t_ns: float, level: bool | None, _cause: Cause) -> None:
        if self._decoder is None:
            if level or not self._uart.baud:
                return
            bit_ns = 1e9 / self._uart.baud
            self._decoder = SerialDecoder(self._uart.baud)
            self._start_alarm.schedule(0.5 * bit_ns)
            self._stop_alarm.schedule(9.5 * bit_ns)
        self._decoder.feed(t_ns, bool(level))

    def _middle_of_start_bit(self) -> None:
        if self._rx.level:
            self._stop_alarm.cancel()
            self._decoder = None

    def _middle_of_stop_bit(self) -> None:
        decoder, self._decoder = self._decoder, None
        assert decoder is not None
        for byte in decoder.flush(self._clock.nanos + 1.0):
            self._uart.receive(byte.value, byte.framing_ok)
