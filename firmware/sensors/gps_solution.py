"""What a GPS receiver says about one moment: the words of an `array("i")`, made by `empty`.

The position is in an array because longitudes beyond 107 degrees (2^30) are no small integers:
only whoever reads one as a Python integer allocates.
"""

from array import array

try:
    from micropython import const
except ImportError:
    from ghst._host import const

FIX = const(0)  # 0 = no position, 2 or 3 dimensions
LAT_E7 = const(1)  # north positive
LON_E7 = const(2)  # east positive
ALT_M = const(3)  # above mean sea level
SPEED_CM_S = const(4)  # over ground
COURSE_DECIDEG = const(5)  # over ground, 0..3599
SATELLITES = const(6)  # used
PDOP_CENTI = const(7)
GOOD = const(8)  # 1 = as exact as home has to be, as far as the receiver tells; else 0
SIZE = const(9)

# In the place of any value but the first three and the last one. Far from all of them, and a small
# integer.
UNKNOWN = const(-0x20000000)

LOWEST_ALT_M = const(-10_000)
HIGHEST_ALT_M = const(100_000)
HIGHEST_SPEED_CM_S = const(100_000)

HIGHEST_PDOP_CENTI = const(500)  # of a good one


def empty():
    """Returns a solution without a fix."""
    return array("i", [0, 0, 0, UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN, 0])
