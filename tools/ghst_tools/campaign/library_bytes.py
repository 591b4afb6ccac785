"""Bytes into `ghst.Receiver`, on CPython and on MicroPython's unix port, judged by the model."""

from __future__ import annotations

import inspect
import subprocess
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice, takewhile, zip_longest
from typing import Any, NamedTuple

import ghst  # type: ignore[import-not-found]
from ghst_tools import boards, micropython_image
from ghst_tools.campaign import again, streams
from ghst_tools.campaign.model import VALUES, Model
from ghst_tools.campaign.verdict import Row, Wrong, equal, expect

NAMES = [name for name in VALUES if name != "pulses"]
"""What is compared beside the pulses and the MSP payloads."""


def told(receiver: Any, names: Sequence[str], payload: bytearray) -> list[str]:
    """All that a receiver has, in words; takes the MSP frames that wait. Runs on MicroPython too.

    `names`: the values beside the pulses; `payload`: room for one of MSP.
    """
    words = []
    for name in names:
        value = getattr(receiver, name)
        value = value.hex() if isinstance(value, bytes) else int(value)
        words.append(f"{name}={value}")
    words.append("pulses=" + ",".join([str(pulse) for pulse in receiver.pulses]))
    while receiver.next_msp(payload):
        words.append("msp=" + payload.hex())
    words.append(f"msp_lost={receiver.msp_lost}")
    return words


# Each piece has its length in two bytes before it; length 0 ends a block, and the piece before it
# is the intact frame. Whatever is raised, or allocated by the decoder, ends the program.
_PROGRAM = """
from micropython import heap_lock, heap_unlock
from ghst import Receiver
{told}
receiver = Receiver()
payload = bytearray(10)
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
        if {paused}:
            quiet()
        words = [str(controls), str(feed(waiting))]
        controls = waiting = 0
        print(" ".join(words + told(receiver, {names}, payload)))
"""


def _begin(receiver: Any, pieces: Sequence[bytes], paused: bool) -> str:
    """Feed a block but for its intact frame; how many control frames it had."""
    controls = sum(receiver.feed(piece) for piece in pieces[:-1])
    if paused:
        receiver.discard_partial()
    return str(controls)


def _end(receiver: Any, intact: bytes) -> list[str]:
    """Feed the intact frame; how many control frames that completed, and the state then."""
    return [str(receiver.feed(intact)), *told(receiver, NAMES, bytearray(10))]


def _has_decoded(model: Model, intact: bytes) -> bool:
    alone = Model()
    alone.feed(intact)
    pairs = zip(model.pulses, alone.pulses, strict=True)
    return alone.frames == 1 and all(found == pulse for found, pulse in pairs if pulse)


def _differences(found: Sequence[str], wanted: Sequence[str]) -> str:
    pairs = zip_longest(found, wanted, fillvalue="nothing")
    return "; ".join(f"{one}, the model has {other}" for one, other in pairs if one != other)


class Judged(NamedTuple):
    """What the model says after each block, and how many bytes and intact frames it took."""

    lines: list[str]
    total: int
    intact: int


def on_cpython(all_blocks: Iterable[Sequence[bytes]], paused: bool = True) -> Judged:
    """Feed a receiver; with `paused` the line goes quiet before the intact frame of each block."""
    model, receiver = Model(), ghst.Receiver()
    lines = []
    total = intact = 0
    for pieces in all_blocks:
        case = bytes_case(pieces, paused)
        controls = _begin(model, pieces, paused)
        framed = model.frame_bytes
        wanted = [controls, *_end(model, pieces[-1])]
        try:
            found = [_begin(receiver, pieces, paused), *_end(receiver, pieces[-1])]
        except Exception as error:
            raise Wrong(f"CPython: {type(error).__name__}: {error}", case) from error
        if found != wanted:
            different = _differences(found, wanted)
            raise Wrong(f"CPython: the receiver is not as the model: {different}", case)
        total += sum(map(len, pieces))
        accounted = model.frame_bytes + model.skipped_bytes + len(model.pending)
        equal(accounted, total, "bytes accounted for", case)
        if _has_decoded(model, pieces[-1]):
            intact += 1
        else:
            expect(not paused, "CPython: the intact frame behind was not decoded", case)
            # Bytes before it looked like a frame that reaches into it, and its CRC was right.
            expect(model.frame_bytes > framed, "the intact frame is part of no frame", case)
        lines.append(" ".join(wanted))
    return Judged(lines, total, intact)


