"""Tells on the USB console what happens.

Nothing is printed while the host does not take it. One that stops in the middle of a line holds
the main loop up for half a second, MicroPython's limit, and no pulse.
"""

import select
import sys

from firmware.forget import erase


class Reporter:
    """Prints a line when the link changes or something went wrong, and everything on request.

    What cannot be written at the moment is not kept: the next line says the state of then.
    """

    def __init__(self, application, hello):
        """`application`: a `firmware.application.Application`; `hello`: what is running here."""
        self.application = application
        self.hello = hello
        self.fault = None
        self._output = select.poll()
        self._output.register(sys.stdout, select.POLLOUT)
        self._shown = (None, 0, 0)

    def count(self, fault):
        """Notes an exception that the main loop has survived."""
        self.application.faults += 1
        self.fault = fault

    def update(self):
        """Prints what has changed since the last call."""
        control = self.application.adapter.control
        now = (control.link, control.stuck, self.application.faults)
        if now != self._shown and ready(self._output):
            before = self._shown
            self._shown = now
            self._write(before, now)

    def show(self, arguments=""):
        """Prints all of the state; what the empty line asks for."""
        if ready(self._output):
            self._write(None, None)

    def _write(self, before, now):
        # Needed now and then, so not kept.
        from firmware import report_text

        report_text.write(self, before, now)
        erase("firmware.report_text", "ghst.rf_modes")


def ready(poll):
    """Returns whether the stream in `poll` can be read or written at once."""
    for _ in poll.ipoll(0):  # makes no list, unlike poll()
        return True
    return False
