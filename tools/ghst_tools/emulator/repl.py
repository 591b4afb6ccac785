"""MicroPython's raw REPL, driven in emulated time.

The protocol is the one of `mpremote` (MicroPython documentation, "The raw REPL"): Ctrl-C twice,
Ctrl-A, the banner, the source and Ctrl-D, `OK`, standard output, Ctrl-D, traceback, Ctrl-D.
"""

from __future__ import annotations

from ghst_tools.emulator.usb import Console

_BANNER = b"raw REPL; CTRL-B to exit\r\n>"
_EOT = b"\x04"


class DeviceError(Exception):
    """Code on the device raised an exception; the message is the device's traceback."""


class RawRepl:
    """One piece of code at a time, on the console of a board."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._source = b""
        self._received = bytearray()
        self._step = "idle"
        self.output = bytearray()
        self._traceback = b""

    @property
    def done(self) -> bool:
        """True when the code started last has ended."""
        return self._step == "done"

    def start(self, source: str) -> None:
        """Interrupt whatever runs on the device and start `source`."""
        self._source = source.encode()
        self._received.clear()
        self.output = bytearray()
        self._traceback = b""
        self._step = "banner"
        self._console.on_data = self._feed
        self._console.write(b"\r\x03\x03\r\x01")

    def result(self) -> str:
        """Return what the code has printed. Raises DeviceError if it raised."""
        if not self.done:
            raise RuntimeError("the code has not ended yet")
        if self._traceback:
            raise DeviceError(self._traceback.decode(errors="replace").replace("\r\n", "\n"))
        return self.output.decode(errors="replace").replace("\r\n", "\n")

    def _feed(self, data: bytes) -> None:
        self._received += data
        if self._step == "banner" and self._skip(_BANNER):
            self._console.write(self._source + _EOT)
            self._step = "ok"
        if self._step == "ok" and self._skip(b"OK"):
            self._step = "output"
        if self._step == "output":
            text, mark, rest = self._received.partition(_EOT)
            self.output += text
            self._received = rest
            if mark:
                self._step = "traceback"
        if self._step == "traceback" and _EOT in self._received:
            self._traceback = bytes(self._received.partition(_EOT)[0])
            self._step = "done"
            self._console.on_data = None
            self._console.write(b"\x02")  # back to the friendly REPL

    def _skip(self, token: bytes) -> bool:
        _, found, rest = self._received.partition(token)
        if found:
            self._received = rest
        return bool(found)
