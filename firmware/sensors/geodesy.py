"""Distance and direction from one position to another, in integers.

The earth is a sphere of 6371.0088 km radius here, and the meridians between the two positions are
as far apart as half-way between them. Up to 20 km, and from 80 degrees south to 80 north, that is
within 0.05 % and half a metre of the distance on the sphere, which is itself up to 0.6 % off the
ellipsoid that GPS uses, and within 0.5 degrees of the direction. Nothing allocates.

Angles are turned into lengths and back by CORDIC (J. E. Volder, 1959): a rotation in steps whose
tangents are powers of two takes only shifts and additions.
"""

from array import array

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython, ptr32

_STEPS = const(16)

# Arc tangents of 1, 1/2, 1/4, ... in 1e-7 degrees.
# fmt: off
_ATAN = array("i", (
    450000000, 265650512, 140362435, 71250163, 35763344, 17899106, 8951737, 4476142,
    2238105, 1119057, 559529, 279765, 139882, 69941, 34971, 17485,
))
# fmt: on

# The steps make each vector longer, by 1.646760: this over 2^15 makes it as long as before.
_SHRINK = const(19898)
# 2^21 times the metres in 1e-7 degrees, 0.011119508, over the same 1.646760.
_METRES = const(14161)


@micropython.viper
def distance_and_direction(points: ptr32, result: ptr32):
    """Writes the distance in m and the direction in 0.1 degrees, 0..3599, to `result`.

    `points`: latitude and longitude of here, then of there, in 1e-7 degrees. The direction is
    where there lies from here, clockwise from north; 0 if both are the same place.
    """
    # 1.8e9 and 3.6e9 have to be avoided: viper takes small integers only, and wraps at 2^31.
    quarter = 900000000
    # The sign, which viper leaves out on ports of more than 32 bits.
    sign = -1
    sign <<= 31
    from_latitude = points[0] | (sign if points[0] >> 31 else 0)
    to_latitude = points[2] | (sign if points[2] >> 31 else 0)
    here = points[1] | (sign if points[1] >> 31 else 0)
    there = points[3] | (sign if points[3] >> 31 else 0)
    north = to_latitude - from_latitude
    turn = (there >> 1) - (here >> 1)
    if turn > quarter:  # across the 180th meridian to the west
        there -= quarter + quarter
        here += quarter + quarter
    elif turn < 0 - quarter:
        there += quarter + quarter
        here -= quarter + quarter
    east = there - here

    # The cosine of the latitude half-way, with 15 binary places: a vector turned by that angle.
    angle = (from_latitude >> 1) + (to_latitude >> 1)
    x = _SHRINK << 13
    y = step = 0
    table = ptr32(_ATAN)
    while step < _STEPS:
        back = x >> step
        if angle >= 0:
            x -= y >> step
            y += back
            angle -= table[step]
        else:
            x += y >> step
            y -= back
            angle += table[step]
        step += 1
    cosine = x >> 13
    east = (east >> 15) * cosine + ((east & 0x7FFF) * cosine >> 15)

    # As large as possible, so that the shifts lose little, and the sums stay below 2^31.
    longest = north if north >= 0 else 0 - north
    if east > longest or 0 - east > longest:
        longest = east if east >= 0 else 0 - east
    if longest == 0:
        result[0] = result[1] = 0
        return
    shift = 0
    while longest >= 1 << 28:
        longest >>= 1
        shift -= 1
    while longest < 1 << 27:
        longest += longest
        shift += 1
    if shift >= 0:
        north <<= shift
        east <<= shift
    else:
        north >>= 0 - shift
        east >>= 0 - shift

    # Turned until it points north: how far is the direction, how long it is then the distance.
    decideg = 0
    if north < 0:
        north = 0 - north
        east = 0 - east
        decideg = 1800
    angle = step = 0
    while step < _STEPS:
        back = north >> step
        if east >= 0:
            north += east >> step
            east -= back
            angle += table[step]
        else:
            north -= east >> step
            east += back
            angle -= table[step]
        step += 1
    result[1] = (decideg + 3600 + (angle + 500000) // 1000000) % 3600
    shift += 8
    metres = (north >> 13) * _METRES
    result[0] = (metres + (1 << (shift - 1))) >> shift if shift < 31 else 0
