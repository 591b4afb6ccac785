"""`HardIron`: finds the field that a model carries with it, while it is turned in a circle."""

from array import array

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython

_X = const(0)
_Y = const(1)
_SUM = const(2)
_DIFFERENCE = const(3)
_Z = const(4)
_NOTHING_NT = const(0x1FFFFFFF)

# The horizontal field is 10000 to 42000 nT, except near the magnetic poles; a circle is twice as
# wide.
_NARROWEST_NT = const(15_000)
_WIDEST_NT = const(150_000)
_FEWEST_READINGS = const(50)


@micropython.native
def _widen(low, high, values):
    for direction in range(5):
        value = values[direction]
        if value < low[direction]:
            low[direction] = value
        if value > high[direction]:
            high[direction] = value


class HardIron:
    """Smallest and largest field in four horizontal directions 45 degrees apart, and along z.

    Their middle is the offset. Four directions and not two, because the ends of a part of a
    circle look like those of a whole one along x and y: its diagonals tell.
    """

    def __init__(self):
        self.readings = 0
        self._values = array("i", [0] * 5)
        self._low = array("i", [_NOTHING_NT] * 5)
        self._high = array("i", [-_NOTHING_NT] * 5)

    def update(self, field_nt):
        """Takes x, y and z in nanotesla, each within +-10^8."""
        self.readings += 1
        x = field_nt[0]
        y = field_nt[1]
        values = self._values
        values[_X] = x
        values[_Y] = y
        values[_SUM] = x + y
        values[_DIFFERENCE] = x - y
        values[_Z] = field_nt[2]
        _widen(self._low, self._high, values)

    def _width(self, direction):
        return self._high[direction] - self._low[direction]

    def _middle(self, direction):
        return (self._high[direction] + self._low[direction]) // 2

    def offset_nt(self, z_nt):
        """Returns the offset as a tuple x, y, z; z is `z_nt` unless it was turned over as well.

        Raises `ValueError` with the reason when the circle was not complete.
        """
        if self.readings < _FEWEST_READINGS:
            raise ValueError(
                f"only {self.readings} measurements: turn the model for some seconds more"
            )
        # The diagonals are longer by the root of two.
        widths = [self._width(_X), self._width(_Y)]
        widths += [self._width(direction) * 70 // 99 for direction in (_SUM, _DIFFERENCE)]
        narrow, wide = min(widths), max(widths)
        if wide < _NARROWEST_NT:
            raise ValueError(
                f"the field changed by {wide // 1000} uT only: turn the model a full circle"
            )
        if wide > _WIDEST_NT:
            raise ValueError(
                f"the field changed by {wide // 1000} uT: keep away from motors and magnets"
            )
        x, y = self._middle(_X), self._middle(_Y)
        skew = max(abs(self._middle(_SUM) - x - y), abs(self._middle(_DIFFERENCE) - x + y))
        if 10 * narrow < 6 * wide or 30 * skew > wide:
            raise ValueError("the circle is not complete: turn the model level, all the way round")
        if 10 * self._width(_Z) >= 6 * wide:
            z_nt = self._middle(_Z)
        return (x, y, z_nt)
