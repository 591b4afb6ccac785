"""Integer arithmetic of the sensors: products, quotients, angles, the vario's filter."""

from firmware.sensors.arithmetic import atan2_decideg, divide, multiply
from firmware.sensors.vario import AltitudeFilter
from firmware.sensors.words import signed_words

from behaviour.support import equal, sample

_LARGEST = (1 << 30) - 1


def products():
    for a, b, shift, wanted in (
        (0, _LARGEST, 1, 0),
        (1, 1, 1, 1),  # a half, away from zero
        (-1, 1, 1, -1),
        (1, -1, 2, 0),
        (3, 1, 2, 1),
        (-3, 1, 2, -1),
        (5, 1, 2, 1),
        (6, 1, 2, 2),
        (7, 9, 3, 8),
        (_LARGEST, _LARGEST, 30, (1 << 30) - 2),
        (-_LARGEST, _LARGEST, 30, -((1 << 30) - 2)),
        (_LARGEST, 1, 30, 1),
        (1 << 29, 1, 30, 1),
        ((1 << 29) - 1, 1, 30, 0),
        (123_456_789, 987_654, 20, 116_283_981),
        (-123_456_789, -987_654, 20, 116_283_981),
        (32_767, 32_767, 15, 32_766),
        (32_768, 32_768, 15, 32_768),
        (0x3FFF8000, 0x7FFF, 16, 536_838_145),
    ):
        equal(multiply(a, b, shift), wanted, f"{a} * {b} >> {shift}")
        equal(multiply(b, a, shift), wanted, f"{b} * {a} >> {shift}")


def quotients():
    for a, b, shift, wanted in (
        (0, 1, 30, 0),
        (1, 3, 30, 357_913_941),
        (2, 3, 30, 715_827_882),
        (1, 1, 29, 1 << 29),
        (51_200_000, 298_819_584, 30, 183_975_831),
        (1, _LARGEST, 30, 1),
        (7, 2, 0, 3),
    ):
        equal(divide(a, b, shift), wanted, f"{a} << {shift} / {b}")


def angles():
    for x, y, wanted in (
        (0, 0, 0),
        (1, 0, 0),
        (1, 1, 450),
        (0, 1, 900),
        (-1, 1, 1350),
        (-1, 0, 1800),
        (-1, -1, 2250),
        (0, -1, 2700),
        (1, -1, 3150),
        (1_000_000, -1, 0),
        (1_000_000, 17_455, 10),
        (1_000_000, -17_455, 3590),
        (1_732_051, 1_000_000, 300),
        (100_000, 173_205, 600),
        (-173_205, 100_000, 1500),
        (-100_000, -173_205, 2400),
    ):
        found = atan2_decideg(y, x)
        assert abs((found - wanted + 1800) % 3600 - 1800) <= 1, (x, y, found)


# A circle of 30000 in steps of 5 degrees, rounded.
_SINES = (0, 2615, 5209, 7765, 10261, 12679, 15000, 17207, 19284, 21213, 22981, 24575, 25981)
_SINES += (27189, 28191, 28978, 29544, 29886, 30000)


def a_whole_circle_of_angles():
    for quarter in range(4):
        for step in sample(range(18), 5):
            x, y = _SINES[18 - step], _SINES[step]
            for _ in range(quarter):
                x, y = -y, x
            found = atan2_decideg(y, x)
            away = (found - 900 * quarter - 50 * step + 1800) % 3600 - 1800
            assert -2 < away < 2, (x, y, found)


def words_of_two_bytes():
    words = [0, 0, 0]
    data = bytes((0xFF, 0x7F, 0x00, 0x80, 0xFE, 0xFF))
    first = signed_words(data, words, True)
    equal(words, [32767, -32768, -2])
    assert 0 <= first < 1 << 30
    signed_words(data, words, False)
    equal(words, [-129, 128, -257])
    seen = set()
    for place in range(6):
        for bit in sample(range(8), 2):
            other = bytearray(data)
            other[place] ^= 1 << bit
            seen.add(signed_words(other, words, True))
    assert first not in seen


def the_filter_takes_the_first_altitude_as_it_is():
    altitude = AltitudeFilter()
    equal(altitude.altitude_mm, None)
    assert altitude.update(123_456, 20)
    equal((altitude.altitude_mm, altitude.speed_mm_s), (123_456, 0))


def the_filter_follows_a_step():
    altitude = AltitudeFilter(400)
    altitude.update(0, 25)
    found = []
    for _ in range(6):
        altitude.update(1000, 25)
        found.append((altitude.altitude_mm, altitude.speed_mm_s))
    # In floating point: 114.2, 138.4; 218.4, 260.5; 313.4, 367.8.
    equal(found[:3], [(114, 138), (219, 260), (314, 367)])
    for _ in range(160):
        altitude.update(1000, 25)
    equal((altitude.altitude_mm, altitude.speed_mm_s), (1001, 0))  # but for rounding


def the_filter_does_not_lag_behind_a_climb():
    for step_ms in sample((20, 25, 60, 400), 2):
        altitude = AltitudeFilter(400)
        height = 0
        for _ in range(4800 // step_ms):
            altitude.update(height, step_ms)
            height += 5 * step_ms
        assert abs(altitude.speed_mm_s - 5000) <= 20, (step_ms, altitude.speed_mm_s)
        assert abs(altitude.altitude_mm - (height - 5 * step_ms)) <= 5, step_ms


def the_filter_leaves_jumps_out_and_starts_anew_after_gaps():
    altitude = AltitudeFilter()
    altitude.update(0, 0)
    assert altitude.update(30_000, 25)
    assert not altitude.update(70_000, 25)
    assert not altitude.update(-40_000, 25)
    before = altitude.altitude_mm, altitude.speed_mm_s
    assert not altitude.update(12_000_000, 25)
    equal((altitude.altitude_mm, altitude.speed_mm_s), before)
    assert altitude.update(70_000, 501)
    equal((altitude.altitude_mm, altitude.speed_mm_s), (70_000, 0))
    assert altitude.update(-900_000, -1)
    equal((altitude.altitude_mm, altitude.speed_mm_s), (-900_000, 0))
    altitude.reset()
    equal((altitude.altitude_mm, altitude.speed_mm_s), (None, 0))


def time_constants_that_cannot_be():
    for time_constant_ms in (0, 299, 5001):
        try:
            AltitudeFilter(time_constant_ms)
        except ValueError as error:
            assert "300..5000" in str(error)
        else:
            raise AssertionError(time_constant_ms)
