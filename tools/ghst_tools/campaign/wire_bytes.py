"""Bytes over the emulated wire into the firmware, judged by the model."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from typing import Any

from ghst import decoder  # type: ignore[import-not-found]
from ghst_tools.campaign import streams
from ghst_tools.campaign.model import Model
from ghst_tools.campaign.outputs import Outputs
from ghst_tools.campaign.pico import FAILSAFE_NS, Pico
from ghst_tools.campaign.picos import Picos, forked, no_exception
from ghst_tools.campaign.verdict import Row, equal, expect

# In the main loop: whatever takes of the heap is told.
WATCH_HEAP = (
    "import gc; adapter.poll(); taken = gc.mem_alloc()\n"
    "    if taken != before: print('heap taken', taken - before); before = taken\n"
    "    time.sleep_ms(400)"
)
HEAP_SETUP = "import gc; taken = before = 0; gc.collect(); gc.disable(); before = gc.mem_alloc()"

_COUNTERS = {
    "frames": decoder.FRAMES,
    "crc_errors": decoder.CRC_ERRORS,
    "length_errors": decoder.LENGTH_ERRORS,
    "unknown_frames": decoder.UNKNOWN_FRAMES,
    "foreign_frames": decoder.FOREIGN_FRAMES,
    "msp_frames": decoder.MSP_FRAMES,
    "vtx_setups": decoder.VTX_SETUPS,
    "vtx_controls": decoder.VTX_CONTROLS,
    "skipped_bytes": decoder.SKIPPED_BYTES,
}
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
_PAUSES_US = (0.0, 0.0, 0.0, 0.0, 20.0, 90.0, 300.0, 1700.0)

Send = tuple[float, bytes]
"""A pause before it in microseconds, and the bytes."""


def sends(seed: int, total: int) -> Iterator[list[Send]]:
    """The blocks of `streams` with pauses between their pieces; the sentinel after a long one."""
    rng = random.Random(seed)
    for *pieces, last in streams.blocks(seed, total):
        yield [(rng.choice(_PAUSES_US), piece) for piece in pieces] + [(400.0, last)]


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
                self.model.discard()
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
            self.model.discard()
        self._looked_us = now_us
        unread, self._unread = self._unread, b""
        found = self.model.feed(unread)
        if found:
            self.controls.append((now_us, self.model.pulses.copy()))
        return found


def one_block(pico: Pico, outputs: Outputs, listener: Listener, block: Sequence[Send]) -> None:
    """Send a block; every counter, channel and pulse has to be as the model has it."""
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
    model = listener.model
    found = {name: pico.word(index) for name, index in _COUNTERS.items()}
    wanted = {name: getattr(model, name) for name in _COUNTERS}
    equal(found, wanted, "counters on the chip", case)
    equal(pico.pulses(), model.pulses, "channels on the chip", case)
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
        f"counters and channels as the model has them after each of {blocks} "
        f"blocks, the intact frame behind each decoded ({listener.model.frames} control frames); "
        f"{outputs.shown()}, and none in failsafe at the end; no exception, no byte of the heap, "
        "no reset"
    )


def wire_case(block: Sequence[Send]) -> dict[str, Any]:
    """A block as a case that can be saved."""
    return {"kind": "wire", "sends": [[pause_us, data.hex()] for pause_us, data in block]}


def replay(case: dict[str, Any], picos: Picos) -> None:
    """Run a saved case on a started board; raises Wrong."""
    block = [(pause_us, bytes.fromhex(data)) for pause_us, data in case["sends"]]
    pico = picos.run(WATCH_HEAP, setup=HEAP_SETUP, watchdog=True)

    def trial() -> None:
        outputs = Outputs(pico)
        one_block(pico, outputs, Listener(outputs.model), block)
        outputs.finish()

    forked(trial)


def fuzz(picos: Picos, seed: int, total: int) -> list[Row]:
    """`total` bytes over the wire to an adapter whose memory is looked into."""
    pico = picos.run(WATCH_HEAP, setup=HEAP_SETUP, watchdog=True)
    count, happened = forked(lambda: fuzz_adapter(pico, seed, total))
    return [
        Row(
            "bytes, emulated wire",
            f"{count:,} bytes of the same kinds, bit by bit, with pauses of 0 to 1700 us between "
            "the pieces",
            happened,
        )
    ]
