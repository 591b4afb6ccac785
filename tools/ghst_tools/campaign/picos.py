"""Started boards for the campaign: each trial runs in a fork of one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from ghst_tools import boards, device_files
from ghst_tools.campaign.fork import in_child
from ghst_tools.campaign.pico import SERVOS, Pico
from ghst_tools.campaign.verdict import Wrong, expect

Result = TypeVar("Result")

_KEPT = 3
"""Started boards that wait for the next trial: each takes a hundred megabytes."""

LOWEST_NS, HIGHEST_NS = 800e3, 2200e3
_ONE_STEP_NS = 400  # a count of the PWM, and a grid of 8 ns
# Counts of 0.3125 us at 50 Hz.
LOWEST, HIGHEST = 2560, 7040


class Picos:
    """Boards with one image and the firmware of this tree."""

    def __init__(self, image: Path) -> None:
        self.image = image
        definition = boards.load(boards.DEFAULT_BOARD)
        self.filesystem_size = definition.filesystem_size
        self.files = device_files.collect(definition)
        self._started: dict[str, Pico] = {}

    def new(self) -> Pico:
        """A board that is powered off."""
        return Pico(self.image, self.files, self.filesystem_size)

    def run(self, *args: Any, **kwargs: Any) -> Pico:
        """A board after `Pico.run`; only to be used in a fork."""
        return self._start("run", *args, **kwargs)

    def boot(self, *args: Any, **kwargs: Any) -> Pico:
        """A board after `Pico.boot`; only to be used in a fork."""
        return self._start("boot", *args, **kwargs)

    def _start(self, how: str, *args: Any, **kwargs: Any) -> Pico:
        key = repr((how, args, kwargs))
        if key not in self._started:
            while len(self._started) >= _KEPT:
                del self._started[next(iter(self._started))]
            pico = self.new()
            getattr(pico, how)(*args, **kwargs)
            self._started[key] = pico
        return self._started[key]


def connect_battery(pico: Pico) -> None:
    """Connect a battery of four cells, and let the application find it and load its sensor."""
    pico.board.adc(0).set_volts(1.5)
    pico.board.run_for(300e6)
    said = pico.reply_to_enter()
    expect("battery: 16.50 V" in said, f"the battery has not been found: {said}")


def forked(trial: Callable[[], Result]) -> Result:
    """What `trial` returns, run in a fork of this process; raises Wrong if it does."""

    def caught() -> tuple[Result | None, Wrong | None]:
        try:
            return trial(), None
        except Wrong as wrong:
            return None, wrong

    result, wrong = in_child(caught)
    if wrong is not None:
        raise wrong
    return result  # type: ignore[return-value]


def check_outputs(pico: Pico, case: dict[str, Any] | None = None) -> int:
    """Every pulse and every compare value since the last call is within limits; how many pulses.

    What has been looked at is forgotten.
    """
    for write in pico.compares:
        for counts in (write.value & 0xFFFF, write.value >> 16):
            expect(
                counts == 0 or LOWEST <= counts <= HIGHEST,
                f"{counts} counts in a compare register, must be 0 or {LOWEST}..{HIGHEST}",
                case,
            )
    pico.compares.clear()
    count = 0
    for pin in SERVOS:
        for pulse in pico.meter.pulses[pin]:
            expect(
                LOWEST_NS - _ONE_STEP_NS <= pulse.width_ns <= HIGHEST_NS + _ONE_STEP_NS,
                f"a pulse of {pulse.width_ns / 1e3} us on GP{pin}",
                case,
            )
        count += len(pico.meter.pulses[pin])
        pico.meter.pulses[pin].clear()
    return count


def no_exception(pico: Pico, case: dict[str, Any] | None = None) -> None:
    """Nothing of what the board has printed is a traceback or a fault of the main loop."""
    text = bytes(pico.board.console.output)
    for mark in (b"Traceback", b"Unhandled exception", b"uncaught exception", b"faults, the last"):
        if mark in text:
            raise Wrong(f"the board printed {text[text.index(mark) :][:300]!r}", case)
    expect(not pico.board.resets, f"the watchdog has reset the board: {pico.board.resets}", case)
