"""Raw channel values to pulse widths: every type, the whole raw range."""

from behaviour.support import control, equal, expect, received, sample
from ghst import Receiver

_LEGACY = range(0x10, 0x20)
_TWELVE_BIT = range(0x30, 0x40)
_EXTREMES = (0, 1, 343, 344, 1983, 1984, 2047, 2048, 2049, 3624, 4094, 4095)


def _legacy(raw):
    return 6000 + (5 * (raw - 1984) >> 2)


def _twelve_bit(raw):
    return 6000 + (raw - 2048)


def _walk_primaries(kind, scale):
    receiver = Receiver()
    for raw in sample(range(4096), 7):
        raws = (raw, 4095 - raw, raw ^ 0x555, (raw + 1365) & 4095)
        equal(receiver.feed(control(kind, raws)), 1)
        equal(tuple(receiver.pulses[:4]), tuple(map(scale, raws)), raws)


def legacy_primaries_over_the_whole_range():
    _walk_primaries(0x15, _legacy)


def twelve_bit_primaries_over_the_whole_range():
    _walk_primaries(0x35, _twelve_bit)


def primaries_at_the_table_s_points():
    legacy = received(control(0x10, (384, 1984, 3584, 344)))
    equal(list(legacy.pulses[:4]), [4000, 6000, 8000, 3950])
    legacy = received(control(0x10, (0, 4095, 3624, 0)))
    equal(list(legacy.pulses[:4]), [3520, 8638, 8050, 3520])
    twelve_bit = received(control(0x30, (48, 2048, 4048, 0)))
    equal(list(twelve_bit.pulses[:4]), [4000, 6000, 8000, 3952])


def auxiliaries_at_the_table_s_points():
    legacy = received(control(0x10, (0, 0, 0, 0), (24, 124, 224, 0)))
    equal(list(legacy.pulses[4:8]), [4000, 6000, 8000, 3520])
    legacy = received(control(0x10, (0, 0, 0, 0), (22, 226, 255, 21)))
    equal(list(legacy.pulses[4:8]), [3960, 8040, 8620, 3940])
    twelve_bit = received(control(0x30, (0, 0, 0, 0), (3, 128, 253, 255)))
    equal(list(twelve_bit.pulses[4:8]), [4000, 6000, 8000, 8032])


def _walk_auxiliaries(kinds, scale):
    for kind in kinds:
        receiver = Receiver()
        first = 4 + 4 * (kind & 3)
        for raw in sample(range(256), 3):
            raws = (raw, 255 - raw, raw ^ 0x55, (raw + 85) & 255)
            equal(receiver.feed(control(kind, (0, 0, 0, 0), raws)), 1)
            equal(tuple(receiver.pulses[first : first + 4]), tuple(map(scale, raws)), raws)


def legacy_auxiliaries_over_the_whole_range():
    _walk_auxiliaries((0x10, 0x11, 0x12), lambda raw: 6000 + 20 * (raw - 124))


def twelve_bit_auxiliaries_over_the_whole_range():
    _walk_auxiliaries((0x30, 0x31, 0x32), lambda raw: 6000 + 16 * (raw - 128))


def _every_type(kinds, scale, auxiliary):
    for at in sample((0, 4, 8), 1):
        raws = _EXTREMES[at : at + 4]
        for kind in sample(kinds, 3):
            receiver = received(control(kind, raws, (0, 128, 255, 1)))
            pulses = list(map(scale, raws)) + [0] * 12
            if kind & 15 < 3:
                first = 4 + 4 * (kind & 15)
                pulses[first : first + 4] = auxiliary
            equal(list(receiver.pulses), pulses, hex(kind))


def every_legacy_type_carries_the_primaries():
    _every_type(_LEGACY, _legacy, (3520, 6080, 8620, 3540))


def every_twelve_bit_type_carries_the_primaries():
    _every_type(_TWELVE_BIT, _twelve_bit, (3952, 6000, 8032, 3968))


def each_primary_has_twelve_bits_of_its_own():
    for place in range(4):
        for bit in sample(range(12), 1):
            raws = [0] * 4
            raws[place] = 1 << bit
            receiver = received(control(0x3F, raws))
            pulses = [3952] * 4
            pulses[place] += 1 << bit
            equal(list(receiver.pulses[:4]), pulses, (place, bit))


def more_stick_never_means_a_shorter_pulse():
    receiver = Receiver()
    for kind in (0x1F, 0x3F):
        before = 0
        for raw in sample(range(4096), 7):
            receiver.feed(control(kind, (0, 0, 0, raw)))
            assert receiver.pulses[3] >= before, raw
            before = receiver.pulses[3]


def channels_that_a_frame_does_not_carry_stay():
    receiver = received(control(0x10, (384, 384, 384, 384), (24, 24, 24, 24)))
    receiver.feed(control(0x31, (4048, 4048, 4048, 4048), (253, 253, 253, 253)))
    receiver.feed(control(0x12, (1984, 1984, 1984, 1984), (124, 124, 124, 124)))
    receiver.feed(control(0x14, (1984, 3584, 1984, 1984), (9, 8, 7, 6)))
    receiver.feed(control(0x3F, (48, 2048, 2048, 4048), (5, 4, 3, 2)))
    expect(
        receiver,
        [
            (1, 4000, 6000, 6000, 8000),
            (5, 4000, 4000, 4000, 4000),
            (9, 8000, 8000, 8000, 8000),
            (13, 6000, 6000, 6000, 6000),
        ],
        frames=5,
        vtx_controls=1,
        vtx_control=b"\x09\x08\x07\x06",
    )


def both_scalings_may_be_mixed():
    receiver = received(control(0x10, (384, 384, 384, 384), (24, 24, 24, 24)))
    receiver.feed(control(0x30, (48, 48, 48, 48), (3, 3, 3, 3)))
    expect(receiver, [(1, 4000, 4000, 4000, 4000, 4000, 4000, 4000, 4000)], frames=2)
