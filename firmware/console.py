"""Takes commands from the USB console, a line each, without ever waiting for one.

console = Console(poll_of_stdin)
console.add("speed", show_speed, "speed: tells the ground speed")
console.update()                    # in every round of the main loop
"""

import sys

from firmware.usb_room import ready

_LONGEST = 80
_AT_ONCE = 32  # bytes: a tenth of a millisecond each
_BACKSPACE = b"\x08\x7f"
_DROP_LINE = b"\x15"  # Ctrl-U, as at the prompt: programs begin with it


class Console:
    """Lines that are typed, and the functions that answer them.

    A function takes the rest of the line as a string and may print. The empty line is a command
    as well. Bytes beyond 80 in a line are dropped, and with them the line.
    """

    def __init__(self, typed):
        """`typed`: a poll object with stdin."""
        self._input = typed
        self._line = bytearray(_LONGEST)
        self._length = 0
        self._commands = {"help": (self._help, "help: this list")}

    def add(self, name, function, help_line):
        """Has `function(arguments)` answer lines that begin with the word `name`."""
        self._commands[name] = (function, help_line)

    def update(self):
        """Reads some of what has been typed, a line at most, and answers it."""
        for _ in range(_AT_ONCE):
            if not ready(self._input):
                return
            # Bytes: a text read would wait for the rest of a character.
            byte = sys.stdin.buffer.read(1)
            if byte in b"\r\n":
                length = self._length
                self._length = 0
                if length <= _LONGEST:
                    self._answer(bytes(self._line[:length]))
                return
            if byte in _BACKSPACE:
                # A line that is too long stays that: what it began with is not what was typed.
                if 0 < self._length <= _LONGEST:
                    self._length -= 1
            elif byte == _DROP_LINE:
                self._length = 0
            else:
                if self._length < _LONGEST:
                    self._line[self._length] = byte[0]
                self._length = min(self._length + 1, _LONGEST + 1)

    def _answer(self, line):
        # Only ASCII can be a command; the rest might not even be text.
        text = "".join([chr(byte) if 32 <= byte < 127 else "?" for byte in line])
        name, _, arguments = text.strip().partition(" ")
        command = self._commands.get(name)
        if command is None:
            print(f"no command {name!r}: type help")
        else:
            command[0](arguments.strip())

    def _help(self, arguments):
        for name in sorted(self._commands):
            print(self._commands[name][1])
