"""The console command `status`: the state of everything as JSON, once or again and again.

A line is written in pieces, one in a round of the main loop, and only what the USB console takes
without waiting. One that has begun is ended, however long the host takes, and meanwhile nothing
else is written: so a host that reads at all reads whole lines.
"""

import sys
import time

from micropython import const

from firmware.status_line import StatusLine
from firmware.usb_room import Room

_SHORTEST_MS = const(50)
_LONGEST_MS = const(60_000)
_PATIENCE_MS = const(2000)
_USAGE = "status takes an interval of 50 to 60000 ms, or off, or nothing"


class Status:
    """Lines about an `Application`; ends when it is told to, or when nobody reads for 2 s.

    `due_ms`: when `update` has something to do; `writing`: whether a line is under way;
    `finished`: whether there is nothing more to write.
    """

    def __init__(self, application):
        self._application = application
        self._lay_out()
        self._room = Room()
        self._interval_ms = 0  # 0: no further line
        self.due_ms = time.ticks_ms()
        self._at = 0
        self._took_ms = 0  # when the host took something last
        self.writing = False
        self.finished = True

    def _lay_out(self):
        self._line = StatusLine(self._application)
        self._text = memoryview(self._line.text)
        self._sensors = len(self._application.sensors)

    def command(self, arguments):
        """Answers a line of the console."""
        now_ms = time.ticks_ms()
        if arguments == "off":
            self.finished = True
            self.due_ms = now_ms
            print('{"ghst": "ok"}')
        elif not arguments or (arguments.isdigit() and _possible(int(arguments))):
            self._interval_ms = int(arguments or 0)
            self.due_ms = self._took_ms = now_ms
            self.finished = False
        else:
            print('{"ghst": "error", "text": "' + _USAGE + '"}')

    def update(self, now_ms):
        """Writes what can be written; to be called in every round from `due_ms` on."""
        if self.finished:
            return
        count = self._room.free()
        if not count:
            if (
                time.ticks_diff(now_ms, self.due_ms) > _PATIENCE_MS
                and time.ticks_diff(now_ms, self._took_ms) > _PATIENCE_MS
            ):
                self._interval_ms = 0
                self.finished = not self.writing
            return
        self._took_ms = now_ms
        if not self.writing:
            if len(self._application.sensors) != self._sensors:
                self._lay_out()  # one has been found
            self._line.fill(now_ms)
            self._at = 0
            self.writing = True
        self._at += sys.stdout.buffer.write(self._text[self._at : self._at + count])
        if self._at >= len(self._text):
            self._end(now_ms)

    def _end(self, now_ms):
        self.writing = False
        if not self._interval_ms:
            self.finished = True
            return
        self.due_ms = time.ticks_add(self.due_ms, self._interval_ms)
        if time.ticks_diff(self.due_ms, now_ms) < 0:
            self.due_ms = time.ticks_add(now_ms, self._interval_ms)


def _possible(interval_ms):
    return _SHORTEST_MS <= interval_ms <= _LONGEST_MS
