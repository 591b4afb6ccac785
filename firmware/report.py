"""Tells on the USB console what happens, and never waits for somebody to read it."""

import select
import sys

from ghst.protocol import RF_MODES

_WRITABLE = select.POLLOUT


class Reporter:
    """Prints a line when the link changes or something went wrong.

    What cannot be written at the moment is not kept: the next line says the state of then.
    """

    def __init__(self):
        """Nothing is printed before the first `update`."""
        self._poll = select.poll()
        self._poll.register(sys.stdout, _WRITABLE)
        self._link = None
        self._stuck = 0
        self._faults = 0

    def update(self, adapter, faults=0, fault=None):
        """Prints what has changed since the last call.

        `faults`: how many exceptions the main loop has survived; `fault`: the last of them.
        """
        now = (adapter.link, adapter.control.stuck, faults)
        if now == (self._link, self._stuck, self._faults) or not self._poll.poll(0):
            return
        if self._link != adapter.link:
            self._link = adapter.link
            print("link:", self._describe(adapter))
        if self._stuck != adapter.control.stuck:
            self._stuck = adapter.control.stuck
            print("main loop: stood still,", self._stuck, "times so far")
        if self._faults != faults:
            self._faults = faults
            print(f"main loop: {type(fault).__name__}: {fault},", faults, "faults so far")

    @staticmethod
    def _describe(adapter):
        receiver = adapter.receiver
        text = adapter.link
        if receiver.rf_mode:
            name = RF_MODES.get(receiver.rf_mode, (f"mode {receiver.rf_mode}",))[0]
            text += f", {name}, LQ {receiver.lq} %, RSSI {receiver.rssi_dbm} dBm"
        return text
