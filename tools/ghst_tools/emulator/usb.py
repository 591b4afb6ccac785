"""USB and the console on it: the repair of rp2040py defect 1, and a host that can stop reading.

rp2040py 0.3.6 answers every armed bulk-OUT transfer at once, with no data when there is none: the
guest re-arms it and drowns in interrupts. A real host is asked and answers NAK until it has
something. Here the transfer is held until there are bytes to send.

It also completes every bulk-IN transfer at once. A terminal program that is stopped does not take
data; `Console.reading = False` makes the device see that (its transmit FIFO fills up).
Neither does it count the frames of the bus, interrupt at each of them or suspend it: here that is,
too. MicroPython asks for these interrupts when a port is opened: what waits in its transmit FIFO
is sent some frames later. `Console.unplug` suspends the bus.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rp2040py.peripherals.usb import (
    INTE,
    INTR_DEV_SOF,
    SIE_STATUS,
    SIE_SUSPENDED,
    SOF_RD,
    RPUSBController,
)
from rp2040py.usb.cdc import USBCDC

_BUFFER_AVAILABLE = 1 << 10
_IN_BUFFER_CONTROL = 0x80  # offset of endpoint 0's IN buffer control in the USB RAM
_FRAME_NS = 1e6
_FRAME_NUMBER_MASK = 0x7FF
_BUS_LATENCY_NS = 20_000.0  # within a full-speed frame; keeps writes of the host in order


class _Controller(RPUSBController):
    """USB device controller whose IN transfers wait while the host does not read."""

    def __init__(self, mcu: Any) -> None:
        super().__init__(mcu, "USB")
        self.held_endpoint = -1
        self.held: list[tuple[int, int]] = []
        self._suspended_at: int | None = None
        self._frame_alarm = mcu.clock.create_alarm(self._frame_begins)
        self._frames_told = False

    def dpram_updated(self, offset: int, value: int) -> None:
        held = offset == _IN_BUFFER_CONTROL + 8 * self.held_endpoint
        if value & _BUFFER_AVAILABLE and (held or self._suspended_at is not None):
            self.held.append((offset, value))
        else:
            super().dpram_updated(offset, value)

    def read_uint32(self, offset: int) -> int:
        if offset == SOF_RD and not self._host_mode:
            self._int_raw &= ~INTR_DEV_SOF
            self.check_interrupts()
            return self._frame_number()
        return int(super().read_uint32(offset))

    def write_uint32(self, offset: int, value: int) -> None:
        if offset == SIE_STATUS:
            # The bit tells of the event; the data sheet has it cleared by writing to it.
            self._sie_status &= ~(self.raw_write_value & SIE_SUSPENDED)
        super().write_uint32(offset, value)
        if offset == INTE:
            self._tell_frames()

    def _tell_frames(self) -> None:
        wanted = bool(self._int_enable & INTR_DEV_SOF)
        if wanted and not self._frames_told and self._suspended_at is None:
            self._frames_told = True
            self._frame_alarm.schedule(_FRAME_NS - self.rp2040.clock.nanos % _FRAME_NS)

    def _frame_begins(self) -> None:
        self._frames_told = False
        if self._suspended_at is None and self._int_enable & INTR_DEV_SOF:
            self._int_raw |= INTR_DEV_SOF
            self.check_interrupts()
            self._tell_frames()

    def _frame_number(self) -> int:
        if self._suspended_at is not None:
            return self._suspended_at
        return int(self.rp2040.clock.nanos / _FRAME_NS) & _FRAME_NUMBER_MASK

    def suspend(self) -> None:
        self._suspended_at = self._frame_number()
        self._sie_status |= SIE_SUSPENDED
        self._sie_status_updated()

    def _on_reset_alarm(self) -> None:
        # The host gives no frames before the end of its reset.
        self._suspended_at = None
        self.held.clear()
        super()._on_reset_alarm()
        self._tell_frames()

    def release(self) -> None:
        self.held_endpoint = -1
        if self._suspended_at is not None:
            return
        held, self.held = self.held, []
        for offset, value in held:
            super().dpram_updated(offset, value)


class Console:
    """The host's end of the board's USB serial port.

    `output` is everything the device has printed since power-on, `connected` whether the device
    has been enumerated and the port is open (DTR).
    """

    def __init__(self, mcu: Any) -> None:
        self.output = bytearray()
        self.on_data: Callable[[bytes], None] | None = None
        self._to_device = bytearray()
        self._armed: list[int] = []  # sizes of OUT transfers the device waits in
        self._usb = _Controller(mcu)
        mcu.usb_ctrl = self._usb
        mcu.peripherals[0x50110] = self._usb
        self._alarm = mcu.clock.create_alarm(self._serve)
        self._serving = False
        self._reading = True
        self._opens = True
        self.enumerated = False
        self._cdc = USBCDC(self._usb)
        self._cdc.on_serial_data = self._received
        self._cdc.on_device_connected = self._enumerated
        self._stock_read = self._usb.on_endpoint_read
        self._usb.on_endpoint_read = self._endpoint_read
        self._stock_reset = self._usb.on_reset
        self._usb.on_reset = self._reset

    @property
    def connected(self) -> bool:
        """True while the device is enumerated and the host has the port open."""
        return bool(self.enumerated and self._cdc.dtr)

    @property
    def reading(self) -> bool:
        """Whether the host takes what the device sends; False leaves it in the device."""
        return self._reading

    @reading.setter
    def reading(self, reading: bool) -> None:
        self._reading = reading
        if reading:
            self._usb.release()
        else:
            self._usb.held_endpoint = self._cdc._in_endpoint

    @property
    def unsent(self) -> int:
        """How many bytes that were typed the device has not taken yet."""
        return len(self._to_device)

    def write(self, data: bytes) -> None:
        """Type `data`; it reaches the device as fast as the device takes it."""
        self._to_device += data
        self._kick()

    def open(self) -> None:
        """Open the port again: assert DTR and RTS."""
        self._cdc.set_control_lines(dtr=True, rts=True)

    def close(self) -> None:
        """Close the port: drop DTR and RTS, as a terminal program does that ends."""
        self._cdc.set_control_lines(dtr=False, rts=False)

    def unplug(self) -> None:
        """Pull the cable of a board that has another supply: no frames, no transfers."""
        self._usb.suspend()
        self._drop()

    def plug_in(self, *, opens: bool = True) -> None:
        """Put the cable back: the host resets the bus, enumerates, and perhaps opens the port."""
        self._opens = opens
        self._cdc._on_controller_reset()
        self._usb.reset_device()

    def _enumerated(self) -> None:
        self.enumerated = True
        if not self._opens:
            self.close()
        if not self._reading:
            self._usb.held_endpoint = self._cdc._in_endpoint

    def _received(self, data: bytes | bytearray) -> None:
        self.output += data
        if self.on_data is not None:
            self.on_data(bytes(data))

    def _endpoint_read(self, endpoint: int, size: int) -> None:
        if endpoint != 0 and endpoint == self._cdc._out_endpoint:
            self._armed.append(size)
            self._kick()
        elif self._stock_read is not None:
            self._stock_read(endpoint, size)

    def _kick(self) -> None:
        if self._to_device and self._armed and not self._serving:
            self._serving = True
            self._alarm.schedule(_BUS_LATENCY_NS)

    def _serve(self) -> None:
        self._serving = False
        if not self._armed or not self._to_device:
            return
        size = self._armed.pop(0)
        chunk = bytes(self._to_device[:size])
        del self._to_device[:size]
        self._usb.endpoint_read_done(self._cdc._out_endpoint, chunk)
        self._kick()

    def _drop(self) -> None:
        self._alarm.cancel()
        self._serving = False
        self._armed.clear()
        self._to_device.clear()
        self.enumerated = False

    def _reset(self) -> None:
        """The chip has dropped off the bus."""
        self._drop()
        self._usb.held.clear()
        if self._stock_reset is not None:
            self._stock_reset()
