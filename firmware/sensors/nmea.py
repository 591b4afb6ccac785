"""Reads NMEA sentences: GGA, RMC, VTG and GSA of any satellite system, and what they say together.

    nmea = Nmea(solution)
    if nmea.feed(sentence, length, now_ms):     # what stands between $ and *
        ...                                     # a whole new solution

Integers only, and nothing allocates but `Nmea()`.
"""

from array import array

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython, ptr32

from firmware.sensors.gps_accuracy import Accuracy
from firmware.sensors.gps_solution import (
    ALT_M,
    COURSE_DECIDEG,
    FIX,
    GOOD,
    HIGHEST_ALT_M,
    LOWEST_ALT_M,
    PDOP_CENTI,
    SATELLITES,
    SPEED_CM_S,
)
from firmware.sensors.nmea_fields import (
    GGA,
    MOST_FIELDS,
    OTHER,
    RMC,
    UNKNOWN,
    VTG,
    WRONG,
    cm_s_from_knots,
    letter,
    number,
    position,
    split,
)
from ghst.schedule import ticks_diff

# VTG has no time: how long it stands for later solutions.
_FRESH_MS = const(2500)
# So many of one kind without the other: this receiver sends no other.
_ALONE = const(3)
_LARGEST_PDOP_CENTI = const(65535)
_HIGHEST_SPEED_KNOTS_E3 = const(1_943_844)  # 1000 m/s
_HIGHEST_SPEED_KM_H_E3 = const(3_600_000)


@micropython.viper
def _copy_position(source: ptr32, target: ptr32):
    target[1] = source[0]
    target[2] = source[1]


