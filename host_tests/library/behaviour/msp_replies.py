"""Replies: what handlers write, and how it is cut into chunks."""

from behaviour.msp_support import (
    ERROR,
    START,
    V1,
    V2,
    answer_to,
    chunks_of,
    jumbo,
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
