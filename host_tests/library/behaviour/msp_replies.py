"""Replies cut into chunks, and one reply at a time."""

from behaviour.msp_support import (
    ERROR,
    START,
    V1,
    V2,
    answer_to,
    chunks_of,
    feed_all,
    jumbo,
    payloads,
    v1,
    v2,
)
from behaviour.support import equal, sample
from ghst.msp import Responder
from ghst.msp_reply import REPLY_SIZE, Reply


def _data(size):
    return bytes(at * 7 + 1 & 255 for at in range(size))


def _reply(data, version=1, command=9, capacity=REPLY_SIZE):
    reply = Reply(capacity)
    reply.begin(version, command)
    reply.text(data)
    reply.send()
    return reply


def _echoing(numbers=(9,)):
    responder = Responder()
    for number in numbers:
        responder.command(number, lambda request, reply: reply.text(_data(request.u16(0))))
    return responder


def _size(size):
    return bytes((size & 255, size >> 8))


def the_sample_frame():
    # 890c283007010102030000000056, without what is around the chunk.
    chunk = bytearray(6)
    assert _reply(bytes(range(1, 8)), 1, 1).next_chunk(chunk)
    equal(bytes(chunk), b"\x30\x07\x01\x01\x02\x03")


def the_chunks_of_a_v1_reply():
    reply = _reply(_data(9), 1, 200)
    wanted = [
        b"\x30\x09\xc8\x01\x08\x0f",
        b"\x21\x16\x1d\x24\x2b\x32",
        b"\x22\x39\x00\x00\x00\x00",
    ]
    equal(chunks_of(reply), wanted)
    assert not reply.pending


def the_chunks_of_a_v2_reply():
    reply = _reply(_data(3), 2, 0x1F05)
    equal(chunks_of(reply), [b"\x50\x00\x05\x1f\x03\x00", b"\x41\x01\x08\x0f\x00\x00"])


def the_chunks_of_a_jumbo_reply():
    data = _data(255)
    chunks = chunks_of(_reply(data, 1, 200))
    equal(chunks[0], b"\x30\xff\xc8\xff\x00\x01")
    equal(b"".join(chunk[1:] for chunk in chunks[1:]), data[1:] + b"\0")
    # 254 bytes need no jumbo header.
    equal(chunks_of(_reply(data[:254], 1, 200))[0], b"\x30\xfe\xc8" + data[:3])


def an_empty_chunk_follows_a_reply_that_fills_its_last_one():
    equal(chunks_of(_reply(_data(3))), [b"\x30\x03\x09\x01\x08\x0f", b"\x21\0\0\0\0\0"])
    equal(len(chunks_of(_reply(_data(7)))), 2)
    chunks = chunks_of(_reply(_data(8)))
    equal(chunks[1:], [b"\x21" + _data(8)[3:], b"\x22\0\0\0\0\0"])
    # The header of v2 alone fills a chunk.
    equal(chunks_of(_reply(b"", 2)), [b"\x50\0\x09\0\0\0", b"\x41\0\0\0\0\0"])
    equal(chunks_of(_reply(b"")), [b"\x30\0\x09\0\0\0"])


def every_size_arrives():
    responder = _echoing()
    for size in sample(range(REPLY_SIZE + 1), 2):
        equal(answer_to(responder, v1(9, _size(size))), _data(size), size)
        equal(answer_to(responder, jumbo(9, _size(size))), _data(size), size)
        equal(answer_to(responder, v2(9, _size(size)), V2), _data(size), size)


def the_sequence_goes_on_from_reply_to_reply():
    reply = Reply()
    found = []
    for _ in range(9):
        reply.begin(1, 9)
        reply.text(_data(4))
        reply.send()
        found += [chunk[0] for chunk in chunks_of(reply)]
    equal([status & 15 for status in found], [at % 16 for at in range(18)])
    equal([status & 0xF0 for status in found], [0x30, 0x20] * 9)


def nothing_is_written_when_nothing_is_pending():
    chunk = bytearray(b"\x55" * 6)
    for target in (Reply(), Responder()):
        equal(target.next_chunk(chunk), False)
        equal(bytes(chunk), b"\x55" * 6)


def numbers_are_clamped_never_wrapped():
    reply = Reply()
    reply.begin(1, 9)
    for value in (None, -1, 0, 255, 256, 1 << 40):
        reply.u8(value)
    for value in (None, -1, 65535, 65536):
        reply.u16(value)
    for value in (None, -32769, -32768, -1, 32767, 32768):
        reply.s16(value)
    for value in (None, -1, 0xFFFFFFFF, 1 << 32):
        reply.u32(value)
    for value in (None, -0x80000001, -1, 1800000000, 0x80000000):
        reply.s32(value)
    wanted = (
        "000000ffffff" + "00000000ffffffff" + "000000800080ffffff7fff7f"
        + "0000000000000000ffffffffffffffff" + "0000000000000080ffffffff00d2496bffffff7f"
    )  # fmt: skip
    equal(bytes(reply.data[: reply.size]), bytes.fromhex(wanted))


def texts():
    reply = Reply()
    reply.begin(1, 9)
    reply.text(b"ab")
    reply.text("cd", 1)
    reply.text(b"e", 3)
    reply.text(b"f", 3, 0)
    reply.counted_text("gh")
    reply.counted_text(b"")
    equal(bytes(reply.data[: reply.size]), b"abce  f\0\0\x02gh\0")
    reply.begin(1, 9)
    reply.counted_text(b"x" * 300)
    equal(bytes(reply.data[: reply.size]), b"\xff" + b"x" * 255)


def a_payload_that_does_not_fit_becomes_an_error():
    reply = _reply(_data(8), 1, 9, 8)
    equal(chunks_of(reply)[0], b"\x30\x08\x09\x01\x08\x0f")
    for write in (
        lambda: reply.u8(1),
        lambda: reply.u16(1),
        lambda: reply.u32(1),
        lambda: reply.text(b"a"),
    ):
        reply.begin(1, 9)
        reply.text(_data(8))
        write()
        reply.send()
        chunks = chunks_of(reply)
        equal([chunk[1:] for chunk in chunks], [b"\0\x09\0\0\0"])
        equal(chunks[0][0] & 0xF0, V1 | START | ERROR)
        equal(len(reply.data), 8)


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

    responder = Responder()
    responder.command(1, refuses)
    responder.command(2, raises)
    equal(feed_all(responder, payloads(v1(1))), [True])
    equal(chunks_of(responder), [b"\xb0\0\x01\0\0\0"])
    equal((responder.errors, responder.last_error), (1, None))
    equal(feed_all(responder, payloads(v1(2))), [True])
    equal(chunks_of(responder), [b"\xb1\0\x02\0\0\0"])
    equal((responder.errors, responder.answered), (2, 0))
    equal(responder.last_error.args, (2,))


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
