"""Requests put together from payloads: what is taken, and what is dropped and counted."""

from behaviour.msp_support import START, V1, V2, feed_all, jumbo, payloads, v1, v2
from behaviour.support import equal, sample
from ghst.msp import COMPLETE, OVERSIZED, REQUEST_SIZE, UNFINISHED, Request

_COUNTERS = ("sequence_errors", "restarts", "oversized", "orphans", "malformed")


def _data(size):
    return bytes(at * 7 + 1 & 255 for at in range(size))


def _expect(request, version=None, command=None, data=None, flags=0, **counters):
    if version is not None:
        equal((request.version, request.command, request.flags), (version, command, flags))
        equal(bytes(request.data[: request.size]), data, "data")
    for name in _COUNTERS:
        equal(getattr(request, name), counters.get(name, 0), name)
        counters.pop(name, None)
    equal(counters, {}, "misspelt counters")


def _completes(chunks):
    """A new request to which the last of `chunks`, and only that, was the end of a message."""
    request = Request()
    equal(feed_all(request, chunks), [UNFINISHED] * (len(chunks) - 1) + [COMPLETE])
    return request


def the_sample_frames():
    # 820c213000010100000000000078 and 820c223104591f010100420000c8, without what is around them.
    request = _completes([bytes.fromhex("30000101000000000000")])
    _expect(request, 1, 1, b"")
    request = _completes([bytes.fromhex("3104591f010100420000")])
    _expect(request, 1, 89, b"\x1f\x01\x01\x00")


def every_size_of_a_v1_request():
    for size in sample(range(0, 255), 3):
        request = _completes(payloads(v1(200, _data(size)), V1, size))
        _expect(request, 1, 200, _data(size))


def every_size_of_a_v2_request():
    for size in sample(range(0, REQUEST_SIZE + 1), 2):
        request = _completes(payloads(v2(0x1F05, _data(size), 0xA5), V2, size))
        _expect(request, 2, 0x1F05, _data(size), 0xA5)


def every_size_of_a_jumbo_request():
    # Small ones too: nobody has to send them, and nothing forbids it.
    for size in sample(range(0, REQUEST_SIZE + 1), 2):
        request = _completes(payloads(jumbo(200, _data(size))))
        _expect(request, 1, 200, _data(size))


def version_0_is_read_as_2():
    _expect(_completes(payloads(v2(0x1234, b"\x55"), 0)), 2, 0x1234, b"\x55")


def the_error_bit_of_a_request_means_nothing():
    _expect(_completes(payloads(v1(1), V1 | 0x80)), 1, 1, b"")


def the_sequence_may_begin_anywhere_and_wraps():
    for sequence in sample(range(16), 2):
        request = _completes(payloads(v1(9, _data(200)), V1, sequence))
        _expect(request, 1, 9, _data(200))


def what_follows_the_announced_size_is_ignored():
    # The radio's Lua appends an xor of the message.
    for size in sample(range(0, 30), 3):
        request = _completes(payloads(v1(9, _data(size)), V1, 0, b"\xee"))
        _expect(request, 1, 9, _data(size))


def the_xor_behind_a_full_chunk_has_a_chunk_of_its_own():
    chunks = payloads(v1(9, _data(7)) + b"\xee")
    request = Request()
    equal(feed_all(request, chunks), [COMPLETE, UNFINISHED])
    _expect(request, 1, 9, _data(7))
    # Only one such chunk, only with the next number, and only behind a full one.
    equal(request.feed(b"\x22" + bytes(9)), UNFINISHED)
    _expect(request, orphans=1)
    equal(feed_all(request, (chunks[0], b"\x22" + bytes(9))), [COMPLETE, UNFINISHED])
    _expect(request, orphans=2)
    equal(request.feed(payloads(v1(9, _data(6)))[0]), COMPLETE)
    equal(request.feed(b"\x21" + bytes(9)), UNFINISHED)
    _expect(request, orphans=3)
    equal(feed_all(request, (chunks[0], chunks[0], chunks[1])), [COMPLETE, COMPLETE, UNFINISHED])
    _expect(request, 1, 9, _data(7), orphans=3)


def any_gap_drops_the_message():
    chunks = payloads(v1(9, _data(25)))
    equal(len(chunks), 3)
    for wrong in sample((0, 2, 3, 9, 15), 2):
        request = Request()
        request.feed(chunks[0])
        equal(request.feed(bytes((V1 | wrong,)) + chunks[1][1:]), UNFINISHED)
        _expect(request, sequence_errors=1)
        # What is left of it begins nothing.
        equal(feed_all(request, chunks[1:]), [UNFINISHED] * 2)
        _expect(request, sequence_errors=1, orphans=2)
        equal(feed_all(request, chunks)[-1], COMPLETE)
        _expect(request, 1, 9, _data(25), sequence_errors=1, orphans=2)


