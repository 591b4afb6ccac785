"""Distances and directions that are known from elsewhere; `test_gps_model.py` has all the others.

On a sphere of 6371.0088 km a degree of a great circle is 111195.08 m.
"""

from array import array

from firmware.sensors.geodesy import distance_and_direction

from behaviour.support import equal, sample


def _expect(points, metres, decideg):
    result = array("i", (-1, -1))
    distance_and_direction(array("i", points), result)
    equal(tuple(result), (metres, decideg), points)


def the_same_place():
    for lat, lon in ((0, 0), (473_769_052, 85_417_231), (-900_000_000, 1_800_000_000)):
        _expect((lat, lon, lat, lon), 0, 0)


def the_points_of_the_compass():
    step = 100_000  # a hundredth of a degree: 1112 m at the equator
    for north, east, metres, decideg in (
        (1, 0, 1112, 0),
        (1, 1, 1573, 450),
        (0, 1, 1112, 900),
        (-1, 1, 1573, 1350),
        (-1, 0, 1112, 1800),
        (-1, -1, 1573, 2250),
        (0, -1, 1112, 2700),
        (1, -1, 1573, 3150),
    ):
        _expect((0, 0, north * step, east * step), metres, decideg)


def meridians_come_closer():
    # At 60 degrees they are half as far apart as at the equator.
    _expect((600_000_000, 100_000_000, 600_000_000, 101_000_000), 5560, 900)
    _expect((-600_000_000, 100_000_000, -600_000_000, 99_000_000), 5560, 2700)


def across_the_180th_meridian():
    step = 500_000
    for lon, other, decideg in (
        (1_799_500_000, -1_800_000_000, 900),
        (-1_799_500_000, 1_800_000_000, 2700),
        (1_799_750_000, -1_799_750_000, 900),
        (-1_799_750_000, 1_799_750_000, 2700),
    ):
        _expect((0, lon, 0, other), 5560, decideg)
    # The same meridian under two names.
    _expect((0, 1_800_000_000, step, -1_800_000_000), 5560, 0)
    _expect((step, -1_800_000_000, 0, 1_800_000_000), 5560, 1800)


def a_few_metres():
    for lat_e7, metres in ((1, 0), (44, 0), (46, 1), (90, 1), (900, 10), (9000, 100)):
        _expect((0, 0, lat_e7, 0), metres, 0)
        _expect((0, 0, 0, -lat_e7), metres, 2700)


def half_the_earth():
    # 20015115 m. Far beyond what telemetry can say, but not beyond the arithmetic.
    result = array("i", (0, 0))
    for points, decideg in (
        ((-900_000_000, 0, 900_000_000, 0), 0),
        ((900_000_000, 0, -900_000_000, 0), 1800),
        ((0, 0, 0, 1_800_000_000), 900),
        ((0, 0, 0, -1_800_000_000), 2700),
    ):
        distance_and_direction(array("i", points), result)
        assert abs(result[0] - 20_015_115) < 400, result
        equal(result[1], decideg, points)


def a_flight_near_zurich():
    # 1000 m to the north, 1500 m to the east.
    _expect((473_769_052, 85_417_231, 473_858_984, 85_616_453), 1803, 563)


def a_circle():
    # A circle of 1000 m: the distance stays, the direction goes round.
    for lat_e7, lon_e7, decideg in sample(
        (
            (89_932, 0, 0),
            (77_883, 44_966, 300),
            (44_966, 77_883, 600),
            (-44_966, 77_883, 1200),
            (-77_883, 44_966, 1500),
            (-77_883, -44_966, 2100),
            (-44_966, -77_883, 2400),
            (44_966, -77_883, 3000),
            (77_883, -44_966, 3300),
            (89_931, -157, 3599),
        ),
        10,
    ):
        _expect((0, 0, lat_e7, lon_e7), 1000, decideg)
