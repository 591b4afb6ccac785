"""Bytes over the emulated wire into the firmware, judged by the model."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence

from ghst_tools.campaign import again, streams
from ghst_tools.campaign.model import Model
from ghst_tools.campaign.outputs import Outputs
from ghst_tools.campaign.pico import FAILSAFE_NS, Pico
from ghst_tools.campaign.picos import Picos, forked, no_exception
from ghst_tools.campaign.shown import Shown
from ghst_tools.campaign.verdict import Case, Row, equal, expect

# In the main loop: whatever takes of the heap is told.
WATCH_HEAP = (
    "import gc; adapter.poll(); taken = gc.mem_alloc()\n"
    "    if taken != before: print('heap taken', taken - before); before = taken\n"
    "    time.sleep_ms(400)"
)
HEAP_SETUP = "import gc; taken = before = 0; gc.collect(); gc.disable(); before = gc.mem_alloc()"

_FRAME_BYTES = 14
_BYTE_US = 10e6 / 420_000
_GAP_US = 150.0
_BURST_ENDS_US = 250
"""A pause that is longer ends a burst; the firmware waits for 150 us."""
_HANDLER_US = 15.0
_BEHIND_NS = 100e3
_EARLY_NS, _LATE_NS = 5e3, 100e3
"""How far from where it has to look the outputs are written; other bytes take their time, too."""
_FAILSAFE_LATE_NS = 20e6
_PATIENCE_US = (180.0, 124.0)
"""How long the firmware waits for what is to complete a frame: once, and for each byte."""
INTACT_US = 400.0
"""Before the intact frame behind a block."""
_PAUSES_US = (0.0, 0.0, 0.0, 0.0, 20.0, 90.0, 300.0, 1700.0)

Send = tuple[float, bytes]
"""A pause before it in microseconds, and the bytes."""


def sends(seed: int, total: int) -> Iterator[list[Send]]:
    """The blocks of `streams` with pauses between their pieces; the sentinel after a long one."""
    rng = random.Random(seed)
    for *pieces, last in streams.blocks(seed, total):
        yield [(rng.choice(_PAUSES_US), piece) for piece in pieces] + [(INTACT_US, last)]


class Listener:
    """What the firmware has to make of bytes on the wire: the model, and when it looks at them.

    It looks behind the 14th, 28th, ... byte of a burst, and when a burst breaks off. Bytes are
    dropped that were unfinished then; and those that were unfinished at the end of a burst which
    ended with its 14th, 28th, ... byte, if what comes then has taken too long.

    `now_us`: the end of the last byte; `controls`: when it has looked and found control frames,
    and the channels then.
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        self.shown = Shown()
        self.now_us = 0.0
        self.controls: list[tuple[float, list[int]]] = []
        self._unread = b""
        self._burst = 0
        self._looked_us = 0.0

    def take(self, pause_us: float, data: bytes) -> int:
        """Bytes after a pause; how many control frames were found among them at once.

        Those that break off are looked at when the next come.
        """
        controls = 0
        if pause_us > _BURST_ENDS_US:
            if self._burst % _FRAME_BYTES:
                self._look(self.now_us + _GAP_US)
                self.model.discard_partial()
            self._burst = 0
        self.now_us += pause_us
        for index in range(len(data)):
            self.now_us += _BYTE_US
            self._burst += 1
            self._unread += data[index : index + 1]
            if self._burst % _FRAME_BYTES == 0:
                controls += self._look(self.now_us)
        return controls

    def _look(self, now_us: float) -> int:
        least_us, byte_us = _PATIENCE_US
        waited_us = now_us - self._looked_us - _HANDLER_US
        if waited_us > least_us + byte_us * len(self._unread):
            self.model.discard_partial()
        self._looked_us = now_us
        unread, self._unread = self._unread, b""
        found = self.model.feed(unread)
        if found:
            self.controls.append((now_us, self.model.pulses.copy()))
        return found


def one_block(pico: Pico, outputs: Outputs, listener: Listener, block: Sequence[Send]) -> None:
    """Send a block; the decoder's memory and every pulse have to be as the model has them."""
    case = wire_case(block)
    end = pico.at(300e3)
    for pause_us, data in block:
        controls = listener.take(pause_us, data)
        end = pico.wire.send(data, end + pause_us * 1e3)
        for looked_us, pulses in listener.controls:
            at = end + (looked_us - listener.now_us) * 1e3
            outputs.now_due(at - _EARLY_NS, at + _LATE_NS, f"of {data.hex()}", pulses)
        listener.controls.clear()
    equal(controls, 1, "the model did not decode the intact frame", case)
    pico.board.run_for(end + _BEHIND_NS - pico.board.now_ns)
    listener.shown.look(pico.board, pico.memory_address, pico.pulses())
    different = listener.shown.differences(listener.model)
    expect(not different, f"on the chip: {'; '.join(different)}", case)
    outputs.check(case=case)


def fuzz_adapter(pico: Pico, seed: int, total: int) -> tuple[int, str]:
    """`total` bytes to an adapter; how many it were, and what was found."""
    outputs = Outputs(pico)
    listener = Listener(outputs.model)
    count = blocks = 0
    for block in sends(seed, total):
        one_block(pico, outputs, listener, block)
        blocks += 1
        count += sum(len(data) for _, data in block)
        if blocks % 50 == 0:
            pico.wire.edges.clear()
    last = pico.at(-_BEHIND_NS)
    pico.board.run_for(FAILSAFE_NS + _FAILSAFE_LATE_NS)
    outputs.failsafe(last + FAILSAFE_NS, last + FAILSAFE_NS + _FAILSAFE_LATE_NS)
    outputs.finish()
    no_exception(pico)
    heap = b"heap taken" not in pico.board.console.output
    expect(heap, f"the heap: {bytes(pico.board.console.output[-200:])!r}")
    return count, (
        "every counter, channel, link value, video setting and MSP payload as the model has it "
        f"after each of {blocks} blocks, each intact frame decoded ({listener.model.frames} "
        f"control frames); {outputs.shown()}, and none in failsafe at the end; no exception, no "
        "byte of the heap, no reset"
    )


def wire_case(block: Sequence[Send]) -> Case:
    """A block as a case that can be saved."""
    return {"kind": "wire", "sends": [[pause_us, data.hex()] for pause_us, data in block]}


def replay(case: Case, picos: Picos) -> None:
    """Run a saved case on a started board; raises Wrong."""
    pico = picos.run(WATCH_HEAP, setup=HEAP_SETUP, watchdog=True)

    def trial() -> None:
        outputs = Outputs(pico)
        listener = Listener(outputs.model)
        for one in again.blocks_of(case):
            block = [(us, bytes.fromhex(data)) for us, data in one["sends"]]
            one_block(pico, outputs, listener, block)
        outputs.finish()

    forked(trial)


def fuzz(picos: Picos, seed: int, total: int) -> list[Row]:
    """`total` bytes over the wire to an adapter whose memory is looked into."""
    pico = picos.run(WATCH_HEAP, setup=HEAP_SETUP, watchdog=True)

    def case_of(block: list[Send]) -> tuple[Case, int]:
        return wire_case(block), sum(len(data) for _, data in block)

    with again.among(sends(seed, total), case_of, "wire_bytes"):
        count, happened = forked(lambda: fuzz_adapter(pico, seed, total))
    return [
        Row(
            "bytes, emulated wire",
            f"{count:,} bytes of the same kinds, bit by bit, with pauses of 0 to 1700 us between "
            f"the pieces, and of {INTACT_US:.0f} us before the intact frame behind each block",
            happened,
        )
    ]
