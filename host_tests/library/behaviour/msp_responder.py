"""Requests answered by handlers, one reply at a time."""

from behaviour.msp_support import (
    ERROR,
    START,
    V1,
    V2,
    answer_to,
    chunks_of,
    feed_all,
    payloads,
    v1,
    v2,
)
from behaviour.support import equal, sample
from ghst.msp import Responder


def _data(size):
    return bytes(at * 7 + 1 & 255 for at in range(size))


def _echoing(numbers=(9,)):
    responder = Responder()
    for number in numbers:
        responder.command(number, lambda request, reply: reply.text(_data(request.u16(0))))
    return responder


def _size(size):
    return bytes((size & 255, size >> 8))


def unknown_commands_are_answered_with_an_error():
    responder = _echoing()
    for number in sample(tuple(range(9)) + tuple(range(10, 256)), 2):
        assert responder.feed(payloads(v1(number, b"\x01\x02"))[0])
        (chunk,) = chunks_of(responder)
        equal((chunk[0] & 0xF0, chunk[1:]), (V1 | START | ERROR, bytes((0, number, 0, 0, 0))))
    before = responder.errors
    responder.feed(payloads(v2(0x3009), V2)[0])
    chunks = chunks_of(responder)
    equal(chunks[0][0] & 0xF0, V2 | START | ERROR)
    equal([chunk[1:] for chunk in chunks], [b"\0\x09\x30\0\0", bytes(5)])
    equal((responder.errors, responder.answered), (before + 1, 0))


def messages_too_long_are_answered_with_an_error():
    responder = _echoing()
    assert responder.feed(b"\x30\xff\x09\xff\xff" + bytes(5))
    equal(chunks_of(responder), [b"\xb0\0\x09\0\0\0"])
    equal((responder.errors, responder.request.oversized), (1, 1))


def commands_of_an_application():
    def add(request, reply):
        reply.u16(request.u16(0) + request.u16(2))

    responder = Responder()
    responder.command(0x3000, add)
    responder.command(200, add)
    equal(answer_to(responder, v2(0x3000, b"\x01\x02\x03\x04"), V2), b"\x04\x06")
    equal(answer_to(responder, v1(200, b"\xff\xff\x01\x00")), b"\xff\xff")
    equal((responder.answered, responder.errors), (2, 0))
    responder.command(200, None)
    responder.feed(payloads(v1(200))[0])
    equal(chunks_of(responder)[0][0] & ERROR, ERROR)
    for number in (-1, 65536):
        try:
            responder.command(number, add)
        except ValueError as error:
            equal(str(error), f"MSP command is {number}, must be 0..65535")
        else:
            raise AssertionError(f"{number} was taken")


def handlers_that_fail_or_raise_are_answered_with_an_error():
    def refuses(request, reply):
        reply.u8(1)
        return False

    def raises(request, reply):
        reply.u8(1)
        raise KeyError(request.command)

    def divides(request, reply):
        return 1 // request.size

    responder = Responder()
    responder.command(1, refuses)
    responder.command(2, raises)
    responder.command(3, divides)
    equal(feed_all(responder, payloads(v1(1))), [True])
    equal(chunks_of(responder), [b"\xb0\0\x01\0\0\0"])
    equal((responder.errors, responder.last_error), (1, None))
    equal(feed_all(responder, payloads(v1(2))), [True])
    equal(chunks_of(responder), [b"\xb1\0\x02\0\0\0"])
    equal((responder.errors, responder.answered), (2, 0))
    equal(responder.last_error.args, (2,))
    equal(feed_all(responder, payloads(v1(3))), [True])
    equal(chunks_of(responder), [b"\xb2\0\x03\0\0\0"])
    equal((responder.errors, type(responder.last_error)), (3, ZeroDivisionError))


def v2_requests_may_ask_for_no_reply():
    asked = []
    responder = Responder()
    responder.command(9, lambda request, reply: asked.append(request.command))
    equal(feed_all(responder, payloads(v2(9, b"", 1), V2)), [False])
    equal((asked, chunks_of(responder), responder.answered), ([9], [], 1))
    # The next reply is a whole one.
    equal(feed_all(responder, payloads(v2(9, b"", 0xFE), V2)), [True])
    equal(chunks_of(responder)[0], b"\x50\0\x09\0\0\0")


def another_request_takes_the_place_of_the_reply_under_way():
    responder = _echoing((8, 9))
    chunk = bytearray(6)
    feed_all(responder, payloads(v1(9, _size(20))))
    assert responder.next_chunk(chunk) and responder.next_chunk(chunk)
    equal(chunk[0], V1 | 1)
    feed_all(responder, payloads(v1(8, _size(1))))
    equal(chunks_of(responder), [b"\x32\x01\x08\x01\0\0"])
    equal((responder.replaced, responder.repeated, responder.answered), (1, 0, 2))
    # The same command with other data, or in the other version, is another request.
    feed_all(responder, payloads(v1(9, _size(20))))
    feed_all(responder, payloads(v1(9, _size(2))))
    feed_all(responder, payloads(v2(9, _size(2)), V2))
    equal(responder.replaced, 3)
    equal(chunks_of(responder), [b"\x53\0\x09\0\x02\0", b"\x44\x01\x08\0\0\0"])


def a_question_repeated_meanwhile_is_answered_by_the_reply_under_way():
    answers = []

    def long(request, reply):
        answers.append(request.command)
        reply.text(_data(20))

    responder = Responder()
    responder.command(9, long)
    question = payloads(v1(9))[0]
    chunk = bytearray(6)
    data = b""
    # As often as chunks go out: were the reply begun anew each time, it would never end.
    for _ in range(5):
        equal(responder.feed(question), True)
        assert responder.next_chunk(chunk)
        data += chunk[1:]
    equal(data, b"\x14\x09" + _data(20) + bytes(3))
    equal((answers, responder.repeated, responder.replaced), ([9], 4, 0))
    equal(responder.next_chunk(chunk), False)


def a_reply_may_be_dropped():
    responder = _echoing()
    feed_all(responder, payloads(v1(9, _size(20))))
    responder.next_chunk(bytearray(6))
    responder.discard()
    equal(chunks_of(responder), [])
    feed_all(responder, payloads(v1(9, _size(1))))
    equal(chunks_of(responder), [b"\x31\x01\x09\x01\0\0"])
    equal(responder.replaced, 0)


def an_unfinished_request_does_not_touch_the_reply_under_way():
    responder = _echoing()
    feed_all(responder, payloads(v1(9, _size(20))))
    equal(responder.feed(payloads(v1(8, _data(30)))[0]), True)
    equal(len(chunks_of(responder)), 5)
    equal(responder.replaced, 0)


def the_same_question_in_the_other_version_is_another_one():
    responder = Responder()
    responder.command(9, lambda request, reply: reply.text(_data(20)))
    responder.feed(payloads(v1(9))[0])
    responder.feed(payloads(v2(9), V2)[0])
    equal((responder.replaced, responder.repeated), (1, 0))
    equal(chunks_of(responder)[0], b"\x50\0\x09\0\x14\0")