def on_unix(
    all_blocks: Iterable[Sequence[bytes]],
    expected: Sequence[str],
    limit_s: float,
    paused: bool = True,
) -> None:
    """The same on the unix port, with the heap locked while it decodes."""
    with tempfile.NamedTemporaryFile(suffix=".bin") as file:
        for pieces in all_blocks:
            for piece in pieces:
                file.write(len(piece).to_bytes(2, "little") + piece)
            file.write(bytes(2))
        file.flush()
        program = _PROGRAM.format(
            told=inspect.getsource(told), names=NAMES, paused=paused, path=file.name
        )
        try:
            done = subprocess.run(
                [micropython_image.unix_micropython(), "-c", program],
                env={"MICROPYPATH": f"{boards.checkout() / 'lib'}:.frozen"},
                capture_output=True,
                text=True,
                timeout=limit_s,
            )
            said, error = done.stdout, done.stderr.strip()
            if done.returncode and not error:
                error = f"the program ended with {done.returncode}"
        except subprocess.TimeoutExpired as expired:
            said = (expired.stdout or b"").decode()
            error = f"no answer within {limit_s:.0f} s"
    found = said.splitlines()
    # A program that was ended by an exception has printed less.
    pairs = zip(found, expected, strict=False)
    right = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))
    if right < len(expected):
        words = found[right].split() if right < len(found) else []
        reason = " ".join([*found[right:], error])[-1000:]
        if not error:
            reason = _differences(words, expected[right].split())
        at = next(islice(all_blocks, right, None))
        raise Wrong(f"unix port: {reason}", bytes_case(at, paused))


def bytes_case(pieces: Sequence[bytes], paused: bool) -> dict[str, Any]:
    """A block as a case that can be saved."""
    return {"kind": "bytes", "pieces": [piece.hex() for piece in pieces], "paused": paused}


def replay(case: dict[str, Any]) -> None:
    """Run a saved case on both; raises Wrong."""
    paused = case.get("paused", True)
    blocks = [[bytes.fromhex(piece) for piece in one["pieces"]] for one in again.blocks_of(case)]
    on_unix(blocks, on_cpython(blocks, paused).lines, 60, paused)


class _Blocks:
    """The same blocks each time that they are gone through, and none kept in memory."""

    def __init__(self, seed: int, total: int) -> None:
        self._arguments = (seed, total)

    def __iter__(self) -> Iterator[list[bytes]]:
        return streams.blocks(*self._arguments)


def fuzz(seed: int, total: int, paused: bool) -> list[Row]:
    """`total` bytes through both interpreters."""
    made = _Blocks(seed, total)

    def case_of(pieces: list[bytes]) -> tuple[dict[str, Any], int]:
        return bytes_case(pieces, paused), sum(map(len, pieces))

    with again.among(made, case_of, "library_bytes"):
        judged = on_cpython(made, paused)
        on_unix(made, judged.lines, 60 + total / 5_000, paused)
    pause = "never a pause, the intact frame behind each block follows at once"
    if paused:
        pause = "`discard_partial` before the intact frame behind each block"
    happened = (
        "every counter, pulse, link value, video setting and MSP payload as an independent model "
        "has it after each block, every byte part of a frame, counted as skipped or waiting for "
        f"its rest; {_intact(judged)}; {_frames(judged)} control frames in all; no exception"
    )
    kinds = ", ".join(streams.KINDS)
    name = "bytes" if paused else "bytes without a pause"
    return [
        Row(f"{name}, CPython", f"{judged.total:,} bytes: {kinds}; {pause}", happened),
        Row(f"{name}, unix port", "the same bytes, heap locked", f"the same; {NO_HEAP}"),
    ]


def _intact(judged: Judged) -> str:
    lost = len(judged.lines) - judged.intact
    if not lost:
        return f"each of {judged.intact} intact frames decoded"
    return (
        f"{judged.intact} intact frames decoded; before each of {lost} others were bytes that the "
        "model, too, has for the beginning of a frame which ends in it with the right CRC"
    )


def _frames(judged: Judged) -> str:
    return dict(word.split("=") for word in judged.lines[-1].split()[2:])["frames"]


NO_HEAP = "no byte of the heap taken (MicroPython's heap was locked)"
