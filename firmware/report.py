"""Tells on the USB console what happens.

Nothing is printed while the host does not take it. One that stops in the middle of a line holds
the main loop up for half a second, MicroPython's limit, and no pulse.
"""

import select
import sys

from firmware.console import ready


class Reporter:
    """Prints a line when the link changes or something went wrong, and everything on request.

    What cannot be written at the moment is not kept: the next line says the state of then.
    """

    def __init__(self, application, hello):
        """`application`: a `firmware.application.Application`; `hello`: what is running here."""
        self._application = application
        self._hello = hello
        self._output = select.poll()
        self._output.register(sys.stdout, select.POLLOUT)
        self._shown = None
        self._faults = 0
        self._fault = None

    def count(self, fault):
        """Notes an exception that the main loop has survived."""
        self._faults += 1
        self._fault = fault

    def update(self):
        """Prints what has changed since the last call."""
        adapter = self._application.adapter
        now = (adapter.link, adapter.control.stuck, self._faults)
        if now == self._shown or not ready(self._output):
            return
        before = self._shown or (None, 0, 0)
        self._shown = now
        if now[0] != before[0]:
            self._print_link()
        if now[1] != before[1]:
            self._print_stuck()
        if now[2] != before[2]:
            self._print_fault()

    def show(self, arguments=""):
        """Prints all of the state; what the empty line asks for."""
        if not ready(self._output):
            return
        print(self._hello, end="")
        for line in self._application.describe():
            print(line)
        self._print_link()
        self._print_stuck()
        if self._fault:
            self._print_fault()

    def _print_stuck(self):
        print("main loop: stood still", self._application.adapter.control.stuck, "times")

    def _print_fault(self):
        fault = self._fault
        print(f"main loop: {self._faults} faults, the last: {type(fault).__name__}: {fault}")

    def _print_link(self):
        adapter = self._application.adapter
        receiver = adapter.receiver
        text = adapter.link
        if receiver.rf_mode:
            from ghst.rf_modes import RF_MODES

            name = RF_MODES.get(receiver.rf_mode, (f"mode {receiver.rf_mode}",))[0]
            text += f", {name}, LQ {receiver.lq} %, RSSI {receiver.rssi_dbm} dBm"
        text += f"; frames {receiver.frames}, CRC errors {receiver.crc_errors}"
        text += f", bytes skipped {receiver.skipped_bytes}, failsafes {adapter.control.failsafes}"
        print("link:", text)
