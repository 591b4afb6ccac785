"""Nothing is allocated by `feed`: proved by locking MicroPython's heap around it."""

from array import array

import micropython

from behaviour.support import CENTRED_RAW, control, equal, expect, frame, sample
from ghst import Receiver, decoder

_CENTRED = control(0x1F, CENTRED_RAW)


def _feed_locked(receiver, data):
    micropython.heap_lock()
    try:
        return receiver.feed(data)
    finally:
        micropython.heap_unlock()


def the_lock_does_catch_an_allocation():
    micropython.heap_lock()
    try:
        bytearray(100)
    except MemoryError:
        return
    finally:
        micropython.heap_unlock()
    raise AssertionError("the heap was not locked")


def feeding_every_type():
    receiver = Receiver()
    kinds = sample(tuple(range(0x10, 0x20)) + tuple(range(0x30, 0x40)), 8)
    for kind in kinds:
        data = control(kind, (0, 4095, 4095, 0), (255, 255, 255, 255))
        equal(_feed_locked(receiver, data), 1, hex(kind))
    equal(receiver.frames, len(kinds))


def feeding_what_is_no_control_frame():
    receiver = Receiver()
    broken = bytearray(_CENTRED)
    broken[6] ^= 4
    for data in (
        broken,
        b"\x82\xff\x80",
        frame(0x20, b"\xff" * 10, 0x80),
        frame(0x23, b"\xff" * 10, 0x89),
        frame(0x77),
        frame(0x21),
        frame(0x10, b"\xff"),
        b"",
    ):
        equal(_feed_locked(receiver, data), 0)
    expect(
        receiver,
        vtx_setups=1,
        crc_errors=1,
        length_errors=3,
        foreign_frames=2,
        unknown_frames=1,
        msp_frames=1,
        skipped_bytes=17,
        vtx_flags=255,
        vtx_freq_mhz=65535,
        vtx_power_mw=65535,
        vtx_band_channel=255,
    )


def feeding_byte_by_byte_and_with_a_length():
    receiver = Receiver()
    parts = [memoryview(_CENTRED)[at : at + 1] for at in range(14)]
    count = 0
    micropython.heap_lock()
    try:
        for part in parts:
            count += receiver.feed(part)
        count += receiver.feed(_CENTRED, 14)
        receiver.feed(_CENTRED, 5)
        receiver.discard_partial()
    finally:
        micropython.heap_unlock()
    equal(count, 2)
    equal((receiver.frames, receiver.skipped_bytes), (2, 5))


def feeding_noise():
    receiver = Receiver()
    noise = bytearray(sample((100000, 500), 1)[0])
    value = 1
    for at in range(len(noise)):
        value = (value * 109 + 89) & 0xFFFF
        noise[at] = value >> 7 & 255
    _feed_locked(receiver, noise)
    assert receiver.skipped_bytes > len(noise) - 300, receiver.skipped_bytes


def feeding_counters_past_their_end():
    # A 32-bit port's small ints end at 2^30: a counter that is larger would be an object.
    receiver = Receiver()
    for word in range(decoder.FRAMES, decoder.SKIPPED_BYTES + 1):
        decoder.set_word(receiver.memory, word, 0x3FFFFFFF)
    bad = bytearray(_CENTRED)
    bad[-1] ^= 1
    data = bytes(3) + b"\x82\xff" + bytes(bad) + frame(0x77) + frame(0x21) + _CENTRED
    equal(_feed_locked(receiver, data), 1)
    equal(receiver.frames, 0)
    equal(receiver.skipped_bytes, 18)


def the_decoder_keeps_inside_its_memory():
    # Its memory in the middle of a larger buffer: what lies around it stays as it was.
    memory = bytearray(decoder.MEMORY_SIZE + 64)
    memory[:32] = before = bytes(range(32))
    memory[-32:] = after = bytes(range(100, 132))
    receiver = Receiver(memoryview(memory)[32:-32])
    pulses = array("H", [0xA5A5] * 32)
    receiver.pulses = memoryview(pulses)[8:24]
    for kind in (0x10, 0x11, 0x12, 0x13, 0x14):
        for _ in range(5):
            receiver.feed(b"\x8a" + control(kind, (0, 4095, 0, 4095), (255, 0, 255, 0)))
    equal(receiver.frames, 25)
    equal(bytes(memory[:32]), before, "what stands before it")
    equal(bytes(memory[-32:]), after, "what stands behind it")
    equal(list(pulses)[:8] + list(pulses)[24:], [0xA5A5] * 16, "memory around the pulses")
    # Channels 1-16 all came, so nothing of the fill pattern may be left of them.
    assert 0xA5A5 not in list(pulses)[8:24]
