"""How many bytes the USB console takes without waiting for the host.

MicroPython keeps 256 bytes for the host, and hands all of them to the endpoint at once when that
is idle. A write of n bytes waits up to half a second for n free places, POLLOUT tells of one; and
if USB was unplugged while a program had the port open, and the places are full, a write never
ends (MicroPython 1.25 to 1.28, shared/tinyusb/mp_usbd_cdc.c; issue 16713). The registers know
more: while the endpoint is idle and the host gives its frames, nothing waits before it either, and
256 bytes go at once.

Sources: RP2040 and RP2350 datasheets, chapter USB; MicroPython's shared/tinyusb/tusb_config.h has
the number of the endpoint.
"""

import select
import sys
import time

import machine
from micropython import const

_ROOM = const(256)
_ROOM_ELSEWHERE = const(16)  # on a UART: MicroPython writes into its FIFO

_BUFFER_CONTROL = const(0x50100090)  # of endpoint 2, towards the host
_AVAILABLE = const(0x04000400)  # one of its two buffers waits for the host
_FRAME_NUMBER = const(0x50110048)  # SOF_RD: the milliseconds of the bus, as its host counts them
_FRESH_MS = const(20)


def ready(poll):
    """Returns whether the stream in `poll` can be read or written at once."""
    for _ in poll.ipoll(0):  # makes no list, unlike poll()
        return True
    return False


class Room:
    """The places for what goes to the host; ask again and again, at most 20 ms apart."""

    def __init__(self):
        self._output = select.poll()
        self._output.register(sys.stdout, select.POLLOUT)
        self._frame = 0
        self._asked_ms = 0

    def free(self):
        """Returns how many bytes may be written now.

        0 while there are others before them, without a host, and for the first time.
        """
        if sys.platform != "rp2":
            return _ROOM_ELSEWHERE if ready(self._output) else 0
        now_ms = time.ticks_ms()
        elapsed_ms = time.ticks_diff(now_ms, self._asked_ms)
        if elapsed_ms == 0:
            return 0
        self._asked_ms = now_ms
        before = self._frame
        self._frame = machine.mem32[_FRAME_NUMBER]
        if elapsed_ms > _FRESH_MS or self._frame == before:
            return 0
        # Twice: the poll runs MicroPython's USB code, so what became idle before is known to it.
        # What becomes idle meanwhile may get the next bytes right away.
        for _ in range(2):
            if machine.mem32[_BUFFER_CONTROL] & _AVAILABLE or not ready(self._output):
                return 0
        return _ROOM
