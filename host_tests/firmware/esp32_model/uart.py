"""`machine.UART` of the ESP32 port (machine.UART.rst; ports/esp32/machine_uart.c)."""

from esp32_model.board import BAUD, BYTE_US, CHIPS

_FULL = 120  # bytes in the FIFO that are handed over at once (ESP-IDF)
_FIFO = 128


class UART:
    """One UART; number 1 is on the wire, nobody talks to the others."""

    board = None
    IRQ_RX = 1
    IRQ_BREAK = 1 << 3
    IRQ_RXIDLE = 0x1000
    INV_TX = 1 << 5
    INV_RX = 1 << 2

    def __init__(
        self,
        id,
        baudrate=115_200,
        bits=8,
        parity=None,
        stop=1,
        *,
        tx=None,
        rx=None,
        rts=None,
        cts=None,
        txbuf=256,
        rxbuf=256,
        timeout=0,
        timeout_char=0,
        invert=0,
        flow=0,
    ):
        board = self.board
        if not 0 <= id < CHIPS[board.chip][5]:
            raise ValueError(f"UART({id}) does not exist")
        if id == 0:
            raise ValueError("UART buffer size is fixed")  # it is the console
        self._id = id
        self._fifo = bytearray()
        self._ring = bytearray()
        self._last = 0
        self._handler = None
        self._trigger = 0
        self._tx_free_us = 0.0
        self._open = True
        self.overruns = 0
        # "Any GPIO can be used for hardware UARTs using the GPIO matrix, except for input-only
        # pins 34-39 that can be used as rx" (quickref.rst).
        if tx == rx or board.pad(tx).input_only:
            raise ValueError("invalid pin")
        board.pad(tx).take("uart tx")
        board.pad(rx).take("uart rx")
        self._set(baudrate, bits, parity, stop, txbuf, rxbuf, timeout, timeout_char, invert, flow)
        if id == 1:
            board.uart = self
            board.wire_pad = board.pad(rx).number

    def init(
        self,
        baudrate=None,
        bits=8,
        parity=None,
        stop=1,
        *,
        txbuf=None,
        rxbuf=None,
        timeout=0,
        timeout_char=0,
        invert=0,
        flow=0,
    ):
        self.board.spend(500.0)
        self._set(
            baudrate or self.baudrate,
            bits,
            parity,
            stop,
            self._txbuf if txbuf is None else txbuf,
            rxbuf or self._rxbuf,
            timeout,
            timeout_char,
            invert,
            flow,
        )

    def _set(
        self, baudrate, bits, parity, stop, txbuf, rxbuf, timeout, timeout_char, invert, flow
    ):
        if (bits, parity, stop, flow) != (8, None, 1, 0) or invert & ~(self.INV_TX | self.INV_RX):
            raise ValueError("not 8N1")
        if timeout:
            raise ValueError("`readinto` must not wait")
        # ESP-IDF, `uart_driver_install`: more than the FIFO holds, or no buffer to send from.
        if rxbuf <= _FIFO or 0 < txbuf <= _FIFO:
            raise OSError(-1)
        self.baudrate = baudrate
        self._rxbuf, self._txbuf = rxbuf, txbuf
        # `timeout_char / (12000 / baudrate + 1)` characters of silence, or each byte at once.
        self._idle_us = BYTE_US if timeout_char >= 1 else 0.0

    def receive(self, value):
        """A byte is complete."""
        board = self.board
        if not self._open or abs(self.baudrate / BAUD - 1) > 0.03:
            return
        if len(self._fifo) == _FIFO:
            self.overruns += 1
            return
        self._fifo.append(value)
        self._last += 1
        number = self._last
        delay = self._idle_us + board.random.uniform(2.0, 12.0)
        if len(self._fifo) >= _FULL:
            delay, number = 2.0, 0
        board.at(board.now_us + delay, lambda: self._hand_over(number))

    def _hand_over(self, number):
        if number and number != self._last and self._idle_us:
            return  # a byte came meanwhile
        if self.board.uart is not self:
            return  # the chip was reset
        room = self._rxbuf - len(self._ring)
        self.overruns += max(0, len(self._fifo) - room)
        self._ring += self._fifo[:room]
        self._fifo = bytearray()
        if self._handler is not None and self._trigger & self.IRQ_RX:
            self.board.schedule(self._handler, self)

    def irq(self, handler=None, trigger=0, hard=False):
        if hard:
            raise ValueError("hard IRQ is not supported")
        if trigger & ~(self.IRQ_RX | self.IRQ_BREAK | self.IRQ_RXIDLE):
            raise ValueError("trigger unsupported")
        self.board.spend(20.0)
        self._handler, self._trigger = handler, trigger

    def any(self):
        self.board.spend(4.0)
        return len(self._ring)

    def readinto(self, buffer, length=None):
        wanted = len(buffer) if length is None else min(length, len(buffer))
        self.board.spend(8.0)
        if not self._ring:
            return None
        count = min(wanted, len(self._ring))
        buffer[:count] = self._ring[:count]
        self._ring = self._ring[count:]
        return count

    def write(self, data):
        if not self._open:
            raise OSError(259)  # ESP_ERR_INVALID_STATE
        board = self.board
        data = bytes(data)
        if self._id != 1:
            board.spend(20.0)
            return len(data)
        start = max(board.now_us + board.random.uniform(5.0, 30.0), self._tx_free_us)
        for number, value in enumerate(data):
            at = start + number * BYTE_US
            board.at(at, lambda t=at, v=value: board.put("board", t, v))
        self._tx_free_us = start + len(data) * BYTE_US
        board.spend(board.random.uniform(10.0, 40.0))
        return len(data)

    def deinit(self):
        self.board.spend(50.0)
        self._open = False
        self._handler = None
