"""Our telemetry slot with somebody else in it, or with nothing to be heard."""

from __future__ import annotations

import random
from bisect import bisect_right

from ghst import decoder  # type: ignore[import-not-found]
from ghst_tools.campaign.model import Model
from ghst_tools.campaign.outputs import Outputs, moving_link
from ghst_tools.campaign.pico import Pico
from ghst_tools.campaign.picos import no_exception
from ghst_tools.campaign.verdict import equal, expect
from ghst_tools.emulator.wire import BAUD

_BIT_NS = 1e9 / BAUD
_FRAME_NS = 140 * _BIT_NS
_SLOT_NS = 1e6
_SLOT_ERROR_NS = 10e3
# From the pin being driven to the start bit: three cycles of the state machine, 16 to a bit.
_START_NS = 3 / 16 * _BIT_NS
_IO_BANK0 = 0x40014000
_INPUT_HIGH = 3 << 16  # INOVER: what the chip reads is high
_MIDDLE = (0.25, 0.5, 0.75)
_ALL_OF_IT = tuple(part / 16 for part in range(2, 15))


def _anything(rng: random.Random) -> bytes:
    """1 to 14 bytes in which there is no valid frame, though there may be the start of one."""
    while True:
        kind = rng.randrange(4)
        data = rng.randbytes(rng.randrange(1, 15))
        if kind == 0:
            data = b"\x89\x0c" + rng.randbytes(12)
        elif kind == 1:
            data = b"\x82\x0c" + rng.choice((b"\x10", b"\x30", b"\x13")) + rng.randbytes(11)
        elif kind == 2:
            at = rng.randrange(len(data))
            data = data[:at] + b"\x82\x0c" + data[at + 2 :]
            data = data[:14]
        if not Model().feed(data):
            return data


def _slot_frame(pico: Pico) -> bytes:
    """What the board is to send next, as it will be heard."""
    address = pico.control("SLOT_FRAME")
    first = address & ~3
    words = b"".join(pico.board.read32(first + 4 * n).to_bytes(4, "little") for n in range(5))
    return words[address - first :][:14]


def _differs(pico: Pico, frame: bytes, begin_ns: float) -> bool | None:
    """Whether a bit on the wire is not that of `frame`, which was sent from `begin_ns` on.

    None: only near the end of one, or in a stop bit, where the receiver need not look.
    """
    times = [edge.t_ns for edge in pico.wire.edges]
    bits = [bool((byte | 0x100) << 1 >> n & 1) for byte in frame for n in range(10)]

    def level(bit: float) -> bool:
        at = bisect_right(times, begin_ns + bit * _BIT_NS)
        return not at or pico.wire.edges[at - 1].level

    looked_at = [(n, bit) for n, bit in enumerate(bits) if n % 10 != 9]
    if any(all(level(n + part) is not bit for part in _MIDDLE) for n, bit in looked_at):
        return True
    if any(level(n + part) is not bit for n, bit in enumerate(bits) for part in _ALL_OF_IT):
        return None
    return False


