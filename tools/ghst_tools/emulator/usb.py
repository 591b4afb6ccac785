"""USB and the console on it: the repair of rp2040py defect 1, and a host that can stop reading.

rp2040py 0.3.6 answers every armed bulk-OUT transfer at once, with no data when there is none: the
guest re-arms it and drowns in interrupts. A real host is asked and answers NAK until it has
something. Here the transfer is held until there are bytes to send.

It also completes every bulk-IN transfer at once. A terminal program that is stopped does not take
data; `Console.reading = False` makes the device see that (its transmit FIFO fills up).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rp2040py.peripherals.usb import RPUSBController
from rp2040py.usb.cdc import USBCDC

_BUFFER_AVAILABLE = 1 << 10
_IN_BUFFER_CONTROL = 0x80  # offset of endpoint 0's IN buffer control in the USB RAM
_BUS_LATENCY_NS = 20_000.0  # within a full-speed frame; keeps writes of the host in order


class _Controller(RPUSBController):
    """USB device controller whose IN transfers wait while the host does not read."""

    def __init__(self, mcu: Any) -> None:
        super().__init__(mcu, "USB")
        self.held_endpoint = -1
        self.held: list[tuple[int, int]] = []

    def dpram_updated(self, offset: int, value: int) -> None:
        if value & _BUFFER_AVAILABLE and offset == _IN_BUFFER_CONTROL + 8 * self.held_endpoint:
            self.held.append((offset, value))
        else:
            super().dpram_updated(offset, value)

    def release(self) -> None:
        self.held_endpoint = -1
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

    def _enumerated(self) -> None:
        self.enumerated = True
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

    def _reset(self) -> None:
        """The chip has dropped off the bus."""
        self._alarm.cancel()
        self._serving = False
        self._armed.clear()
        self._to_device.clear()
        self._usb.held.clear()
        self.enumerated = False
        if self._stock_reset is not None:
            self._stock_reset()
