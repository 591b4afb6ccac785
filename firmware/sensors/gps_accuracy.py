"""How good a solution from NMEA is: dimensions and dilution of precision, as GSA and GGA tell."""

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython

from firmware.sensors.gps_solution import HIGHEST_PDOP_CENTI, UNKNOWN
from ghst.schedule import ticks_diff

# GSA has no time: how long it stands for later solutions.
_FRESH_MS = const(2500)
# So long without a PDOP: this receiver sends none.
_WITHOUT_MS = const(3000)
# Of about the same size as the limit of PDOP: the vertical part is mostly the larger one.
_HIGHEST_HDOP_CENTI = const(250)


class Accuracy:
    """Gathers the GSA sentences of a moment, of which there is one for each satellite system.

    A system that contributes nothing may say that there is no position: the most dimensions count,
    with the PDOP that goes with them. `pdop_centi` is UNKNOWN while there is none.
    """

    def __init__(self):
        self.reset()

    def reset(self):
        """Forgets all sentences."""
        self._time = self._dimensions = self.pdop_centi = UNKNOWN
        self._new = True
        self._gsa_ms = self._since_ms = 0
        self._waits = self._without = False

    @micropython.native
    def moment(self, time):
        """Takes the time of a GGA or RMC: GSA of another moment does not join that before."""
        if time != self._time or time == UNKNOWN:
            self._time = time
            self._new = True

    @micropython.native
    def add(self, dimensions, pdop_centi, now_ms):
        """Takes what a GSA says: 1 for no position, 2 or 3."""
        self._gsa_ms = now_ms
        if self._new or dimensions > self._dimensions:
            self._new = False
            self._dimensions = dimensions
            self.pdop_centi = pdop_centi
        elif (
            dimensions == self._dimensions
            and pdop_centi != UNKNOWN
            and (self.pdop_centi == UNKNOWN or pdop_centi < self.pdop_centi)
        ):
            # They should be the same; of one system alone it can only be larger.
            self.pdop_centi = pdop_centi

    @micropython.native
    def dimensions(self, satellites, alt_m, now_ms):
        """Returns the dimensions of a position.

        To be called once for each solution, before `pdop_centi` is read and `good` called.
        """
        if self._dimensions != UNKNOWN and ticks_diff(now_ms, self._gsa_ms) > _FRESH_MS:
            self._dimensions = self.pdop_centi = UNKNOWN
            self._new = True
        if self.pdop_centi != UNKNOWN:
            self._waits = self._without = False
        elif not self._waits:
            self._waits = True
            self._since_ms = now_ms
        elif ticks_diff(now_ms, self._since_ms) > _WITHOUT_MS:
            self._without = True
        if self._dimensions != UNKNOWN:
            # Receivers send GSA behind GGA: at the first fix it may still say that there is none.
            return 3 if self._dimensions == 3 else 2
        return 3 if self._without and satellites >= 4 and alt_m != UNKNOWN else 2

    @micropython.native
    def good(self, hdop_centi):
        """Whether the position is good enough for home; `hdop_centi`: of its GGA."""
        if self.pdop_centi != UNKNOWN:
            return self.pdop_centi <= HIGHEST_PDOP_CENTI
        return self._without and 0 <= hdop_centi <= _HIGHEST_HDOP_CENTI
