"""The firmware on an emulated Pico, with a Ghost receiver on its wire and meters on its servos."""

from __future__ import annotations

import functools
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from ghst_tools import boards
from ghst_tools import filesystem as littlefs
from ghst_tools.emulator import Board, GhostReceiver, PulseMeter, Wire

SERVOS = {6: 1, 7: 2, 8: 3, 9: 4, 10: 5, 11: 6, 12: 7, 13: 8}
SENSORS = ("battery", "gps", "barometer", "magnetometer")
NO_SENSORS: dict[str, Any] = {name: {"enabled": False} for name in SENSORS}
PWM_PAGE = 0x40050
PERIOD_NS = 20e6
FAILSAFE_NS = 500e6

# What a test that looks inside runs instead of main.py; it prints the addresses that are read.
SCRIPT = """
import time, uctypes
from firmware.adapter import Adapter
adapter = Adapter({wire_pin}, {servos}, led=25, {options})
adapter.start(watchdog={watchdog})
{setup}
print("pulses", uctypes.addressof(adapter.receiver.pulses), "memory",
      uctypes.addressof(adapter.receiver.memory), "words",
      uctypes.addressof(adapter.control._words), "ready")
while True:
    {loop}
"""

# A telemetry frame waits as soon as the last one is gone; no two are the same.
TALKING_SETUP = """
import machine
from ghst import telemetry
frame = bytearray(14)
number = 0
def refill():
    global number
    if adapter.control.slot_free:
        telemetry.pack_status(frame, number * 10, 0, 0, True)
        number = (number + 1) & 0xFFFF
        adapter.control.send(frame)
"""
TALKING = "adapter.poll(); refill(); machine.idle()"


class CompareWrite(NamedTuple):
    """A write to a PWM compare register."""

    t_ns: float
    slice: int
    value: int


def steps(pulse: int) -> int:
    """PWM counts for `pulse` quarter microseconds at 50 Hz: a step is 0.3125 us, 4/5 of each."""
    return (8 * pulse + 5) // 10


@functools.cache
def control_words() -> dict[str, int]:
    """The words of the interrupts' array, as `firmware.interrupts` names them: name -> index."""
    # The module itself needs MicroPython.
    text = (boards.checkout() / "firmware/interrupts.py").read_text(encoding="utf-8")
    found = re.findall(r"^([A-Z_]+) = const\((\d+)\)", text, re.MULTILINE)
    return {name: int(number) for name, number in found}


