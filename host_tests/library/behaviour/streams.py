"""Bytes in chunks, noise, cut-off frames: the next intact frame is never lost."""

from array import array

from behaviour.support import (
    AT_CENTRE,
    CENTRE,
    CENTRED_RAW,
    FRESH,
    SWUNG,
    SWUNG_RAW,
    control,
    equal,
    expect,
    frame,
    received,
    sample,
    unfinished,
)
from ghst import Receiver

_CENTRED = control(0x1F, CENTRED_RAW)
_SWUNG = control(0x1F, SWUNG_RAW)
_LEGACY = control(0x10, (384, 1984, 3584, 1984), (24, 124, 224, 124))
_BAD_LENGTHS = (0, 1, 13, 14, 127, 128, 255)


def _mixture():
    cut = _SWUNG[:9]
    flipped = bytearray(_LEGACY)
    flipped[5] ^= 0x10
    foreign = frame(0x23, b"\x82\x0c\x10\x82\x0c\x30\x82\x0c\x33\x82", 0x89)
    return (
        b"\x00\xff\x82\x0c" + _LEGACY + cut + _CENTRED + foreign + b"\x82\x82\x82" + _SWUNG
        + bytes(flipped) + frame(0x21) + b"\x82\xff\x80\x02\x13" + frame(0x77) + _LEGACY
        + frame(0x20, b"\x01\xa8\x16\x19\x00\x48\x00\x00\x00\x00", 0x80)
        + control(0x33, (1, 2, 3, 4), (77, 88, 42, 6)) + control(0x14, (5, 6, 7, 8), (9, 8, 7, 6))
    )  # fmt: skip


def _same(found, wanted, what):
    equal(list(found.pulses), list(wanted.pulses), what)
    for name in FRESH:
        equal(getattr(found, name), getattr(wanted, name), name)
    equal(unfinished(found), unfinished(wanted), what)


def chunks_of_any_size_give_the_same_result():
    data = _mixture()
    whole = Receiver()
    total = whole.feed(data)
    equal(total, 6)
    for size in sample(range(1, 40), 2):
        receiver = Receiver()
        count = 0
        for at in range(0, len(data), size):
            count += receiver.feed(data[at : at + size])
        equal(count, total, size)
        _same(receiver, whole, size)


def a_cut_anywhere_gives_the_same_result():
    data = _mixture()
    whole = Receiver()
    whole.feed(data)
    for cut in sample(range(len(data) + 1), 3):
        receiver = Receiver()
        equal(receiver.feed(data[:cut]) + receiver.feed(data[cut:]), 6, cut)
        _same(receiver, whole, cut)


def chunks_larger_than_the_ring():
    data = _CENTRED * 40
    expect(received(data, 40), AT_CENTRE, frames=40)


def a_frame_at_every_place_in_the_ring():
    receiver = Receiver()
    end = 0
    noise = 0
    # On the chip only those places where a frame wraps, or just does not.
    for places in sample((range(256), range(242, 256)), 1):
        for place in places:
            data, pulse = (_SWUNG, SWUNG[0]) if place & 1 else (_CENTRED, CENTRE)
            gap = (place - end) & 255
            equal(receiver.feed(bytes(gap) + data), 1, place)
            equal(receiver.pulses[0], pulse, place)
            noise += gap
            end = place + 14
    equal(receiver.skipped_bytes, noise)


def the_length_argument_limits_what_is_taken():
    buffer = bytearray(_CENTRED + _SWUNG)
    receiver = Receiver()
    equal(receiver.feed(buffer, 14), 1)
    expect(receiver, AT_CENTRE, frames=1)
    equal(receiver.feed(buffer, 0), 0)
    equal(receiver.feed(buffer, -5), 0)
    expect(receiver, AT_CENTRE, frames=1)
    equal(receiver.feed(buffer, 1000), 2)
    equal(receiver.frames, 3)


def any_bytes_like_object_is_taken():
    for data in (_CENTRED, bytearray(_CENTRED), memoryview(_CENTRED)):
        expect(received(data), AT_CENTRE, frames=1)
    part = memoryview(b"\x82\x0c\x10" + _CENTRED + b"\x82")[3:17]
    expect(received(part), AT_CENTRE, frames=1)


def a_frame_counts_when_its_last_byte_comes():
    receiver = Receiver()
    for byte in _CENTRED[:-1]:
        equal(receiver.feed(bytes((byte,))), 0)
    expect(receiver)
    equal(receiver.feed(_CENTRED[-1:]), 1)
    expect(receiver, AT_CENTRE, frames=1)


def false_starts_directly_before_an_intact_frame():
    # Every address, every length byte that could begin a frame, and up to the whole of a cut-off
    # frame between; the false start reaches into the intact frame, which must not go with it.
    for address in sample(range(0x80, 0x8A), 2):
        for length in sample(range(2, 13), 2):
            for between in sample((0, 1, 5, 11), 2):
                if between >= length:
                    continue
                start = bytes((address, length)) + b"\x55" * between
                receiver = Receiver()
                equal(receiver.feed(start + _CENTRED), 1, start)
                equal(receiver.crc_errors, 1, start)
                expect(receiver, AT_CENTRE, frames=1, crc_errors=1, skipped_bytes=len(start))