def a_repeated_chunk_drops_the_message():
    chunks = payloads(v1(9, _data(25)))
    request = Request()
    results = feed_all(request, (chunks[0], chunks[1], chunks[1], chunks[2]))
    equal(results, [UNFINISHED] * 4)
    _expect(request, sequence_errors=1, orphans=1)


def a_new_start_drops_the_unfinished_message():
    chunks = payloads(v1(9, _data(25)))
    request = Request()
    results = feed_all(request, chunks[:2] + payloads(v2(0x77, b"\x01"), V2))
    equal(results, [UNFINISHED, UNFINISHED, COMPLETE])
    _expect(request, 2, 0x77, b"\x01", restarts=1)
    results = feed_all(request, chunks[:1] * 3 + chunks[1:])
    equal(results, [UNFINISHED] * 4 + [COMPLETE])
    _expect(request, 1, 9, _data(25), restarts=3)


def chunks_without_a_start_are_orphans():
    request = Request()
    for sequence in range(16):
        equal(request.feed(bytes((V1 | sequence,)) + b"\x01" * 9), UNFINISHED)
    _expect(request, orphans=16)


def a_message_larger_than_the_buffer_is_refused_at_once():
    for size in (REQUEST_SIZE + 1, 0x7FFF, 0xFFFF):
        for version, header in (
            (V1, bytes((255, 9, size & 255, size >> 8))),
            (V2, bytes((0, 9, 0, size & 255, size >> 8))),
        ):
            request = Request()
            buffer = bytes(request.data)
            equal(request.feed(payloads(header, version, 0, b"\xee")[0]), OVERSIZED)
            equal((request.version, request.command), (1 if version == V1 else 2, 9))
            equal(request.feed(bytes((version | 1,)) + b"\xee" * 9), UNFINISHED)
            _expect(request, oversized=1, orphans=1)
            equal(request.data, buffer, "the buffer")


def a_smaller_buffer_has_its_own_limit():
    request = Request(8)
    equal(feed_all(request, payloads(v1(9, _data(8)))), [UNFINISHED, COMPLETE])
    equal(bytes(request.data), _data(8))
    equal(request.feed(payloads(v1(9, _data(9)))[0]), OVERSIZED)
    request = Request(0)
    equal(request.feed(payloads(v1(9))[0]), COMPLETE)
    equal(request.feed(payloads(v1(9, b"\x01"))[0]), OVERSIZED)


def version_3_is_malformed_and_ends_what_was_open():
    chunks = payloads(v1(9, _data(25)))
    for status in (0x60, 0x61, 0x71, 0xFF):
        request = Request()
        request.feed(chunks[0])
        equal(request.feed(bytes((status,)) + bytes(9)), UNFINISHED)
        equal(feed_all(request, chunks[1:]), [UNFINISHED] * 2)
        _expect(request, malformed=1, orphans=2)


def headers_that_are_cut_off_are_malformed():
    cut_off = (
        b"",
        bytes((V1 | START,)),
        bytes((V1 | START, 0)),
        bytes((V1 | START, 255, 9, 1)),
        bytes((V2 | START, 0, 9, 0, 1)),
    )
    request = Request()
    equal(feed_all(request, cut_off), [UNFINISHED] * 5)
    _expect(request, malformed=5)
    equal(request.feed(bytes((V1 | START, 0, 9))), COMPLETE)
    _expect(request, 1, 9, b"", malformed=5)


def a_payload_inside_a_frame():
    frame = bytes.fromhex("820c223104591f010100420000c8")
    request = Request()
    equal(request.feed(frame, 3), COMPLETE)
    _expect(request, 1, 89, b"\x1f\x01\x01\x00")
    # Ten bytes and no more, whatever is behind them.
    request = Request()
    equal(request.feed(b"\xaa" + payloads(v1(9, _data(8)))[0] + b"\xbb" * 20, 1), UNFINISHED)
    equal(request.feed(bytes((V1 | 1, _data(8)[7]))), COMPLETE)
    _expect(request, 1, 9, _data(8))
    equal(request.feed(b"\x30\x00\x01", 3), UNFINISHED)
    _expect(request, malformed=1)


def numbers_beyond_the_end_are_0():
    request = _completes(payloads(v1(9, b"\x01\x02\x03")))
    request.data[3] = 0x99
    equal([request.u8(at) for at in range(4)], [1, 2, 3, 0])
    equal([request.u16(at) for at in range(4)], [0x201, 0x302, 3, 0])
    equal(request.u8(REQUEST_SIZE), 0)


def counters_go_on_at_0():
    request = Request()
    request.orphans = 0x3FFFFFFF
    request.feed(bytes((V1,)) + bytes(9))
    _expect(request)