class Nmea:
    """Joins the sentences of one moment to a solution.

    GGA and RMC of the same time make one, in either order; of a receiver that sends only one of
    them each is one. GSA tells two from three dimensions; of a receiver that sends none for
    seconds there are three from four satellites and an altitude on. VTG counts where RMC has no
    speed or course.
    """

    def __init__(self, solution):
        """`solution`: from `gps_solution.empty`, written whenever `feed` returns True."""
        self._errors = 0
        self._solution = solution
        self._accuracy = Accuracy()
        self._starts = bytearray(MOST_FIELDS + 1)
        self._gga_position = array("i", (0, 0))
        self._rmc_position = array("i", (0, 0))
        self.reset()

    def reset(self):
        """Forgets all sentences: what comes next is another receiver."""
        self._gga_waits = self._gga_fix = False
        self._rmc_waits = self._rmc_fix = False
        self._gga_alone = self._rmc_alone = 0
        self._gga_time = self._rmc_time = UNKNOWN
        self._alt_m = self._satellites = self._hdop_centi = UNKNOWN
        self._speed_cm_s = self._course_decideg = UNKNOWN
        self._vtg_known = False
        self._vtg_ms = 0
        self._vtg_speed_cm_s = self._vtg_course_decideg = UNKNOWN
        self._accuracy.reset()

    @micropython.native
    def feed(self, sentence, length, now_ms):
        """Takes a sentence, the `length` characters between $ and *; `now_ms` from `ticks_ms`.

        Returns True when the solution is new and complete.
        """
        found = split(sentence, length, self._starts)
        kind = found & 7
        fields = found >> 3
        if kind == OTHER:
            return False
        if kind == GGA:
            ok = fields >= 10 and self._read_gga(sentence)
            self._gga_waits = ok
        elif kind == RMC:
            ok = fields >= 10 and self._read_rmc(sentence, fields)
            self._rmc_waits = ok
        elif kind == VTG:
            ok = fields >= 8 and self._read_vtg(sentence)
            self._vtg_known = ok
            self._vtg_ms = now_ms
        else:
            ok = fields >= 16 and self._read_gsa(sentence, now_ms)
        if not ok:
            self._errors += 1
            return False
        return kind <= RMC and self._complete(kind, now_ms)

    def take_errors(self):
        """Returns how many sentences had fields that make no sense since the last call."""
        errors = self._errors
        self._errors = 0
        return errors

    @micropython.native
    def _complete(self, kind, now_ms):
        if self._gga_waits and self._rmc_waits and self._gga_time == self._rmc_time:
            self._gga_alone = self._rmc_alone = 0
        elif kind == GGA:
            self._rmc_waits = False
            self._rmc_alone = 0
            if self._gga_alone < _ALONE:
                self._gga_alone += 1
                return False
        else:
            self._gga_waits = False
            self._gga_alone = 0
            if self._rmc_alone < _ALONE:
                self._rmc_alone += 1
                return False
        self._publish(now_ms)
        self._gga_waits = self._rmc_waits = False
        return True

    @micropython.native
    def _publish(self, now_ms):
        solution = self._solution
        with_gga = self._gga_waits
        with_rmc = self._rmc_waits
        alt_m = self._alt_m if with_gga else UNKNOWN
        satellites = self._satellites if with_gga else UNKNOWN
        accuracy = self._accuracy
        fix = accuracy.dimensions(satellites, alt_m, now_ms)
        if (with_gga and not self._gga_fix) or (with_rmc and not self._rmc_fix):
            fix = 0
        solution[FIX] = fix
        if fix:
            _copy_position(self._gga_position if with_gga else self._rmc_position, solution)
        solution[ALT_M] = alt_m if fix else UNKNOWN
        solution[SATELLITES] = satellites
        solution[PDOP_CENTI] = accuracy.pdop_centi
        hdop_centi = self._hdop_centi if with_gga else UNKNOWN
        solution[GOOD] = fix == 3 and accuracy.good(hdop_centi)
        speed_cm_s = self._speed_cm_s if with_rmc else UNKNOWN
        course_decideg = self._course_decideg if with_rmc else UNKNOWN
        if self._vtg_known and ticks_diff(now_ms, self._vtg_ms) > _FRESH_MS:
            self._vtg_known = False
        if self._vtg_known:
            if speed_cm_s == UNKNOWN:
                speed_cm_s = self._vtg_speed_cm_s
            if course_decideg == UNKNOWN:
                course_decideg = self._vtg_course_decideg
        solution[SPEED_CM_S] = speed_cm_s if fix else UNKNOWN
        solution[COURSE_DECIDEG] = course_decideg if fix else UNKNOWN

    @micropython.native
    def _course(self, sentence, field):
        course_decideg = number(sentence, self._starts, field, 1)
        if course_decideg == 3600:
            return 0
        return _within(course_decideg, 0, 3599)

    @micropython.native
    def _read_gga(self, sentence):
        starts = self._starts
        where = position(sentence, starts, 2, self._gga_position)
        self._gga_time = number(sentence, starts, 1, 3)
        self._accuracy.moment(self._gga_time)
        quality = _within(number(sentence, starts, 6, 0), 0, 9)
        self._satellites = _within(number(sentence, starts, 7, 0), 0, 255)
        self._hdop_centi = number(sentence, starts, 8, 2)
        self._alt_m = _within(number(sentence, starts, 9, 0), LOWEST_ALT_M, HIGHEST_ALT_M)
        # 6 is dead reckoning, 7 typed in by hand, 8 a simulation.
        self._gga_fix = 1 <= quality <= 5
        if self._gga_fix and where == 0:
            return False
        return where >= 0 and min(self._gga_time, quality, self._satellites, self._alt_m) != WRONG

    @micropython.native
    def _read_rmc(self, sentence, fields):
        starts = self._starts
        where = position(sentence, starts, 3, self._rmc_position)
        self._rmc_time = number(sentence, starts, 1, 3)
        self._accuracy.moment(self._rmc_time)
        knots_e3 = _within(number(sentence, starts, 7, 3), 0, _HIGHEST_SPEED_KNOTS_E3)
        self._speed_cm_s = cm_s_from_knots(knots_e3) if knots_e3 >= 0 else knots_e3
        self._course_decideg = self._course(sentence, 8)
        status = letter(sentence, starts, 2)
        self._rmc_fix = status == 0x41
        if fields > 12:
            # Not valid, estimated, typed in by hand, a simulation.
            mode = letter(sentence, starts, 12)
            if mode == 0x4E or mode == 0x45 or mode == 0x4D or mode == 0x53:
                self._rmc_fix = False
        if (status != 0x41 and status != 0x56) or (self._rmc_fix and where == 0):
            return False
        return where >= 0 and min(self._rmc_time, knots_e3, self._course_decideg) != WRONG

    @micropython.native
    def _read_vtg(self, sentence):
        km_h_e3 = _within(number(sentence, self._starts, 7, 3), 0, _HIGHEST_SPEED_KM_H_E3)
        # A km/h is 250/9 cm/s.
        self._vtg_speed_cm_s = (km_h_e3 + 18) // 36 if km_h_e3 >= 0 else km_h_e3
        self._vtg_course_decideg = self._course(sentence, 1)
        return min(km_h_e3, self._vtg_course_decideg) != WRONG

    @micropython.native
    def _read_gsa(self, sentence, now_ms):
        dimensions = number(sentence, self._starts, 2, 0)
        pdop_centi = _within(number(sentence, self._starts, 15, 2), 0, _LARGEST_PDOP_CENTI)
        if not 1 <= dimensions <= 3 or pdop_centi == WRONG:
            return False
        self._accuracy.add(dimensions, pdop_centi, now_ms)
        return True


@micropython.native
def _within(value, lowest, highest):
    if value == UNKNOWN or lowest <= value <= highest:
        return value
    return WRONG
