"""A board that counts in its main program and talks when told to, so that only interrupts cost.

A telemetry frame lies ready in it for ever. The word that has it sent is written from outside,
through the emulator: what the main program would do for that is no part of what is measured.
"""

from __future__ import annotations

from collections.abc import Iterator

from ghst import encode  # type: ignore[import-not-found]
from ghst_tools.bench.interrupts import FRAME_EXCEPTION, exception_cycles
from ghst_tools.bench.rig import Rig, control_frames
from ghst_tools.campaign.pico import TALKING_SETUP, control_words
from ghst_tools.emulator import GhostReceiver
from ghst_tools.emulator.wire import BAUD

# Counts as fast as the CPU gets round, and leaves it to interrupts only. MicroPython sends what
# was printed while the program sleeps: from `spin` on nothing comes any more.
_COUNTING = """
import micropython, uctypes
from array import array
{starting}
{talking}
refill()
adapter.control.discard()
@micropython.viper
def spin(count: ptr32):
    while True:
        count[0] += 1
count = array("I", [0])
print("addresses", uctypes.addressof(count), uctypes.addressof(adapter.control._words), "end")
{ready}
time.sleep_ms({pause_ms})
spin(count)
"""
_PAUSE_MS = 20
_LEAD_NS = 1e6
_SLOT_NS = 1e6
_FRAME_NS = 14 * 10e9 / BAUD
_STOP_BIT_NS = 1e9 / BAUD
# Of a period, before the first frame of a measurement: at 500 Hz the echo of each frame is over
# 0.3 ms before the next, so that none is cut at either end.
_LEAD_SHARE = 0.05
# Race mode, which has a downlink.
_LINK_DATA = bytes(encode.link_data(0x13, (1984,) * 4, rf_mode=6))


class Talking:
    """The board, started; it says nothing unless told to."""

    def __init__(self, rig: Rig) -> None:
        self.running = rig.run(
            _COUNTING.format(
                starting=rig.starting(),
                talking=TALKING_SETUP,
                ready=rig.ready,
                pause_ms=_PAUSE_MS,
            )
        )
        self.board = self.running.board
        self._count, words = self.running.numbers("addresses")
        self._words = {name: words + 4 * at for name, at in control_words().items()}
        self.board.run_for(2e6 * _PAUSE_MS)

    def word(self, name: str) -> int:
        """A word of the interrupts' array."""
        return self.board.read32(self._words[name])

    def hand_over(self) -> None:
        """Have the frame that lies ready sent behind the next control frame."""
        self.board.write32(self._words["SLOT"], 1)

    def interrupts(self) -> tuple[int, int]:
        """CPU cycles of the interrupt of a link data frame that hands telemetry over, and of that
        of its echo."""
        running = self.running
        sent, wrong = self.word("TELEMETRY_FRAMES"), self.word("COLLISIONS")
        self.hand_over()
        end_ns = running.wire.send(_LINK_DATA, self.board.now_ns + _LEAD_NS)
        # Both interrupts come in the middle of the last stop bit.
        running.run_until(end_ns - 2e3)
        handed = exception_cycles(running, FRAME_EXCEPTION, 100e3)
        running.run_until(end_ns + _SLOT_NS + _FRAME_NS - 3 * _STOP_BIT_NS)
        echo = exception_cycles(running, FRAME_EXCEPTION, 100e3)
        self.board.run_for(_LEAD_NS)
        found = self.word("TELEMETRY_FRAMES") - sent, self.word("COLLISIONS") - wrong
        if found != (1, 0):
            raise AssertionError(f"telemetry frames sent, collisions: {found}")
        return handed, echo

    def rounds(self, seconds: float) -> int:
        """How often the main program gets round."""
        before = self.board.read32(self._count)
        self.board.run_for(seconds * 1e9)
        return self.board.read32(self._count) - before

    def rounds_in_flight(
        self, seconds: float, rate_hz: float, talk: bool, frames: Iterator[bytes] | None = None
    ) -> tuple[int, list[bytes]]:
        """The same with control frames, with telemetry behind each if `talk`; and the frames.

        `frames`: others than `control_frames()`.

        Raises AssertionError if telemetry is missing, or is there and should not be.
        """
        sent, wrong = self.word("TELEMETRY_FRAMES"), self.word("COLLISIONS")
        source = self._frames(talk, frames or control_frames())
        receiver: GhostReceiver = self.running.receiver(source, rate_hz)
        receiver.start(self.board.now_ns + _LEAD_SHARE * 1e9 / rate_hz)
        left = self.rounds(seconds)
        receiver.stop()
        sent_frames = [frame for _, frame in receiver.sent]
        found = self.word("TELEMETRY_FRAMES") - sent, self.word("COLLISIONS") - wrong
        count = len(sent_frames)
        if found != (talk * count, 0):
            raise AssertionError(f"{count} frames; telemetry frames, collisions: {found}")
        return left, sent_frames

    def _frames(self, talk: bool, frames: Iterator[bytes]) -> Iterator[bytes]:
        # The mode has to be known for the first.
        if talk:
            self.running.wire.send(_LINK_DATA, self.board.now_ns + _LEAD_NS)
            self.board.run_for(2 * _LEAD_NS)
        return self._handing(talk, frames)

    def _handing(self, talk: bool, frames: Iterator[bytes]) -> Iterator[bytes]:
        for frame in frames:
            if talk:
                self.hand_over()
            yield frame