def second_talker(pico: Pico, count: int, seed: int) -> str:
    """Somebody else talks in our slot, at any time and with anything.

    Whether a frame is sent follows from when, whether that is a collision from the wire's levels.
    """
    rng = random.Random(seed)
    outputs = Outputs(pico)
    sent = collisions = lost = doubtful = 0
    for index in range(count):
        first, second = moving_link(2 * index), moving_link(2 * index + 1)
        end = pico.wire.send(first, pico.at(1e6))
        outputs.frame(end, first)
        data = _anything(rng)
        talk = end + rng.uniform(900e3, 1400e3)
        pico.wire.send(data, talk)
        outputs.frame(pico.wire.send(second, end + 2e6), second)
        place = f"{data.hex()} {(talk - end) / 1e3:.1f} us behind a frame"
        pico.board.run_for(end + 800e3 - pico.board.now_ns)
        frame = _slot_frame(pico)
        before, driven = pico.control("COLLISIONS"), len(pico.driven)
        pico.board.run_for(end + 1.98e6 - pico.board.now_ns)
        counted = pico.control("COLLISIONS") - before
        begun = [t_ns for t_ns, driving in pico.driven[driven:] if driving]
        if abs(talk - end - _SLOT_NS) > _SLOT_ERROR_NS:
            equal(len(begun), int(talk > end + _SLOT_NS), f"{place}: telemetry frames sent")
        if begun:
            expect(abs(begun[0] - end - _SLOT_NS) < _SLOT_ERROR_NS, f"{place}: sent at {begun}")
            differs = _differs(pico, frame, begun[0] + _START_NS)
            if differs is not None:
                equal(counted, int(differs), f"{place}: collisions")
            doubtful += differs is None
            collisions += counted
            sent += 1
        else:
            equal(counted, 0, f"{place}: collisions without a frame of ours")
            lost += 1
        pico.board.run_for(end + 2e6 + _FRAME_NS + 100e3 - pico.board.now_ns)
        equal(pico.word(decoder.FRAMES), 2 * index + 2, f"{place}: frames decoded")
        before = pico.control("COLLISIONS")
        pico.board.run_for(3e6)
        equal(pico.control("COLLISIONS"), before, f"{place}: collisions in the next slot")
        outputs.check(place)
        pico.wire.edges.clear()
    equal(pico.control("TELEMETRY_FRAMES"), sent + count, "telemetry frames sent")
    equal(pico.control("COLLISIONS"), collisions, "collisions")
    expect(0 < collisions <= sent, f"{sent} frames sent, {collisions} collisions")
    outputs.finish()
    no_exception(pico)
    return (
        f"all {2 * count} frames of the receiver decoded, nothing taken for one, "
        f"{outputs.shown()}; {lost} slots "
        f"left to who had begun before, {sent} telemetry frames sent, {collisions} of them "
        "counted as collisions: just those of which a bit was another one on the wire "
        f"({doubtful} times it was only the edge of a bit or a stop bit, where either is right); "
        f"all {count} frames in the next slot sent without one"
    )


def echo_missing(pico: Pico, count: int) -> str:
    """A telemetry frame is sent and not heard: the pin's input is cut off from the wire meanwhile.

    Then the next frame comes.
    """
    control = _IO_BANK0 + 8 * pico.wire_pin + 4
    whole = pico.board.read32(control)
    outputs = Outputs(pico)
    for index in range(count):
        first, second = moving_link(2 * index), moving_link(2 * index + 1)
        end = pico.wire.send(first, pico.at(1e6))
        outputs.frame(end, first)
        outputs.frame(pico.wire.send(second, end + 1.7e6 + 0.3e6 * index / count), second)
        driven = len(pico.driven)
        pico.board.run_for(end + _SLOT_NS - 50e3 - pico.board.now_ns)
        pico.board.write32(control, whole | _INPUT_HIGH)
        pico.board.run_for(_FRAME_NS + 100e3)
        pico.board.write32(control, whole)
        times = [t_ns for t_ns, _ in pico.driven[driven:]]
        equal(len(times), 2, "changes between driving the wire and not")
        long_ns = times[1] - times[0]
        expect(abs(long_ns - _FRAME_NS) < 2 * _BIT_NS, f"the wire driven for {long_ns / 1e3} us")
        pico.board.run_for(end + 5e6 - pico.board.now_ns)
        equal(pico.word(decoder.FRAMES), 2 * index + 2, "frames decoded")
        equal(pico.control("COLLISIONS"), index + 1, "collisions")
        # That it was sent is noticed at the next frame: too late for a new one behind that.
        equal(len(pico.driven), driven + 2, "changes between driving the wire and not")
        equal(pico.control("TELEMETRY_FRAMES"), index + 1, "telemetry frames sent")
    outputs.finish()
    no_exception(pico)
    return (
        f"{count} frames sent and counted as collisions, all {2 * count} frames of the receiver "
        f"decoded, {outputs.shown()}; the slot behind the next frame stays empty, the one after "
        "it is used again"
    )
