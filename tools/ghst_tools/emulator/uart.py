"""The UARTs, in time, with a peer on each: replaces rp2040py's model (defect 7).

rp2040py 0.3.6 never clears the transmit interrupt, so `machine.UART` hangs; it has no receive
time-out, no levels and no time on the line, and the RESETS controller does not reset it. This is
the PL011 as the RP2040 has it (datasheet, section 4.2): FIFOs of 32, interrupts at the levels in
UARTIFLS, the receive time-out after 32 bits of silence, BUSY until the stop bit has gone, and
clk_peri as the guest has selected it (MicroPython takes the 48 MHz of the USB PLL; rp2040py always
reckons with 125 MHz).

Bytes reach the chip only while a pin is switched to the UART's RX, and leave it only while one is
switched to its TX; there is a waveform on the pins only where `connect` asks for it. Parity, CTS
and RTS are not modelled.
"""

from __future__ import annotations

from collections import deque
from typing import Any

from rp2040py.irq import IRQ
from rp2040py.peripherals.dma import DREQChannel
from rp2040py.peripherals.peripheral import BasePeripheral

from ghst_tools.emulator.uart_peer import UartPeer
from ghst_tools.emulator.uart_pins import UartPins

_DR, _RSR, _FR, _IBRD, _FBRD, _LCR_H, _CR = 0x00, 0x04, 0x18, 0x24, 0x28, 0x2C, 0x30
_IFLS, _IMSC, _RIS, _MIS, _ICR, _DMACR = 0x34, 0x38, 0x3C, 0x40, 0x44, 0x48
_FR_BUSY, _FR_RXFE, _FR_TXFF, _FR_RXFF, _FR_TXFE = 1 << 3, 1 << 4, 1 << 5, 1 << 6, 1 << 7
_LCR_FEN = 1 << 4
_CR_ENABLE, _CR_LOOPBACK, _CR_TX, _CR_RX = 1 << 0, 1 << 7, 1 << 8, 1 << 9
_INT_RX, _INT_TX, _INT_TIMEOUT, _INT_FRAMING, _INT_BREAK = (1 << n for n in (4, 5, 6, 7, 9))
_INT_OVERRUN = 1 << 10
_FRAMING, _BREAK, _OVERRUN = 1 << 8, 1 << 10, 1 << 11
_DMA_RX, _DMA_TX = 1 << 0, 1 << 1
_FIFO = 32
_LEVELS = (4, 8, 16, 24, 28, 28, 28, 28)
_FUNCTION_UART = 2
_TIMEOUT_BITS = 32
_TX_PINS = ((0, 12, 16, 28), (4, 8, 20, 24))  # RX is the pin above each
_RESETS = (1 << 22, 1 << 23)  # of the RESETS controller
_CLK_PERI_CTRL = 0x40008048
_CLK_PERI_HZ = {2: 48_000_000, 4: 12_000_000}  # by AUXSRC: USB PLL, crystal
_CLK_SYS_HZ = 125_000_000
_ID = {0xFE0: 0x11, 0xFE4: 0x10, 0xFE8: 0x34, 0xFF0: 0x0D, 0xFF4: 0xF0, 0xFF8: 0x05, 0xFFC: 0xB1}


