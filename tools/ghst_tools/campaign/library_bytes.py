"""Bytes into `ghst.Receiver`, on CPython and on MicroPython's unix port, judged by the model."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from itertools import islice, takewhile
from typing import Any

import ghst  # type: ignore[import-not-found]
from ghst_tools import boards, micropython_image
from ghst_tools.campaign import streams
from ghst_tools.campaign.model import Model
from ghst_tools.campaign.verdict import Row, Wrong, equal

COUNTERS = (
    *("frames", "crc_errors", "length_errors", "unknown_frames", "foreign_frames", "msp_frames"),
    *("vtx_setups", "vtx_controls", "skipped_bytes"),
)
LINK = ("lq", "rssi_dbm", "rssi_percent", "rf_mode", "tx_power_dbm", "vtx_freq_mhz")

# Each piece has its length in two bytes before it; length 0 ends a block, and the piece before it
# is fed after `discard_partial`. Whatever is raised, or allocated, ends the program.
_PROGRAM = """
import sys
from micropython import heap_lock, heap_unlock
from ghst import Receiver
receiver = Receiver()
names = {names}
size = bytearray(2)
piece = bytearray(512)
view = memoryview(piece)
def feed(length):
    heap_lock()
    controls = receiver.feed(piece, length)
    heap_unlock()
    return controls
def quiet():
    heap_lock()
    receiver.discard_partial()
    heap_unlock()
with open({path!r}, "rb") as file:
    controls = 0
    waiting = 0
    while file.readinto(size):
        length = size[0] | size[1] << 8
        if length:
            if waiting:
                controls += feed(waiting)
            file.readinto(view[:length])
            waiting = length
            continue
        quiet()
        values = [controls, feed(waiting)]
        controls = waiting = 0
        values += [getattr(receiver, name) for name in names]
        values += list(receiver.pulses)
        print(" ".join([str(value) for value in values]))
"""


def _state(receiver: Any) -> list[int]:
    return [getattr(receiver, name) for name in COUNTERS + LINK] + list(receiver.pulses)


def _take(receiver: Any, pieces: Sequence[bytes]) -> list[int]:
    """Feed a block; what came back for its pieces and for its sentinel, and the state then."""
    controls = sum(receiver.feed(piece) for piece in pieces[:-1])
    (receiver.discard if isinstance(receiver, Model) else receiver.discard_partial)()
    return [controls, receiver.feed(pieces[-1]), *_state(receiver)]


def on_cpython(all_blocks: Iterable[list[bytes]]) -> tuple[list[str], int]:
    """Feed a receiver; what the model says after each block, as text, and how many bytes."""
    model, receiver = Model(), ghst.Receiver()
    expected = []
    total = 0
    for pieces in all_blocks:
        wanted = _take(model, pieces)
        case = bytes_case(pieces)
        try:
            found = _take(receiver, pieces)
        except Exception as error:
            raise Wrong(f"CPython: {type(error).__name__}: {error}", case) from error
        equal(found, wanted, "CPython: the receiver is not as the model", case)
        equal(found[1], 1, "CPython: the intact frame behind was not decoded", case)
        total += sum(map(len, pieces))
        equal(model.frame_bytes + model.skipped_bytes, total, "bytes accounted for", case)
        expected.append(" ".join(map(str, wanted)))
    return expected, total


def on_unix(all_blocks: Iterable[list[bytes]], expected: Sequence[str], limit_s: float) -> None:
    """The same on the unix port, with the heap locked."""
    with tempfile.NamedTemporaryFile(suffix=".bin") as file:
        for pieces in all_blocks:
            for piece in pieces:
                file.write(len(piece).to_bytes(2, "little") + piece)
            file.write(bytes(2))
        file.flush()
        program = _PROGRAM.format(names=COUNTERS + LINK, path=file.name)
        done = subprocess.run(
            [micropython_image.unix_micropython(), "-c", program],
            env={"MICROPYPATH": f"{boards.checkout() / 'lib'}:.frozen"},
            capture_output=True,
            text=True,
            timeout=limit_s,
        )
        found = done.stdout.splitlines()
        # A program that was ended by an exception has printed less.
        right = sum(
            1
            for _ in takewhile(lambda pair: pair[0] == pair[1], zip(found, expected, strict=False))
        )
        if right < len(expected):
            at = next(islice(all_blocks, right, None))
            if done.returncode:
                reason = " ".join([*found[right:], done.stderr]).strip()
            else:
                reason = f"{found[right]}, the model has {expected[right]}"
            raise Wrong(f"unix port: {reason}", bytes_case(at))


def bytes_case(pieces: Sequence[bytes]) -> dict[str, Any]:
    """A block as a case that can be saved."""
    return {"kind": "bytes", "pieces": [piece.hex() for piece in pieces]}


def replay(case: dict[str, Any]) -> None:
    """Run a saved case on both; raises Wrong."""
    block = [[bytes.fromhex(piece) for piece in case["pieces"]]]
    expected, _ = on_cpython(block)
    on_unix(block, expected, 60)


class _Blocks:
    """The same blocks each time that they are gone through, and none kept in memory."""

    def __init__(self, seed: int, total: int) -> None:
        self._arguments = (seed, total)

    def __iter__(self) -> Any:
        return streams.blocks(*self._arguments)


def fuzz(seed: int, total: int) -> list[Row]:
    """`total` bytes through both interpreters."""
    made = _Blocks(seed, total)
    expected, count = on_cpython(made)
    on_unix(made, expected, 60 + total / 5_000)
    frames = expected[-1].split()[2]
    happened = (
        f"every counter, pulse and link value as an independent model has it after each of "
        f"{len(expected)} blocks, every byte part of a frame or counted as skipped, the intact "
        f"frame behind each block decoded; {frames} control frames in all; no exception"
    )
    kinds = ", ".join(streams.KINDS)
    return [
        Row("bytes, CPython", f"{count:,} bytes: {kinds}", happened),
        Row("bytes, unix port", "the same bytes, heap locked", f"the same; {NO_HEAP}"),
    ]


NO_HEAP = "no byte of the heap taken (MicroPython's heap was locked)"
