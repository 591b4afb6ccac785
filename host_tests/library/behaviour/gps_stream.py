"""Sentences and frames are found among each other and among noise."""

from firmware.sensors.gps_stream import (
    ALWAYS_FREE,
    LONGEST_PAYLOAD,
    LONGEST_SENTENCE,
    RING_SIZE,
    Stream,
)

from behaviour.gps_support import found, pvt, sentence, ubx
from behaviour.support import equal, sample

GGA = "GPGGA,091715.00,4722.6143,N,00832.5034,E,1,09,0.9,431.9,M,48.0,M,,"
RMC = "GPRMC,091715.00,A,4722.6143,N,00832.5034,E,23.99,271.26,130726,,,A"
ACK = ubx(0x05, 0x01, b"\x06\x8a")


def _expect(data, results, errors=0):
    for piece in sample((1, 2, 7, None, 64), 1):
        equal(found(data, piece), (results, errors), f"in pieces of {piece}")


def one_sentence():
    equal(found(sentence(GGA)), ([GGA], 0))


def one_frame():
    equal(found(ACK), ([ACK[2:-2]], 0))


def sentences_and_frames_in_turn():
    data = sentence(GGA) + pvt() + sentence(RMC) + ACK + ACK + sentence(GGA)
    results = [GGA, pvt()[2:-2], RMC, ACK[2:-2], ACK[2:-2], GGA]
    for piece in (1, None):
        equal(found(data, piece), (results, 0), f"in pieces of {piece}")


def a_known_checksum():
    # Reckoned by hand: 0x47 ^ 0x50 ^ 0x41 ^ 0x42 ^ 0x43 ^ 0x2C = 0x7B.
    equal(found(b"$GPABC,*7B"), (["GPABC,"], 0))
    equal(found(b"$GPABC,*7b"), (["GPABC,"], 0), "small letters")
    # The poll of a port's configuration, as u-blox prints it in its description.
    equal(found(b"\xb5\x62\x06\x00\x00\x00\x06\x18"), ([b"\x06\x00\x00\x00"], 0))


def a_sentence_ends_with_its_checksum():
    # Neither carriage return nor line feed is waited for, and none is missed.
    _expect(sentence(GGA)[:-2] + sentence(RMC)[:-1] + sentence(GGA)[:-2], [GGA, RMC, GGA])


def wrong_checksums():
    for wrong in sample((b"*00", b"*0G", b"* 7", b"*7:", b"*-1", b"*@0"), 3):
        _expect(b"$" + GGA.encode() + wrong + b"\r\n" + sentence(RMC), [RMC], 1)
    for at in sample(range(len(ACK)), 4):
        broken = bytearray(ACK)
        broken[at] ^= 0x10
        results, _ = found(bytes(broken) + bytes(LONGEST_PAYLOAD) + sentence(RMC))
        equal(results, [RMC], f"with byte {at} wrong")


def every_wrong_bit_of_a_sentence():
    data = sentence(RMC)
    for bit in sample(range(8 * (len(data) - 2)), 20):
        broken = bytearray(data)
        broken[bit // 8] ^= 1 << bit % 8
        results, _ = found(bytes(broken) + sentence(GGA))
        # A small letter of the checksum is a right one as well.
        if results != [RMC, GGA] or broken[bit // 8] | 0x20 != data[bit // 8] | 0x20:
            equal(results, [GGA], f"with bit {bit} wrong")


def without_a_checksum():
    _expect(b"$" + GGA.encode() + b"\r\n" + sentence(RMC), [RMC], 1)


def cut_by_another():
    for at in sample(range(1, len(sentence(GGA)) - 2), 5):
        head = sentence(GGA)[:at]
        _expect(head + sentence(RMC), [RMC], 1)
        _expect(head + ACK, [ACK[2:-2]], 1)


def a_frame_that_is_cut():
    for at in sample(range(2, len(ACK)), 4):
        # What follows is taken for the rest of it first; nothing of it is lost.
        results, _ = found(ACK[:at] + (sentence(RMC) + ACK + sentence(GGA)) * 3)
        equal(results, [RMC, ACK[2:-2], GGA] * 3, f"after {at} bytes")


def characters_that_no_sentence_has():
    for value in sample((0, 9, 0x1F, 0x7F, 0x80, 0xFF), 2):
        _expect(b"$GPGGA,1" + bytes((value,)) + b",2*00\r\n" + sentence(RMC), [RMC], 1)


def the_longest_sentence():
    text = "GPTXT," + "x" * (LONGEST_SENTENCE - 7)
    _expect(sentence(text) + sentence(RMC), [text, RMC])
    _expect(sentence(text + "xx") + sentence(RMC), [RMC], 1)
    _expect(sentence(text * 3) + sentence(RMC), [RMC], 1)


def the_shortest_sentence():
    _expect(sentence("GPGGA"), ["GPGGA"])
    _expect(sentence("GPGG") + sentence(RMC), [RMC], 1)
    _expect(b"$*00\r\n" * 40 + sentence(RMC), [RMC], 40)


def the_longest_frame():
    longest = ubx(0x01, 0x35, bytes(range(LONGEST_PAYLOAD)))
    _expect(longest + sentence(RMC), [longest[2:-2], RMC])
    # A longer one is skipped: nothing in it looks like anything.
    _expect(ubx(0x01, 0x35, bytes(LONGEST_PAYLOAD + 1)) + sentence(RMC), [RMC])


def a_frame_without_a_payload():
    _expect(ubx(0x06, 0x00) + sentence(RMC), [ubx(0x06, 0x00)[2:-2], RMC])


def a_start_that_is_none():
    # The first byte of a frame, alone, doubled, and before a real one.
    _expect(b"\xb5" + sentence(RMC), [RMC])
    _expect(b"\xb5\xb5" + ACK + b"\xb5", [ACK[2:-2]])
    _expect(b"$$$" + sentence(RMC), [RMC], 3)


def a_sentence_inside_a_frame_stays_inside():
    frame = ubx(0x01, 0x30, sentence(GGA))
    _expect(frame + sentence(RMC), [frame[2:-2], RMC])


def noise_of_every_byte_between():
    noise = bytes(value for value in range(256) if value not in (0x24, 0xB5))
    _expect(noise + sentence(RMC) + noise + ACK + noise, [RMC, ACK[2:-2]])


def _takes(stream, count):
    try:
        stream.feed(bytes(count), count)
    except ValueError:
        return False
    return True


def the_ring_is_full():
    stream = Stream()
    assert not _takes(stream, RING_SIZE + 1)
    assert _takes(stream, RING_SIZE)
    assert not _takes(stream, 1)
    for data, count in ((b"a", 2), (b"", 1), (b"a", -1)):
        equal(stream.next(), 0)
        try:
            stream.feed(data, count)
        except ValueError:
            continue
        raise AssertionError(f"{count} bytes were taken")
    assert _takes(stream, RING_SIZE)


def an_unfinished_one_leaves_room():
    # The longest sentence and frame that are not complete: what is behind them always fits.
    for head in (b"$GPTXT" + b"x" * 115 + b"*0", b"\xb5\x62\x01\x07\x78\x00" + bytes(121)):
        stream = Stream()
        stream.feed(head, len(head))
        equal(stream.next(), 0)
        assert _takes(stream, ALWAYS_FREE)


def clearing_forgets_what_is_unfinished():
    stream = Stream()
    equal(found(b"$GPGGA$" + GGA.encode(), 5, stream), ([], 1))
    equal(found(b"$", 5, stream), ([], 1))
    stream.clear()
    equal(found(GGA.encode() + b"*00" + sentence(RMC), 5, stream), ([RMC], 0))
