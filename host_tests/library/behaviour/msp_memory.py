"""Requests and answers allocate nothing: proved by locking MicroPython's heap around them."""

from array import array

import micropython

from behaviour.msp_support import V2, jumbo, payloads, v1, v2
from behaviour.support import equal
from ghst.msp import Responder
from ghst.msp_commands import answer
from ghst.msp_state import State

_NUMBERS = (1, 2, 3, 4, 5, 10, 88, 101, 105, 106, 107, 108, 109, 110, 130, 160, 250)


def _responder():
    state = State()
    state.craft_name = b"Kestrel"
    state.pulses = array("H", [6000] * 16)
    state.satellites = 17
    # Larger than a small integer of a 32-bit port, and smaller than the smallest.
    state.longitude_e7 = -1800000000
    state.latitude_e7 = 899999999
    state.voltage_mv = 16800
    state.current_ma = -29600
    state.consumed_mah = 70000
    state.heading_decideg = -905
    state.altitude_cm = -100000
    state.home_direction_decideg = 1805
    responder = Responder()
    answer(responder, state, None, lambda: True)
    return responder


def _answer_locked(responder, chunks, sent):
    """How many chunks the reply had; they are written into `sent`."""
    count = 0
    micropython.heap_lock()
    try:
        for chunk in chunks:
            responder.feed(chunk)
        while responder.next_chunk(sent):
            count += 1
    finally:
        micropython.heap_unlock()
    return count


def every_answer():
    responder = _responder()
    sent = bytearray(6)
    for number in _NUMBERS:
        assert _answer_locked(responder, payloads(v1(number)), sent) > 0, number
        assert _answer_locked(responder, payloads(v2(number), V2), sent) > 1, number
    equal(_answer_locked(responder, payloads(v1(89, b"\x1f\x00\x01\x00")), sent), 1)
    equal((responder.errors, responder.last_error), (0, None))
    equal(responder.answered, 2 * len(_NUMBERS) + 1)


def errors_and_long_messages():
    responder = _responder()
    sent = bytearray(6)
    equal(_answer_locked(responder, payloads(v1(77)), sent), 1)
    equal(_answer_locked(responder, payloads(jumbo(1, bytes(512))), sent), 2)
    equal(_answer_locked(responder, payloads(v2(77, bytes(512)), V2), sent), 2)
    equal(_answer_locked(responder, [b"\x30\xff\x01\xff\xff" + bytes(5)], sent), 1)
    equal((responder.errors, responder.answered), (3, 1))


def broken_sequences():
    responder = _responder()
    sent = bytearray(6)
    whole = payloads(v1(1, bytes(30)))
    chunks = [whole[0], whole[2], whole[3], whole[0], whole[0], bytes(10), b"\xff" * 10, b""]
    equal(_answer_locked(responder, chunks, sent), 0)
    request = responder.request
    equal((request.sequence_errors, request.restarts), (2, 1))
    # Ten zeros are version 2, sequence 0: a gap, since 1 was due.
    equal((request.orphans, request.malformed), (1, 2))


def counters_past_their_end():
    # A 32-bit port's small integers end at 2^30: a counter that is larger would be an object.
    responder = _responder()
    request = responder.request
    for name in ("sequence_errors", "restarts", "orphans", "oversized", "malformed"):
        setattr(request, name, 0x3FFFFFFF)
    for name in ("answered", "errors", "replaced", "repeated"):
        setattr(responder, name, 0x3FFFFFFF)
    whole = payloads(v1(1, bytes(30)))
    question = payloads(v1(4))[0]
    chunks = [whole[0], whole[2], whole[3], whole[0], whole[0], b"\xff" * 10, question, question]
    chunks += [b"\x30\xff\x01\xff\xff" + bytes(5)]
    equal(_answer_locked(responder, chunks, bytearray(6)), 1)
    equal((request.sequence_errors, request.restarts, request.orphans), (0, 0, 0))
    equal((request.oversized, request.malformed), (0, 0))
    equal((responder.answered, responder.errors), (0, 0))
    equal((responder.replaced, responder.repeated), (0, 0))
