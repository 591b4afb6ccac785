"""Runs `/main.py` as a board would, from a littlefs with the files of that board.

Replaced are `machine` and `time` (the model), the chip's name in `sys`, the console in `sys.stdin`
and `print`, and for `firmware.shape_viper`, which is no machine code here, `uctypes`. All else is
real: the files, the imports, the configuration, the interpreter.
"""

import builtins
import io
import json
import os
import sys

import vfs
from esp32_model import Board, ChipReset, Machine

import ghst.encode
from esp32_run import shared_words

_BLOCK = 4096
_BLOCKS = 160
_OURS = ("firmware", "ghst", "user", "main")
_POLL = 3
_EINVAL = -22


class _Flash:
    def __init__(self):
        self._data = bytearray(_BLOCK * _BLOCKS)

    def readblocks(self, block, buffer, offset=0):
        at = block * _BLOCK + offset
        buffer[:] = memoryview(self._data)[at : at + len(buffer)]

    def writeblocks(self, block, buffer, offset=0):
        at = block * _BLOCK + offset
        self._data[at : at + len(buffer)] = buffer

    def ioctl(self, op, arg):
        return {4: _BLOCKS, 5: _BLOCK}.get(op, 0)


class _Input(io.IOBase):
    """Bytes that are typed, at their time."""

    def __init__(self):
        self.typed = b""
        self.buffer = self

    def read(self, count):
        data, self.typed = self.typed[:count], self.typed[count:]
        return data

    def ioctl(self, request, flags):
        if request != _POLL:
            return _EINVAL
        return flags & 1 if self.typed else 0


class _Implementation:
    name = "micropython"
    version = (1, 25, 0)


class _Sys:
    platform = "esp32"


class Bench:
    """A board of the ESP32 family with the firmware on it, and a receiver on its wire.

    `said`: everything that was printed; `ends`: when each frame of the receiver ended, in us.
    """

    def __init__(self, tree, machine, chip, configuration=None, user=None, seed=1):
        """`tree`: folder with the board's files; `machine`: its name in `sys.implementation`."""
        self.board = Board(seed, chip)
        self.said = ""
        self.ends = []
        self._later = []
        self.input = _Input()
        files = _read(tree, "")
        flash = _Flash()
        vfs.VfsLfs2.mkfs(flash)
        os.chdir("/")
        vfs.umount("/")
        vfs.mount(vfs.VfsLfs2(flash), "/")
        if configuration is not None:
            text = configuration
            files["/ghst.json"] = text if isinstance(text, bytes) else json.dumps(text).encode()
        if user:
            files["/user.py"] = user.encode()
        for path, content in files.items():
            self.write(path, content)
        sys.path[:] = ["", "/lib"]
        self._replace(machine)

    def write_later(self, path, content):
        """Puts a file there when the chip has been reset."""
        self._later.append((path, content))

    def close(self):
        """Gives the interpreter its own root back, for another bench."""
        os.chdir("/")
        vfs.umount("/")
        vfs.mount(vfs.VfsPosix("/"), "/")

    def write(self, path, content):
        """Puts a file into the board's file system."""
        parts = path.split("/")[1:-1]
        for count in range(1, len(parts) + 1):
            try:
                os.mkdir("/" + "/".join(parts[:count]))
            except OSError:
                pass
        with open(path, "wb") as file:
            file.write(content)

    def _replace(self, machine):
        _Implementation._machine = machine
        fake = _Sys()
        fake.implementation = _Implementation
        fake.stdin = self.input
        fake.stdout = sys.stdout
        fake.modules = sys.modules
        fake.path = sys.path
        sys.modules["sys"] = fake
        sys.modules["machine"] = Machine(self.board)
        sys.modules["time"] = self.board
        sys.modules["uctypes"] = shared_words
        for name in ("ptr16", "ptr32", "uint"):
            setattr(builtins, name, getattr(shared_words, name))
        builtins.print = self._print

    def _print(self, *values, sep=" ", end="\n"):
        self.said += sep.join([str(value) for value in values]) + end

    # -- what happens, and when ---------------------------------------------------------------

    def at(self, ms, action):
        """Has `action()` called when the clock is at `ms`."""
        self.board.at(1000.0 * ms, action)

    def type(self, ms, text):
        """Types a text on the console."""

        def typed():
            self.input.typed += text.encode()

        self.at(ms, typed)

    def fly(
        self, from_ms, to_ms, pulses, rate_hz=250, kinds=(0x30, 0x31, 0x33, 0x32), mode=6, lq=90
    ):
        """Sends frames with these 16 pulses, or `pulses(number)`, of each kind in turn."""
        number = 0
        at_us = 1000.0 * from_ms
        while at_us < 1000.0 * to_ms:
            now = pulses(number) if callable(pulses) else pulses
            kind = kinds[number % len(kinds)]
            if kind in (0x13, 0x33):
                raw = [ghst.encode.raw_primary(kind, pulse) for pulse in now[:4]]
                frame = ghst.encode.link_data(kind, raw, rf_mode=mode, lq=lq, rssi_dbm=-70)
            else:
                frame = ghst.encode.channels_from_pulses(kind, now)
            self.ends.append(self.board.send(bytes(frame), at_us))
            number += 1
            at_us += 1e6 / rate_hz

    def frame(self, kind, raw):
        """Returns a frame with this raw value on channels 1 to 4."""
        return bytes(ghst.encode.channels(kind, (raw,) * 4, (128,) * 4))

    def run(self, until_ms):
        """Runs `/main.py`, and again after each reset, until Ctrl-C at `until_ms`."""
        board = self.board
        while True:
            board.interrupt_us = 1000.0 * until_ms
            for name in list(sys.modules):
                if name.split(".")[0] in _OURS:
                    del sys.modules[name]
            # Shortly before, so that it is known what there is at the end.
            self.type(until_ms - 12, "\r")
            try:
                with open("/main.py") as file:
                    exec(file.read(), {"__name__": "__main__"})
            except ChipReset:
                for path, content in self._later:
                    self.write(path, content)
                self._later = []
                board.reset()
                continue
            return

    # -- what came of it ----------------------------------------------------------------------

    def pulses_us(self, pin, from_ms=0.0):
        """The widths that a pin showed since then, each once; 0: low."""
        found = []
        for what in self.board.pad(pin).since(1000.0 * from_ms):
            found.append(what[1] if isinstance(what, tuple) else what)
        return found

    def lines(self, beginning):
        """The lines that were printed and begin so."""
        return [line for line in self.said.split("\n") if line.startswith(beginning)]

    def frames_decoded(self):
        """How many control frames the application counted, as it said last."""
        return int(self.lines("link: ")[-1].split("frames ")[1].split(",")[0])

    def slots_us(self):
        """How far behind the end of a frame each of ours began."""
        return [
            start - max([end for end in self.ends if end <= start])
            for start in self.board.starts()
        ]


def _read(folder, path):
    files = {}
    for entry in os.ilistdir(folder + path):
        name = path + "/" + entry[0]
        if entry[1] & 0x4000:
            files.update(_read(folder, name))
        else:
            with open(folder + name, "rb") as file:
                files[name] = file.read()
    return files
