"""Every single and every double bit error of control frames: what becomes of each.

CRC-8/DVB-S2 covers type to CRC byte, 96 bits of a control frame. Its polynomial has an even
number of terms, so it sees every odd number of errors, and the period 93, so it sees every double
error but those whose bits are 93 places apart. There are three such pairs in 96 bits.
"""

from array import array
from collections.abc import Iterator
from itertools import combinations

import pytest

from ghst import Receiver
from ghst_tools.campaign.model import Model, crc, differences

BITS = 14 * 8
HEADER = 2 * 8
"""Bits of address and length, which the CRC does not cover."""

CONTROL_SAMPLES = (
    "820c11d8277e5c87747d7c7c7ccd",
    "820c10d8277e5c87747c7c1b1bea",
    "820c105881e2c007ae167ce2aef7",
    "820c11c0077cc0077c7c7c7c7cf5",
    "820c128001e0c0077c18e07c7c5c",
    "820c13c0077c58017c643c061437",
    "820c13c0077c58017c256528f87b",
    "820c14c0077c58017c000000001c",
    "820c3000f0ff0008400080ff4069",
    "820c3100088000088080808080e6",
    "820c323000fd00088003fd808068",
    "820c33000880000080634b6a1ba1",
)

TYPE_BIT_5 = HEADER + 2
CRC_BIT_0 = BITS - 1
LEGACY_FOR_12_BIT = (TYPE_BIT_5, CRC_BIT_0)
"""The one pair that makes a control frame: it swaps the two scalings, 0x1x for 0x3x."""

BEYOND = {(TYPE_BIT_5 - step, CRC_BIT_0 - step) for step in range(3)}
"""The pairs that are 93 bits apart, bits counted in the order in which the CRC takes them."""


def flip(data: bytes, bits: tuple[int, ...]) -> bytes:
    """Inverts bits; bit 0 is the most significant one of the address."""
    number = int.from_bytes(data, "big")
    for bit in bits:
        number ^= 1 << (8 * len(data) - 1 - bit)
    return number.to_bytes(len(data), "big")


def errors(count: int) -> Iterator[tuple[int, ...]]:
    return combinations(range(BITS), count)


def syndromes() -> list[int]:
    """The CRC of each single wrong bit: the code is linear, so errors add up by xor."""
    covered = BITS - HEADER
    return [crc(flip(bytes(11), (bit,))) for bit in range(covered - 8)] + [
        1 << (7 - bit) for bit in range(8)
    ]


def test_single_bits_are_all_seen_and_three_pairs_are_not() -> None:
    by_bit = syndromes()
    assert len(by_bit) == 96
    assert 0 not in by_bit
    unseen = {
        (first + HEADER, second + HEADER)
        for (first, one), (second, other) in combinations(enumerate(by_bit), 2)
        if one == other
    }
    assert unseen == BEYOND
    # Bits 5, 6, 7 of the type with bits 0, 1, 2 of the CRC byte.
    assert unseen == {(18, 111), (17, 110), (16, 109)}


def test_no_odd_number_of_wrong_bits_passes() -> None:
    # Each syndrome has an odd number of ones, once the polynomial's parity is taken out: x + 1
    # divides it, so every single bit leaves the value 1 modulo x + 1.
    assert all(value.bit_count() % 2 == 1 for value in syndromes())


def classify(broken: bytes) -> str:
    """What the first bytes of a broken frame say, by the description alone."""
    if broken[0] not in range(0x80, 0x8A):
        return "no address"
    if broken[1] not in range(2, 13):
        return "impossible length"
    if broken[1] < 12:
        return "shorter frame"
    if crc(broken[2:13]) != broken[13]:
        return "wrong CRC"
    return "valid" if broken[0] == 0x82 else "for somebody else"


OUTCOMES = {
    1: {
        "no address": 5,
        "impossible length": 6,
        "shorter frame": 2,
        "wrong CRC": 96,
        "for somebody else": 3,
        "valid": 0,
    },
    2: {
        "no address": 544,
        "impossible length": 618,
        "shorter frame": 202,
        "wrong CRC": 4845,
        "for somebody else": 4,
        "valid": 3,
    },
}
"""Errors of one and of two bits -> how many of the 112 and 6216 become what."""


@pytest.fixture(scope="module")
def empty() -> tuple[Receiver, bytes]:
    """A receiver, and its memory when nothing was received: a new one each time takes long."""
    receiver = Receiver()
    return receiver, bytes(receiver.memory)


@pytest.mark.parametrize("sample", CONTROL_SAMPLES)
@pytest.mark.parametrize("count", [1, 2])
def test_every_error_of_a_sample_frame(
    sample: str, count: int, empty: tuple[Receiver, bytes]
) -> None:
    good = bytes.fromhex(sample)
    receiver, memory = empty
    outcomes = dict.fromkeys(OUTCOMES[1], 0)
    for bits in errors(count):
        receiver.memory[:] = memory
        receiver.pulses[:] = array("H", [0] * 16)
        model = Model()
        broken = flip(good, bits)
        accepted = receiver.feed(broken)
        assert accepted == model.feed(broken)
        assert differences(model, receiver) == []
        outcome = classify(broken)
        outcomes[outcome] += 1
        if bits == LEGACY_FOR_12_BIT:
            assert (outcome, accepted, broken[2]) == ("valid", 1, good[2] ^ 0x20)
            continue
        # No channel moves and no link data: only a control frame may do that.
        assert accepted == receiver.frames == 0
        assert list(receiver.pulses) == [0] * 16
        assert (receiver.lq, receiver.rssi_dbm, receiver.rf_mode) == (0, 0, 0)
        match outcome:
            case "valid":
                assert bits in BEYOND
                assert (receiver.unknown_frames, receiver.skipped_bytes) == (1, 0)
            case "for somebody else":
                assert (receiver.foreign_frames, receiver.skipped_bytes) == (1, 0)
            case "wrong CRC":
                assert receiver.crc_errors >= 1
            case "impossible length":
                assert receiver.length_errors >= 1
    assert outcomes == OUTCOMES[count]


def test_errors_that_cost_the_next_frame_too(empty: tuple[Receiver, bytes]) -> None:
    """A piece of a broken frame may pass as a frame that reaches into the next: 1 in 256 of them.

    Then the next intact frame is lost as well; nothing that CRC-8 protects can do better.
    """
    receiver, memory = empty
    lost = tried = 0
    for sample in CONTROL_SAMPLES:
        good = bytes.fromhex(sample)
        for count in (1, 2):
            for bits in errors(count):
                if bits == LEGACY_FOR_12_BIT:
                    continue
                receiver.memory[:] = memory
                tried += 1
                lost += receiver.feed(flip(good, bits) + good) == 0
    assert tried == len(CONTROL_SAMPLES) * (112 + 6216 - 1)
    assert lost == 2
