"""Integer arithmetic for sensors: nothing here allocates, as floats and large integers would.

All arguments and results are small integers of a 32-bit port: below 2^30 in magnitude.
"""

try:
    import micropython
except ImportError:
    from ghst._host import micropython


@micropython.viper
def multiply(a: int, b: int, shift: int) -> int:
    """Returns a * b / 2^shift, exact but for the rounding to the nearest integer.

    Halves are rounded away from zero. `shift` is 1..30; the caller sees to it that the result
    stays below 2^30.
    """
    negative = 0
    if a < 0:
        a = 0 - a
        negative = 1
    if b < 0:
        b = 0 - b
        negative = 1 - negative
    # Halves of 15 bits: no product or sum of two of them reaches bit 31.
    middle = (a >> 15) * (b & 0x7FFF) + (a & 0x7FFF) * (b >> 15)
    low = (a & 0x7FFF) * (b & 0x7FFF) + ((middle & 0x7FFF) << 15)
    high = (a >> 15) * (b >> 15) + (middle >> 15) + (low >> 30)
    low = (low & 0x3FFFFFFF) + (1 << (shift - 1))
    result = ((high + (low >> 30)) << (30 - shift)) + ((low & 0x3FFFFFFF) >> shift)
    if negative:
        return 0 - result
    return result


@micropython.viper
def divide(a: int, b: int, shift: int) -> int:
    """Returns a * 2^shift / b, rounded down; `a` is 0 or more, `b` more than 0."""
    result = a // b
    rest = a - result * b
    for _ in range(shift):
        rest += rest
        result += result
        if rest >= b:
            rest -= b
            result += 1
    return result


@micropython.viper
def atan2_decideg(y: int, x: int) -> int:
    """Returns the angle from the x axis to (x, y) in tenths of a degree, 0..3599.

    Counted towards the y axis; the error is below 0.15 degrees. (0, 0) gives 0.
    """
    longer = x
    if longer < 0:
        longer = 0 - longer
    shorter = y
    if shorter < 0:
        shorter = 0 - shorter
    steep = 0
    if shorter > longer:
        steep = shorter
        shorter = longer
        longer = steep
        steep = 1
    if longer == 0:
        return 0
    while longer >= 0x8000:
        longer >>= 1
        shorter >>= 1
    # With r in 0..1: atan r = r * pi / 4 + r * (1 - r) * (0.2447 + 0.0663 * r), within 0.0015
    # rad (S. Rajan et al., "Efficient approximations for the arctangent function", 2006).
    # Here r has 15 binary places, angles are in 1/160 of a degree.
    r = (shorter << 15) // longer
    bow = (r * (0x8000 - r)) >> 15
    angle = (7200 * r + bow * (2243 + ((608 * r) >> 15)) + 0x4000) >> 15
    if steep:
        angle = 14400 - angle
    if x < 0:
        angle = 28800 - angle
    if y < 0:
        angle = 57600 - angle
    return ((angle + 8) >> 4) % 3600
