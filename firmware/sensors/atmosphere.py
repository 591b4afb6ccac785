"""Altitude from pressure: the international standard atmosphere (ISO 2533), in integers."""

from array import array

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython

from firmware.sensors.arithmetic import multiply

MINIMUM_PRESSURE_16 = const(25_000 * 16)
MAXIMUM_PRESSURE_16 = const(120_000 * 16)

# Altitude in mm at each multiple of 2048 Pa:
# 288.15 / 0.0065 * (1 - (p / 101325) ** (287.05287 * 0.0065 / 9.80665)) * 1000
_FIRST = const(12)
_FRACTION_BITS = const(15)  # of 2048 Pa in sixteenths
# fmt: off
_ALTITUDE_MM = array("i", (
    10473309, 9953742, 9465592, 9004907, 8568456, 8153562, 7757983, 7379817, 7017439, 6669448,
    6334627, 6011910, 5700363, 5399155, 5107551, 4824892, 4550586, 4284101, 4024957, 3772715,
    3526979, 3287384, 3053597, 2825314, 2602253, 2384153, 2170776, 1961898, 1757313, 1556828,
    1360265, 1167455, 978243, 792481, 610033, 430768, 254566, 81311, -89103, -256780,
    -421816, -584301, -744322, -901962, -1057297, -1210403, -1361348, -1510201, -1657025,
))
# fmt: on


@micropython.native
def altitude_mm(pressure_16):
    """Returns the altitude above the standard's sea level in millimetres.

    `pressure_16`: pressure in sixteenths of a pascal, `MINIMUM_PRESSURE_16` to
    `MAXIMUM_PRESSURE_16`. Within 0.2 m of the standard below 9000 m, 0.04 m below 2000 m; the
    altitude between two pressures 10 Pa apart is right to 0.3 %.
    """
    place = (pressure_16 >> _FRACTION_BITS) - _FIRST
    fraction = pressure_16 & 0x7FFF
    low = _ALTITUDE_MM[place]
    slope = _ALTITUDE_MM[place + 1] - low
    bend = _ALTITUDE_MM[place + 2] - _ALTITUDE_MM[place + 1] - slope
    # Newton's interpolation through three points.
    curve = ((fraction * (fraction - 0x8000)) >> 14) * bend >> 17
    return low + multiply(fraction, slope, _FRACTION_BITS) + curve
