"""The chip that is measured: an emulated Pico with the firmware of this tree, and its meters."""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from itertools import cycle
from pathlib import Path
from typing import Any

from ghst import encode  # type: ignore[import-not-found]
from ghst_tools import boards, device_files, filesystem, frozen
from ghst_tools.demo.aircraft import Devices
from ghst_tools.demo.probes import CompareWrites, ConsoleLog
from ghst_tools.emulator import Board, GhostReceiver, PulseMeter, Wire

CLOCK_HZ = 125_000_000
FAILSAFE_MS = 110
TICK_NS = 10e6
"""The tick of the firmware: failsafe, watchdog, LED."""

Change = tuple[str, str]
"""A piece of source that occurs once, and what takes its place."""

# A measurement replaces main.py; apart from that the files are those that a board gets.
_READY = "measurement ready"
_START = """
import gc, time
from firmware.adapter import Adapter
adapter = Adapter({arguments})
adapter.start()
"""
# Of what the board's configuration says, as the application does it.
_START_CONFIGURED = """
import gc, time
from firmware.start import control_path
adapter = control_path()[1]
adapter.start()
"""

CONTROL_TYPES = (0x10, 0x11, 0x12, 0x13, 0x14, 0x30, 0x31, 0x32, 0x33, 0x34)
_LINK_DATA = (0x13, 0x33)


class Rig:
    """What does not change from one measurement to the next: image, files, pins."""

    def __init__(self, image: Path, board: str = boards.DEFAULT_BOARD) -> None:
        self.definition = boards.load(board)
        self.files = device_files.collect(self.definition)
        self.image = image
        self.defaults = defaults = json.loads(self.definition.definition)["defaults"]
        self.wire_pin: int = defaults["wire"]["pin"]
        self.servos = {int(pin): point["channel"] for pin, point in defaults["outputs"].items()}
        self._led: int = defaults["led"]["pin"]
        self._start = _START

    def __getstate__(self) -> dict[str, object]:
        """What a copy gets, or another process: no board that runs."""
        return {name: value for name, value in self.__dict__.items() if name != "asleep"}

    @property
    def sources(self) -> dict[str, Path]:
        """The modules of the board: name such as `ghst/decoder.py` -> where its source is."""
        return device_files.sources(board=self.definition)

    def variant(self, changes: Mapping[str, Sequence[Change]]) -> Rig:
        """A rig whose firmware differs: name of a module -> changes of its text."""
        texts = {name: path.read_text(encoding="utf-8") for name, path in self.sources.items()}
        for name, replacements in changes.items():
            for old, new in replacements:
                if texts[name].count(old) != 1:
                    raise AssertionError(f"{name} has not once: {old}")
                texts[name] = texts[name].replace(old, new)
        varied = copy.copy(self)
        varied.files = self.files | device_files.compile_texts(texts, self.definition.mpy_arch)
        return varied

    def with_outputs(
        self, outputs: Mapping[int, Mapping[str, Any]], others: Mapping[str, Any]
    ) -> Rig:
        """A rig whose boards have these outputs in their configuration: GPIO -> its values.

        Those that a board has by default have to be among them. `others`: the other sections.
        """
        other = copy.copy(self)
        other.servos = {pin: point["channel"] for pin, point in outputs.items()}
        points = {f"{pin}": point for pin, point in outputs.items()}
        configuration = {"outputs": points, **others}
        other.files = self.files | {"/ghst.json": json.dumps(configuration).encode()}
        other._start = _START_CONFIGURED
        return other

    def arguments(self, options: str = "") -> str:
        """The arguments of `Adapter(...)` for this board; `options`: more of them."""
        return f"{self.wire_pin}, {self.servos}, led={self._led}, {options}"

    def starting(self, options: str = "") -> str:
        """The lines of a program that make `adapter` and start it.

        `options`: more arguments, where no configuration says what it is like.
        """
        return self._start.format(arguments=self.arguments(options))

    def power_on(self, files: Mapping[str, bytes] | None = None) -> Running:
        """A board with the firmware as users have it, at the moment of power-on.

        `files`: more files.
        """
        return Running(self, self.image, self.files | dict(files or {}))

    def run(self, program: str) -> Running:
        """A board that has `program` as its main.py; runs until it has printed `ready()`."""
        running = Running(self, self.image, self.files | {"/main.py": program.encode()})
        running.board.boot(until=_READY.encode())
        return running

    def fly(self, loop: str, options: str = "", setup: str = "") -> Running:
        """A board with a started `adapter` and `loop`, one line, as its endless main loop.

        `setup`: lines before it.
        """
        start = self.starting(options) + setup
        return self.run(f"{start}{self.ready}\nwhile True:\n    {loop}\n")

    @cached_property
    def asleep(self) -> Running:
        """One board for everything that needs no main loop: it sleeps, failsafe is `FAILSAFE_MS`.

        Link losses end in failsafe, and leave it with the next frame.
        """
        return self.fly("time.sleep(60)", f"failsafe_ms={FAILSAFE_MS}")

    @cached_property
    def frozen(self) -> Rig:
        """A rig with the firmware in its image, and an empty file system. Takes a minute to build.

        GhstError tells what is missing for that.
        """
        image = copy.copy(self)
        image.image = frozen.build(self.definition.name)
        image.files = {}
        return image

    @property
    def ready(self) -> str:
        """The line of a program that tells `run` to go on."""
        return f"print({_READY!r})"


class Running:
    """An emulated board with a wire, and meters on its servo pins."""

    def __init__(self, rig: Rig, image: Path, files: dict[str, bytes]) -> None:
        self.board = Board(image, filesystem.build(files, rig.definition.filesystem_size))
        self.wire = Wire(self.board, rig.wire_pin)
        self.meter = PulseMeter(self.board, rig.servos)
        self.compare = CompareWrites(self.board, rig.servos)
        self.console = ConsoleLog(self.board)
        self.devices: Devices | None = None

    def receiver(self, frames: Iterator[bytes], rate_hz: float) -> GhostReceiver:
        """A simulated receiver that will send `frames` until they end."""
        return GhostReceiver(self.wire, lambda index, t_ns: next(frames, None), rate_hz)

    def numbers(self, name: str) -> list[int]:
        """The numbers that the program has printed between the words `name` and `end`."""
        words = bytes(self.board.console.output).split()
        start = words.index(name.encode()) + 1
        return [int(word) for word in words[start : words.index(b"end", start)]]

    def run_until(self, t_ns: float) -> None:
        """Run to a time since power-on, unless it has passed."""
        if t_ns > self.board.now_ns:
            self.board.run_for(t_ns - self.board.now_ns)


def control_frames(types: tuple[int, ...] = CONTROL_TYPES) -> Iterator[bytes]:
    """Control frames of these types in turn, without end, with random values.

    The values use the whole raw range, so that pulses beyond the limits occur. Every call begins
    the same sequence.
    """
    values = random.Random(0x6857)
    for kind in cycle(types):
        primaries = [values.randrange(4096) for _ in range(4)]
        if kind in _LINK_DATA:
            yield encode.link_data(kind, primaries)
        else:
            yield encode.channels(kind, primaries, [values.randrange(256) for _ in range(4)])