class Uart(BasePeripheral):
    """One UART of the chip."""

    def __init__(self, mcu: Any, index: int) -> None:
        super().__init__(mcu, f"UART{index}")
        self.peer = UartPeer(self, mcu.clock)
        self.pins: UartPins | None = None
        self._clock = mcu.clock
        self._irq = (IRQ.UART0, IRQ.UART1)[index]
        self._dreq_tx = DREQChannel.DREQ_UART0_TX + 2 * index
        self._dreq_rx = DREQChannel.DREQ_UART0_RX + 2 * index
        self._tx_pins = [mcu.gpio[pin] for pin in _TX_PINS[index]]
        self._rx_pins = [mcu.gpio[pin + 1] for pin in _TX_PINS[index]]
        self._timeout = mcu.clock.create_alarm(self._timed_out)
        self._shift = mcu.clock.create_alarm(self._shifted)
        self.reset()

    def reset(self) -> None:
        self._timeout.cancel()
        self._shift.cancel()
        self._rx: deque[int] = deque()
        self._tx: deque[int] = deque()
        self._shifting: int | None = None
        self._registers = {_IBRD: 0, _FBRD: 0, _LCR_H: 0, _CR: _CR_RX | _CR_TX, _IFLS: 0x12}
        self._registers |= {_IMSC: 0, _DMACR: 0, _RSR: 0}
        self._raw = 0
        self._update()

    @property
    def baud(self) -> float:
        """Bits a second, from the divisor registers; 0 while they are not set."""
        divisor = self._registers[_IBRD] * 64 + self._registers[_FBRD]
        source = self.rp2040.read_uint32(_CLK_PERI_CTRL) >> 5 & 7
        clock_hz = _CLK_PERI_HZ.get(source, _CLK_SYS_HZ)
        return clock_hz * 4 / divisor if divisor else 0.0

    @property
    def _depth(self) -> int:
        return _FIFO if self._registers[_LCR_H] & _LCR_FEN else 1

    def receive(self, value: int, framing_ok: bool) -> None:
        """A byte has come in on RX; called in the middle of its stop bit."""
        control = self._registers[_CR]
        if not (control & _CR_ENABLE and control & _CR_RX):
            return
        if not control & _CR_LOOPBACK and not _switched(self._rx_pins):
            return
        if not framing_ok:
            value |= _FRAMING if value else _FRAMING | _BREAK
            self._raw |= _INT_FRAMING if value & 0xFF else _INT_FRAMING | _INT_BREAK
        if len(self._rx) >= self._depth:
            self._rx[-1] |= _OVERRUN
            self._raw |= _INT_OVERRUN
        else:
            self._rx.append(value)
            if len(self._rx) >= self._rx_level():
                self._raw |= _INT_RX
        self._timeout.schedule(_TIMEOUT_BITS * 1e9 / self.baud)
        self._update()

    def read_uint32(self, offset: int) -> int:
        if offset == _DR:
            return self._read_data()
        if offset == _FR:
            return (
                (_FR_BUSY if self._shifting is not None or self._tx else 0)
                | (0 if self._rx else _FR_RXFE)
                | (_FR_TXFF if len(self._tx) >= self._depth else 0)
                | (_FR_RXFF if len(self._rx) >= self._depth else 0)
                | (0 if self._tx else _FR_TXFE)
            )
        if offset == _RIS:
            return self._raw
        if offset == _MIS:
            return self._raw & self._registers[_IMSC]
        if offset in self._registers:
            return self._registers[offset]
        return _ID.get(offset, 0)

    def write_uint32(self, offset: int, value: int) -> None:
        if offset == _DR:
            if len(self._tx) < self._depth:
                self._tx.append(value & 0xFF)
                if len(self._tx) > self._tx_level():
                    self._raw &= ~_INT_TX
        elif offset == _ICR:
            self._raw &= ~self.raw_write_value
        elif offset == _RSR:
            self._registers[_RSR] = 0
        elif offset in self._registers:
            self._registers[offset] = value & 0xFFFF
        self._transmit()
        self._update()

    def _read_data(self) -> int:
        if not self._rx:
            return 0
        value = self._rx.popleft()
        self._registers[_RSR] = value >> 8
        if len(self._rx) < self._rx_level():
            self._raw &= ~_INT_RX
        if not self._rx:
            self._raw &= ~_INT_TIMEOUT
            self._timeout.cancel()
        self._update()
        return value

    def _rx_level(self) -> int:
        return _LEVELS[self._registers[_IFLS] >> 3 & 7] if self._depth > 1 else 1

    def _tx_level(self) -> int:
        return _LEVELS[self._registers[_IFLS] & 7] if self._depth > 1 else 0

    def _transmit(self) -> None:
        control = self._registers[_CR]
        enabled = control & _CR_ENABLE and control & _CR_TX and self.baud
        if self._shifting is not None or not self._tx or not enabled:
            return
        self._shifting = self._tx.popleft()
        if len(self._tx) == self._tx_level():
            self._raw |= _INT_TX
        bits = 1 + 5 + (self._registers[_LCR_H] >> 5 & 3) + 1 + (self._registers[_LCR_H] >> 3 & 1)
        self._shift.schedule(bits * 1e9 / self.baud)
        if self.pins is not None:
            self.pins.transmit(self._shifting, self.baud)

    def _shifted(self) -> None:
        value, self._shifting = self._shifting, None
        assert value is not None
        if self._registers[_CR] & _CR_LOOPBACK:
            self.receive(value, True)
        elif _switched(self._tx_pins):
            self.peer.take(value)
        self._transmit()
        self._update()

    def _timed_out(self) -> None:
        if self._rx:
            self._raw |= _INT_TIMEOUT
            self._update()

    def _update(self) -> None:
        self.rp2040.set_interrupt(self._irq, bool(self._raw & self._registers[_IMSC]))
        dma, enabled = self.rp2040.dma, self._registers[_DMACR]
        receive = enabled & _DMA_RX and self._rx
        (dma.set_dreq if receive else dma.clear_dreq)(self._dreq_rx)
        transmit = enabled & _DMA_TX and len(self._tx) < self._depth
        (dma.set_dreq if transmit else dma.clear_dreq)(self._dreq_tx)


def _switched(pins: list[Any]) -> bool:
    return any(pin.function_select == _FUNCTION_UART for pin in pins)


def install(mcu: Any) -> list[Uart]:
    """Replace the UARTs of `mcu`; to be done before the chip runs."""
    uarts = [Uart(mcu, 0), Uart(mcu, 1)]
    mcu.uart = uarts
    mcu.peripherals[0x40034], mcu.peripherals[0x40038] = uarts
    write = mcu.resets.write_uint32

    def reset(offset: int, value: int) -> None:
        write(offset, value)
        for uart, bit in zip(uarts, _RESETS, strict=True):
            if mcu.resets.read_uint32(0) & bit:
                uart.reset()

    mcu.resets.write_uint32 = reset
    return uarts
