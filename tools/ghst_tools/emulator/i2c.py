"""The I2C controllers, in time, with targets in Python: the repair of rp2040py defect 9.

rp2040py 0.3.6 completes every byte at once, never raises TX_EMPTY after an address that nobody
acknowledged (the SDK then runs into its time-out instead of an error), and stays busy when it is
disabled in the middle of a transfer. Here each byte takes nine clock periods of the rate the
guest has set. `connect` joins the bus to two pins as well: MicroPython's `scan()` and zero-length
writes bit-bang them. Source: RP2040 datasheet, section 4.3.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

from rp2040py.irq import IRQ
from rp2040py.peripherals.i2c import RPI2C, I2CMode, I2CState

from ghst_tools.emulator.i2c_pins import PinBus
from ghst_tools.emulator.pins import Pin

_IC_ENABLE = 0x6C
_ENABLE = 1 << 0
_TX_EMPTY_CTRL = 1 << 8
_TX_EMPTY = 1 << 4
_CYCLE_NS = 8.0
_BYTE_BITS = 9


class I2cTarget(Protocol):
    """A device on the bus."""

    def start(self, read: bool) -> bool:
        """The device is addressed; True acknowledges."""

    def write(self, value: int) -> bool:
        """The controller writes a byte; True acknowledges."""

    def read(self) -> int:
        """The controller reads a byte."""

    def stop(self) -> None:
        """The transfer has ended."""


class I2c(RPI2C):
    """One I2C controller of the chip.

    `stuck` is a bus fault: while it is True some device holds SDA low and nothing moves.
    """

    def __init__(self, mcu: Any, index: int) -> None:
        super().__init__(mcu, f"I2C{index}", (IRQ.I2C0, IRQ.I2C1)[index])
        self.stuck = False
        self.targets: dict[int, I2cTarget] = {}
        self._pins: PinBus | None = None
        self._target: I2cTarget | None = None
        self._alarm = mcu.clock.create_alarm(self._done)
        self._then: Callable[[], None] | None = None
        self._tx_empty_due = False
        self.on_start = lambda repeated: self._after(1, self.complete_start)
        self.on_connect = lambda address, mode: self._after(
            _BYTE_BITS, partial(self._connect, address, mode)
        )
        self.on_write_byte = lambda value: self._after(_BYTE_BITS, partial(self._write, value))
        self.on_read_byte = lambda ack: self._after(_BYTE_BITS, self._read)
        self.on_stop = lambda: self._after(1, self._stopped)

    def attach(self, address: int, target: I2cTarget) -> None:
        """Put `target` on the bus at the 7-bit `address`."""
        self.targets[address] = target

    def detach(self, address: int) -> None:
        """Take the target at `address` off the bus."""
        del self.targets[address]

    def connect(self, sda: Pin, scl: Pin) -> None:
        """Join the bus to two pins, for software that drives them itself."""
        self._pins = PinBus(self.targets, sda, scl)

    def hold_sda(self, clocks: int) -> None:
        """Let a target hold SDA low, so that nothing moves, until it has seen `clocks` clocks.

        The bus has to be connected to pins: only software that drives them can give the clocks.
        """
        if self._pins is None:
            raise ValueError("hold_sda: connect the bus to its pins first")
        self.stuck = True
        self._pins.hold_sda(clocks, self._let_go)

    def _let_go(self) -> None:
        self.stuck = False

    def write_uint32(self, offset: int, value: int) -> None:
        if offset == _IC_ENABLE and not value & _ENABLE:
            self._alarm.cancel()
            self._then = None
            self._state = I2CState.IDLE
            self._busy = self._stop = self._pending_restart = False
        super().write_uint32(offset, value)

    def _after(self, bits: int, then: Callable[[], None]) -> None:
        self._then = then
        if not self.stuck:
            period = (self.scl_high_period + self.scl_low_period) * _CYCLE_NS
            self._alarm.schedule(bits * period)

    def _done(self) -> None:
        then, self._then = self._then, None
        if then is not None:
            then()
        if self._tx_empty_due and not self._busy:
            self._tx_empty()

    def _connect(self, address: int, mode: I2CMode) -> None:
        self._target = self.targets.get(address)
        self.complete_connect(
            self._target is not None and self._target.start(mode == I2CMode.READ)
        )

    def _write(self, value: int) -> None:
        acknowledged = self._target is not None and self._target.write(value)
        if self._tx_empty_due:
            self._tx_empty()
        self.complete_write(acknowledged)

    def _read(self) -> None:
        value = self._target.read() if self._target is not None else 0xFF
        if self._tx_empty_due:
            self._tx_empty()
        self.complete_read(value & 0xFF)

    def _stopped(self) -> None:
        if self._target is not None:
            self._target.stop()
        self._target = None
        self.complete_stop()

    def _abort(self, reason: int) -> None:
        super()._abort(reason)
        self._tx_empty()

    def _tx_empty(self) -> None:
        self._tx_empty_due = False
        super()._set_interrupts(_TX_EMPTY)

    def _set_interrupts(self, mask: int) -> None:
        # With TX_EMPTY_CTRL the flag waits until the byte has left the shift register.
        if mask == _TX_EMPTY and self.control & _TX_EMPTY_CTRL and self._busy:
            self._tx_empty_due = True
        else:
            super()._set_interrupts(mask)


def install(mcu: Any) -> list[I2c]:
    """Replace the I2C controllers of `mcu`; to be done before the chip runs."""
    controllers = [I2c(mcu, 0), I2c(mcu, 1)]
    mcu.i2c = controllers
    mcu.peripherals[0x40044], mcu.peripherals[0x40048] = controllers
    return controllers
