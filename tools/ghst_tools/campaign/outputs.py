"""What the outputs show, against what is due for the frames that the board has received."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import ghst  # type: ignore[import-not-found]
from ghst_tools.campaign.model import Model
from ghst_tools.campaign.pico import PERIOD_NS, SERVOS, CompareWrite, Pico, steps
from ghst_tools.campaign.picos import HIGHEST, HIGHEST_NS, LOWEST
from ghst_tools.campaign.verdict import equal, expect
from ghst_tools.emulator.receiver import SentFrame

# From the end of a frame's last stop bit to the last compare register; the firmware may see that
# end in the middle of the bit.
SOON_NS = 50e3
_HALF_BIT_NS = 1.2e3

_COUNTER = 0x40050008
_SLICE_BYTES = 0x14
COUNT_NS = 312.5
_SLICES = sorted({pin >> 1 & 7 for pin in SERVOS})
# The beginning of a period is known to a count, a width to the chip's grid.
_BEGIN_ERROR_NS = 1e3
_WIDTH_ERROR_NS = 10.0


def moving(index: int, kind: int = 0x30) -> bytes:
    """A frame in which no two channels are alike, and none is as in the 31 frames before it."""
    return bytes(ghst.encode.channels(kind, _sticks(index), [_raw(index, n) for n in range(4, 8)]))


def moving_link(index: int, kind: int = 0x13, **link: Any) -> bytes:
    """The same with link data instead of the channels from the fifth on."""
    return bytes(ghst.encode.link_data(kind, _sticks(index), **link))


def _raw(index: int, number: int) -> int:
    return (37 * index + 32 * number) % 256


def _sticks(index: int) -> list[int]:
    return [16 * _raw(index, number) + index % 16 for number in range(4)]


class _Due(NamedTuple):
    """What is to be written into the compare registers, and when."""

    earliest_ns: float
    latest_ns: float
    counts: dict[int, int]
    what: str


class Outputs:
    """The eight servos of a board whose outputs are off, from now on.

    Each frame and each failsafe has to be told, in the order of time. `check` looks at every
    write to the compare registers and at every period of every pin: it shows what was written
    last before it began, in one pulse, or in none if there is nothing to show. What has been
    looked at is forgotten.
    """

    def __init__(self, pico: Pico) -> None:
        self._pico = pico
        self.model = Model()
        self.seen = 0  # pulses
        self._due: deque[_Due] = deque()
        self._heard_ns = now = pico.board.now_ns
        self._next_ns, self._written = {}, {}
        for pin in SERVOS:
            counter = pico.board.read32(_COUNTER + _SLICE_BYTES * (pin >> 1 & 7))
            self._next_ns[pin] = now - COUNT_NS * counter + PERIOD_NS
            self._written[pin] = deque([(0.0, 0)])
        pico.compares.clear()
        for pulses in pico.meter.pulses.values():
            pulses.clear()

    def frame(self, end_ns: float, frame: bytes, soon_ns: float = SOON_NS) -> None:
        """The board has received `frame`, its last stop bit until `end_ns`."""
        if self.model.feed(frame):
            self.now_due(end_ns - _HALF_BIT_NS, end_ns + soon_ns, f"of {frame.hex()}")

    def frames(self, sent: Iterable[SentFrame]) -> int:
        """It has received those that have ended since those told before; how many are control."""
        before = self.model.frames
        for end_ns, frame in sent:
            if self._heard_ns < end_ns < self._pico.board.now_ns:
                self.frame(end_ns, frame)
                self._heard_ns = end_ns
        return self.model.frames - before

    def later(self, sent: Sequence[SentFrame]) -> None:
        """It has received these all at once, when interrupts were on again after the last."""
        for frame in sent:
            self.model.feed(frame.frame)
        self._heard_ns = end_ns = sent[-1].end_ns
        self.now_due(end_ns - _HALF_BIT_NS, math.inf, f"of {sent[-1].frame.hex()}")

    def failsafe(self, earliest_ns: float, latest_ns: float) -> None:
        """All channels are forgotten between these times: no pulse until each has come again."""
        self.model.pulses[:] = [0] * len(self.model.pulses)
        self.now_due(earliest_ns, latest_ns, "of failsafe")

    def now_due(
        self, earliest_ns: float, latest_ns: float, what: str, pulses: Sequence[int] = ()
    ) -> None:
        """These channels, or those that the model has now, are due between these times."""
        counts = [steps(pulse) if pulse else 0 for pulse in pulses or self.model.pulses]
        due = {pin: counts[channel - 1] for pin, channel in SERVOS.items()}
        for count in due.values():
            expect(not count or LOWEST <= count <= HIGHEST, f"the model has {count} counts")
        self._due.append(_Due(earliest_ns, latest_ns, due, what))

    def check(self, where: str = "", case: dict[str, Any] | None = None) -> None:
        """Raise Wrong unless all is as due until now."""
        prefix = f"{where}: " if where else ""
        self._check_writes(prefix, case)
        for pin in SERVOS:
            self._check_pulses(pin, prefix, case)

    def finish(self, where: str = "") -> None:
        """The same when nothing more is received, after a period more."""
        self._pico.board.run_for(PERIOD_NS + 2 * HIGHEST_NS)
        self.check(where)
        equal(len(self._due), 0, "writes to come")

    def shown(self) -> str:
        """What `check` has seen, for a row of the report."""
        return (
            f"each of {self.seen} pulses at the eight pins as the last frame before it has it, "
            "none missing"
        )

    def _check_writes(self, prefix: str, case: dict[str, Any] | None) -> None:
        writes = deque(self._pico.compares)
        while self._due and (writes or self._due[0].latest_ns < self._pico.board.now_ns):
            due = self._due[0]
            if len(writes) < len(_SLICES) and due.latest_ns >= self._pico.board.now_ns:
                break
            found = [writes.popleft() for _ in _SLICES if writes]
            wanted = [
                (number, due.counts[2 * number] | due.counts[2 * number + 1] << 16)
                for number in _SLICES
            ]
            what = f"{prefix}slices and compare values {due.what}"
            equal([(write.slice, write.value) for write in found], wanted, what, case)
            for write in found:
                self._keep(write, due, prefix, case)
            self._due.popleft()
        late = [] if self._due else list(writes)
        equal(late, [], f"{prefix}compare writes for which there is no frame", case)
        self._pico.compares[:] = writes

    def _keep(
        self, write: CompareWrite, due: _Due, prefix: str, case: dict[str, Any] | None
    ) -> None:
        right = due.earliest_ns <= write.t_ns <= due.latest_ns
        after = (write.t_ns - due.earliest_ns) / 1e3
        expect(right, f"{prefix}a compare write {due.what} {after:.1f} us after it", case)
        for pin in (2 * write.slice, 2 * write.slice + 1):
            self._written[pin].append((write.t_ns, due.counts[pin]))

    def _check_pulses(self, pin: int, prefix: str, case: dict[str, Any] | None) -> None:
        pulses, written = self._pico.meter.pulses[pin], self._written[pin]
        seen = 0
        # A pulse that has begun is on record when it has ended.
        until = self._pico.board.now_ns - HIGHEST_NS - 2 * _BEGIN_ERROR_NS
        if self._due:
            until = min(until, self._due[0].earliest_ns)
        while (begin := self._next_ns[pin]) < until:
            while len(written) > 1 and written[1][0] < begin - _BEGIN_ERROR_NS:
                written.popleft()
            # Beside the very beginning of the period either may have been taken over.
            wanted = [n for t_ns, n in written if t_ns < begin + _BEGIN_ERROR_NS]
            width = None
            if seen < len(pulses) and pulses[seen].rise_ns < begin + PERIOD_NS / 2:
                at = pulses[seen].rise_ns - begin
                expect(abs(at) < _BEGIN_ERROR_NS, f"{prefix}a pulse on GP{pin} {at} ns off", case)
                width = pulses[seen].width_ns
                seen += 1
            right = any(abs(COUNT_NS * n - (width or 0)) < _WIDTH_ERROR_NS for n in wanted)
            due = " or ".join(f"{COUNT_NS * n / 1e3} us" if n else "none" for n in wanted)
            shown = f"a pulse of {width / 1e3} us" if width else "no pulse"
            expect(right, f"{prefix}{shown} on GP{pin}, must be {due}", case)
            self._next_ns[pin] += PERIOD_NS
        del pulses[:seen]
        self.seen += seen