class Pico:
    """An emulated Pico, powered off, and the files that go into its flash."""

    wire_pin = 2

    def __init__(self, image: Path, files: dict[str, bytes], filesystem_size: int) -> None:
        self._image = image
        self._files = files
        self._filesystem_size = filesystem_size

    def _power_on(self, files: dict[str, bytes], until: bytes) -> None:
        self.boot_from(self._built(files), until)

    def _built(self, files: dict[str, bytes]) -> bytes:
        return littlefs.build(files, self._filesystem_size)

    def boot_from(self, filesystem: bytes, until: bytes) -> None:
        """Start with this file system, whatever is in it."""
        self._connect(filesystem)
        self.board.boot(until=until)

    def _connect(self, filesystem: bytes) -> None:
        self.board = Board(self._image, filesystem)
        self.wire = self._connect_wire()
        # When the board begins and ceases to drive the Ghost wire.
        self.driven: list[tuple[float, bool]] = []
        self.wire.pin.watch(self._note_driving)
        self.meter = PulseMeter(self.board, SERVOS)
        self.compares: list[CompareWrite] = []
        pwm = self.board.mcu.peripherals[PWM_PAGE]
        write = pwm.write_uint32

        def record(offset: int, value: int) -> None:
            if offset % 0x14 == 0x0C and offset < 0xA0:
                self.compares.append(CompareWrite(self.board.now_ns, offset // 0x14, value))
            write(offset, value)

        pwm.write_uint32 = record

    def _connect_wire(self) -> Wire:
        return Wire(self.board, self.wire_pin)

    def _note_driving(self, t_ns: float, level: bool | None) -> None:
        driving = level is not None
        if driving is not bool(self.driven and self.driven[-1][1]):
            self.driven.append((t_ns, driving))

    def file(self, path: str) -> dict[str, Any]:
        """A JSON file of the board."""
        return dict(json.loads(self._files[path]))

    def boot(
        self,
        configuration: dict[str, Any] = NO_SENSORS,
        until: bytes = b"link: searching",
        files: dict[str, bytes | None] | None = None,
    ) -> None:
        """Start the firmware as a user's board does.

        `configuration`: ghst.json; by default without sensors, which take their time to load.
        `files`: more files; with None those that the board does not have.
        """
        added = {"/ghst.json": json.dumps(configuration).encode()} | (files or {})
        there = (self._files | added).items()
        self._power_on({path: content for path, content in there if content is not None}, until)
        self.compares.clear()

    def power_on(
        self,
        files: dict[str, bytes],
        frames: Callable[[int, float], bytes | None],
        rate_hz: float,
    ) -> GhostReceiver:
        """Be at the moment of power-on, with a receiver that sends `frames` all the time.

        `files`: more files than the firmware's; there is no ghst.json but one of them.
        """
        self._connect(self._built(self._files | files))
        receiver = GhostReceiver(self.wire, frames, rate_hz=rate_hz)
        receiver.start(0.0)
        return receiver

    def run(
        self,
        loop: str = "adapter.poll(); time.sleep_ms(20)",
        options: str = "",
        servos: object = SERVOS,
        watchdog: bool = False,
        setup: str = "",
    ) -> None:
        """Start an adapter with another main loop; the addresses of its memory become known.

        `setup` is run before the loop.
        """
        script = SCRIPT.format(
            wire_pin=self.wire_pin,
            servos=servos,
            options=options,
            watchdog=watchdog,
            loop=loop,
            setup=setup,
        )
        self._power_on(self._files | {"/main.py": script.encode()}, b"ready")
        words = bytes(self.board.console.output).split()
        self.pulses_address = int(words[words.index(b"pulses") + 1])
        self.memory_address = int(words[words.index(b"memory") + 1])
        self.control_address = int(words[words.index(b"words") + 1])
        self.compares.clear()

    def pulses(self) -> list[int]:
        """`receiver.pulses` as it stands in the device's memory."""
        words = [self.board.read32(self.pulses_address + 4 * n) for n in range(8)]
        return [half for word in words for half in (word & 0xFFFF, word >> 16)]

    def word(self, index: int) -> int:
        """A word of the decoder's memory (`ghst.decoder`)."""
        return self.board.read32(self.memory_address + 4 * index)

    def control_place(self, name: str) -> int:
        """Where the interrupts' array has the word that `firmware.interrupts` names so."""
        return self.control_address + 4 * control_words()[name]

    def control(self, name: str) -> int:
        """The word of the interrupts' array that `firmware.interrupts` names so."""
        return self.board.read32(self.control_place(name))

    def at(self, after_ns: float) -> float:
        """An emulated time from now."""
        return self.board.now_ns + after_ns

    def fly(self, frames: Callable[[int, float], bytes | None], rate_hz: float) -> GhostReceiver:
        """Start a receiver that sends `frames(index, t_ns)` at `rate_hz`."""
        receiver = GhostReceiver(self.wire, frames, rate_hz=rate_hz)
        receiver.start(self.at(1e6))
        return receiver

    def latencies_us(self, receiver: GhostReceiver) -> list[float | None]:
        """For each frame sent: from its last stop bit to the last compare write behind it."""
        found = []
        for end_ns, _ in receiver.sent:
            after = [c.t_ns - end_ns for c in self.compares if 0 < c.t_ns - end_ns < 300e3]
            found.append(after[-1] / 1e3 if after else None)
        return found

    def no_pulses_since(self, t_ns: float) -> bool:
        """Whether all pins have been low since `t_ns`, and are now."""
        return all(not self.meter.level(pin) and not self.meter.since(t_ns, pin) for pin in SERVOS)

    def reply_to_enter(self) -> str:
        """Press Enter on the console; return the lines that come."""
        start = len(self.board.console.output)
        self.board.console.write(b"\r")
        self.board.run_until(lambda: b" times\r\n" in self.board.console.output[start:])
        return self.board.console.output[start:].decode().replace("\r", "")