def a_single_address_byte_before_an_intact_frame():
    for address in sample(range(0x80, 0x8A), 2):
        receiver = received(bytes((address,)) + _CENTRED)
        expect(receiver, AT_CENTRE, frames=1, length_errors=1, skipped_bytes=1)


def a_frame_cut_off_anywhere():
    for cut in sample(range(1, 14), 2):
        receiver = received(_SWUNG[:cut] + _CENTRED)
        errors = {"length_errors": 1} if cut == 1 else {"crc_errors": 1}
        expect(receiver, AT_CENTRE, frames=1, skipped_bytes=cut, **errors)


def a_frame_that_lost_one_byte():
    for lost in sample(range(1, 14), 2):
        data = _SWUNG[:lost] + _SWUNG[lost + 1 :]
        receiver = received(data + _CENTRED)
        expect(
            receiver,
            AT_CENTRE,
            frames=1,
            skipped_bytes=13,
            crc_errors=receiver.crc_errors,
            length_errors=receiver.length_errors,
        )
        assert receiver.crc_errors + receiver.length_errors > 0, lost


def a_wrong_length_byte():
    for length in sample(_BAD_LENGTHS, 1):
        broken = bytearray(_SWUNG)
        broken[1] = length
        receiver = received(bytes(broken) + _CENTRED)
        # 128 is itself an address, and 0x1f behind it no length either.
        errors = 2 if length == 128 else 1
        expect(receiver, AT_CENTRE, frames=1, length_errors=errors, skipped_bytes=14)
    for length in sample(range(2, 12), 2):
        broken = bytearray(_SWUNG)
        broken[1] = length
        receiver = received(bytes(broken) + _CENTRED)
        expect(receiver, AT_CENTRE, frames=1, crc_errors=1, skipped_bytes=14)


def noise_before_a_frame():
    for size in sample((1, 2, 13, 14, 100, 300), 2):
        noise = bytes(0x8A + at * 37 % 0x76 for at in range(size))
        expect(received(noise + _CENTRED), AT_CENTRE, frames=1, skipped_bytes=size)


def a_line_full_of_addresses_before_a_frame():
    receiver = received(b"\x82" * 500 + _CENTRED)
    expect(receiver, AT_CENTRE, frames=1, length_errors=500, skipped_bytes=500)


def a_line_full_of_false_starts_before_a_frame():
    receiver = received(b"\x82\x0c" * 250 + _CENTRED)
    expect(receiver, AT_CENTRE, frames=1, crc_errors=250, skipped_bytes=500)


def frames_inside_a_valid_frame_are_its_payload():
    inner = frame(0x10, b"", 0x82)
    receiver = received(frame(0x23, inner + inner + b"\0\0", 0x89), 0)
    expect(receiver, foreign_frames=1)


def discarding_an_unfinished_frame():
    receiver = Receiver()
    equal(receiver.feed(_SWUNG[:9]), 0)
    receiver.discard_partial()
    expect(receiver, skipped_bytes=9)
    equal(receiver.feed(_SWUNG[9:] + _CENTRED), 1)
    expect(receiver, AT_CENTRE, frames=1, skipped_bytes=14)
    receiver.discard_partial()
    expect(receiver, AT_CENTRE, frames=1, skipped_bytes=14)


def discarding_across_the_end_of_the_ring():
    receiver = Receiver()
    receiver.feed(bytes(250))  # one byte waits
    receiver.feed(_SWUNG[:13])
    receiver.discard_partial()
    expect(receiver, skipped_bytes=263)
    equal(receiver.feed(_CENTRED), 1)


# Bit 5 of the type and bit 0 of the CRC: 93 bits apart, the period of the CRC's polynomial, so no
# check can see it. It turns a legacy type into its 12-bit twin and back. The two pairs beside it,
# equally invisible, make types that carry no channels.
_BEYOND_THE_CRC = (8 * 2 + 5, 8 * 13)


def flipped_bits_never_reach_a_channel():
    link_data = control(0x33, CENTRED_RAW, (37, 101, 40, 20))
    receiver = Receiver()
    none = array("H", [0] * 16)
    for good in sample((_LEGACY, _SWUNG, link_data), 1):
        for first in sample(range(112), 3):
            for second in sample(range(first, 112), 2):
                broken = bytearray(good)
                broken[first >> 3] ^= 1 << (first & 7)
                if second != first:
                    broken[second >> 3] ^= 1 << (second & 7)
                receiver.discard_partial()
                receiver.pulses[:] = none
                if (first, second) == _BEYOND_THE_CRC:
                    equal(receiver.feed(broken), 1)
                    continue
                equal(receiver.feed(broken), 0, (first, second))
                equal(list(receiver.pulses), [0] * 16, (first, second))
                # Whatever it became, the next intact frame is decoded, and only that one.
                equal(receiver.feed(_CENTRED), 1, (first, second))
                equal(list(receiver.pulses[:5]), [CENTRE] * 4 + [0], (first, second))
