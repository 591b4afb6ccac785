"""Tells on the USB console what happens.

Nothing is printed while the host does not take it, or is not there. One that stops in the middle
of a long answer holds the main loop up for half a second, MicroPython's limit, and no pulse.
"""

from firmware.forget import erase
from firmware.usb_room import Room


class Reporter:
    """Prints a line when the link changes or something went wrong, and everything on request.

    What cannot be written at the moment is not kept: the next line says the state of then.
    """

    def __init__(self, application, hello):
        """`application`: a `firmware.application.Application`; `hello`: what is running here."""
        self.application = application
        self.hello = hello
        self.fault = None
        self._room = Room()
        self._shown = (None, 0, 0)

    def count(self, fault):
        """Notes an exception that the main loop has survived."""
        self.application.faults += 1
        self.fault = fault

    def update(self):
        """Prints what has changed since the last time, or everything if that was asked for."""
        application = self.application
        control = application.adapter.control
        now = (control.link, control.stuck, application.faults)
        if now == self._shown or application.writing or not self._room.free():
            return
        before = self._shown
        self._shown = now
        self._write(before, now if before else None)

    def show(self, arguments):
        """Has `update` print all of the state; what the empty line asks for."""
        self._shown = None

    def _write(self, before, now):
        # Needed now and then, so not kept.
        from firmware import report_text

        report_text.write(self, before, now)
        erase("firmware.report_text", "ghst.rf_modes")
