"""Tells on the USB console what happens.

Nothing is printed while the host does not take it. One that stops in the middle of a line holds
the main loop up for half a second, MicroPython's limit, and no pulse.
"""

import select
import sys

from ghst.protocol import RF_MODES


class Reporter:
    """Prints a line when the link changes or something went wrong, and everything on Enter.

    What cannot be written at the moment is not kept: the next line says the state of then.
    """

    def __init__(self, application, hello):
        """`application`: a `firmware.application.Application`; `hello`: what is running here."""
        self._application = application
        self._hello = hello
        self._output = select.poll()
        self._output.register(sys.stdout, select.POLLOUT)
        self._input = select.poll()
        self._input.register(sys.stdin, select.POLLIN)
        self._shown = None

    def update(self, faults=0, fault=None):
        """Prints what has changed since the last call, or all of it if somebody pressed Enter.

        `faults`: how many exceptions the main loop has survived; `fault`: the last of them.
        """
        adapter = self._application.adapter
        asked = self._asked()
        now = (adapter.link, adapter.control.stuck, faults)
        if (now == self._shown and not asked) or not _ready(self._output):
            return
        before = self._shown or (None, 0, 0)
        self._shown = now
        if asked:
            print(self._hello)
            for line in self._application.describe():
                print(line)
        if asked or now[0] != before[0]:
            print("link:", self._describe(adapter))
        if asked or now[1] != before[1]:
            print("main loop: stood still", now[1], "times")
        if now[2] and (asked or now[2] != before[2]):
            print(f"main loop: {now[2]} faults, the last: {type(fault).__name__}: {fault}")

    def _asked(self):
        asked = False
        while _ready(self._input):
            # Bytes: a text read would wait for the rest of a character.
            if sys.stdin.buffer.read(1) in b"\r\n":
                asked = True
        return asked

    @staticmethod
    def _describe(adapter):
        receiver = adapter.receiver
        text = adapter.link
        if receiver.rf_mode:
            name = RF_MODES.get(receiver.rf_mode, (f"mode {receiver.rf_mode}",))[0]
            text += f", {name}, LQ {receiver.lq} %, RSSI {receiver.rssi_dbm} dBm"
        text += f"; frames {receiver.frames}, CRC errors {receiver.crc_errors}"
        return (
            text
            + f", bytes skipped {receiver.skipped_bytes}, failsafes {adapter.control.failsafes}"
        )


def _ready(poll):
    for _ in poll.ipoll(0):  # makes no list, unlike poll()
        return True
    return False
