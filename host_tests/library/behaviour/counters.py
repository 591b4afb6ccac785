"""Which counter a frame goes to, and that nothing else changes."""

from behaviour.support import (
    AT_CENTRE,
    CENTRED_RAW,
    FC,
    control,
    equal,
    expect,
    frame,
    received,
    sample,
)
from ghst import Receiver, decoder

_CONTROL = tuple(range(0x10, 0x20)) + tuple(range(0x30, 0x40))
_ADDRESSES = range(0x80, 0x8A)


def a_new_receiver_is_empty():
    expect(Receiver())
    expect(received(b"", 0))


def every_control_type_is_counted():
    receiver = Receiver()
    for count, kind in enumerate(sample(_CONTROL, 4), 1):
        equal(receiver.feed(control(kind, CENTRED_RAW)), 1, hex(kind))
        equal(receiver.frames, count)


def types_that_nobody_has_defined_are_counted_as_unknown():
    receiver = Receiver()
    count = 0
    for kind in sample(range(256), 11):
        if kind not in _CONTROL and kind not in (0x21, 0x22):
            equal(receiver.feed(frame(kind)), 0, hex(kind))
            count += 1
    expect(receiver, unknown_frames=count)


def frames_for_others_are_foreign_whatever_their_type():
    for address in sample(_ADDRESSES, 2):
        if address != FC:
            receiver = Receiver()
            for kind in (0x00, 0x10, 0x13, 0x14, 0x21, 0x22, 0x23, 0x30, 0x33, 0xFF):
                equal(receiver.feed(frame(kind, b"\x55" * 10, address)), 0)
            expect(receiver, foreign_frames=10)


def addresses_outside_the_protocol_start_no_frame():
    for address in sample((0x7F, 0x00, 0x02, 0x12, 0x92, 0xC2, 0xFF, 0x8A), 2):
        # The CRC byte stays: nothing that follows could show that it is not an address.
        data = frame(0x1F, bytes(10), address)
        expect(received(data, 0), skipped_bytes=13)


def msp_frames_are_counted_and_carry_no_channels():
    receiver = received(frame(0x21, b"\xff" * 10) + frame(0x22, b"\xff" * 10), 0)
    expect(receiver, msp_frames=2)


def msp_frames_of_a_wrong_length_are_unknown():
    for kind in (0x21, 0x22):
        for size in sample(range(10), 1):
            expect(received(frame(kind, bytes(size)), 0), unknown_frames=1)


def control_frames_of_a_wrong_length_change_no_channel():
    for kind in sample((0x10, 0x13, 0x14, 0x1F, 0x30, 0x33, 0x3F), 2):
        for size in sample(range(10), 2):
            expect(received(frame(kind, bytes(size)), 0), length_errors=1)


def every_length_of_a_foreign_frame_is_accepted():
    for size in sample(range(11), 2):
        expect(received(frame(0x28, bytes(size), 0x89), 0), foreign_frames=1)


def impossible_lengths_are_errors_at_every_address():
    for address in sample(_ADDRESSES, 2):
        receiver = Receiver()
        count = 0
        for length in sample(range(256), 11):
            if 2 <= length <= 12 or length in _ADDRESSES:
                continue
            # Two bytes of nothing behind, so that the length byte itself is done with.
            equal(receiver.feed(bytes((address, length, 0, 0))), 0)
            count += 1
        # The last byte waits for the one behind it.
        expect(receiver, length_errors=count, skipped_bytes=4 * count - 1)


def an_address_in_place_of_a_length_may_start_a_frame_itself():
    good = control(0x1F, CENTRED_RAW)
    receiver = received(b"\x82\x89\x80" + good)
    expect(receiver, AT_CENTRE, frames=1, length_errors=3, skipped_bytes=3)


def a_wrong_crc_is_counted_once_and_skipped_byte_by_byte():
    data = bytearray(control(0x1F, CENTRED_RAW))
    data[-1] ^= 0x01
    expect(received(bytes(data), 0), crc_errors=1, skipped_bytes=13)


def bytes_in_frames_are_not_skipped_bytes():
    data = control(0x1F, CENTRED_RAW) + frame(0x23, bytes(10), 0x89) + frame(0x77)
    expect(received(data), AT_CENTRE, frames=1, foreign_frames=1, unknown_frames=1)


def feeding_counters_at_their_limit_does_not_raise():
    receiver = Receiver()
    for word in range(decoder.FRAMES, decoder.SKIPPED_BYTES + 1):
        decoder.set_word(receiver.memory, word, 0x7FFFFFFF)
    bad = bytearray(control(0x1F, CENTRED_RAW))
    bad[-1] ^= 1
    receiver.feed(bytes(3) + b"\x82\xff" + bytes(bad))
    receiver.feed(frame(0x77) + frame(0x21) + frame(0x23, bytes(10), 0x89))
    equal(receiver.feed(control(0x1F, CENTRED_RAW)), 1)
    equal(list(receiver.pulses[:4]), [6000, 6000, 6000, 6000])
