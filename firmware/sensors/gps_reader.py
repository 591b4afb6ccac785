"""Reads a GPS receiver for `firmware.sensors.gps.Gps`: from bytes to its values."""

from array import array

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython, ptr32

from firmware.sensors.gps_port import GpsPort
from firmware.sensors.gps_solution import (
    ALT_M,
    COURSE_DECIDEG,
    FIX,
    GOOD,
    LAT_E7,
    PDOP_CENTI,
    SATELLITES,
    SPEED_CM_S,
    UNKNOWN,
    empty,
)
from firmware.sensors.gps_stream import NONE, SENTENCE
from firmware.sensors.nmea import Nmea
from firmware.sensors.ubx import ACK_ACK, NAV_PVT
from ghst.schedule import ticks_diff

# In one update: more would take the RP2040 longer than 2 ms.
_MOST_FRAMES = const(8)

_CHECK_MS = const(20)  # everything but reading
_FIX_MS = const(2000)  # a solution is good for so long
_PVT_MS = const(2000)  # so soon after NAV-PVT, NMEA does not count

_GOOD_FOR_HOME = const(5)  # solutions in a row: the first ones jump about
_COUNTER_MASK = const(0x3FFFFFFF)


@micropython.viper
def _copy(source: ptr32, at: int, target: ptr32, to: int):
    target[to] = source[at]
    target[to + 1] = source[at + 1]


class GpsReader:
    """The port, the sentences and frames that come there, and the set-up of a u-blox."""

    def __init__(self, gps, uart, configure):
        """`gps`: the `Gps` whose values are written; `configure`: whether a u-blox is set up."""
        self._gps = gps
        self._uart = uart
        self.port = GpsPort(uart)
        self._configure = configure
        # UBX, the set-up and the way home are loaded for the first receiver that is found.
        self._ubx = self._setup = self._way_home = None
        self._connected = False
        self._solution = empty()
        self._nmea = Nmea(self._solution)
        self._to_home = array("i", (0, 0))
        self._pvt_ms = self._checked_ms = self._solution_ms = 0
        self._fresh = False
        self._good = 0  # solutions in a row

    @micropython.native
    def update(self, now_ms):
        """See `Gps.update`."""
        port = self.port
        if port.stale:
            port.retune(now_ms)
            return False
        new = False
        if port.receive():
            for _ in range(_MOST_FRAMES):
                kind = port.next(now_ms)
                if kind == NONE:
                    break
                if self._take(kind, now_ms):
                    new = True
                    break
        if (now_ms - self._checked_ms) & _COUNTER_MASK >= _CHECK_MS:
            self._checked_ms = now_ms
            self._check(now_ms)
        return new

    @micropython.native
    def _check(self, now_ms):
        port = self.port
        self._fault(port.check(now_ms) + self._nmea.take_errors())
        self._gps.baudrate = port.baudrate
        if port.baudrate is None:
            if self._connected:
                self._disconnect()
        elif self._setup is not None:
            baudrate = self._setup.update(now_ms)
            if baudrate:
                port.change(baudrate)
        if self._fresh and ticks_diff(now_ms, self._solution_ms) > _FIX_MS:
            self._fresh = False
            self._good = 0
            self._gps.forget()

    def _fault(self, count):
        self._gps.faults = (self._gps.faults + count) & _COUNTER_MASK

    def _load(self):
        from firmware.sensors import ubx
        from firmware.sensors.geodesy import distance_and_direction

        self._ubx = ubx
        self._way_home = distance_and_direction
        if self._configure:
            from firmware.sensors.gps_setup import UbloxSetup

            self._setup = UbloxSetup(self._uart)

    @micropython.native
    def _take(self, kind, now_ms):
        port = self.port
        gps = self._gps
        if self._ubx is None:
            self._load()
        setup = self._setup
        if setup is not None:
            if not self._connected:
                setup.start(port.baudrate, now_ms)
            setup.heard = True
        self._connected = True
        gps.baudrate = port.baudrate
        if kind == SENTENCE:
            if gps.protocol == "UBX" and ticks_diff(now_ms, self._pvt_ms) <= _PVT_MS:
                return False
            if not self._nmea.feed(port.frame, port.length, now_ms):
                return False
            if gps.protocol == "UBX" and setup is not None and not setup.busy:
                # It has forgotten what it was told: its supply was interrupted.
                setup.start(port.baudrate, now_ms)
            gps.protocol = "NMEA"
        else:
            ubx = self._ubx
            name = ubx.name(port.frame)
            if name != NAV_PVT:
                if name == ACK_ACK and setup is not None:
                    setup.acknowledged = True
                return False
            if not ubx.read_pvt(port.frame, port.length, self._solution):
                self._fault(1)
                return False
            self._pvt_ms = now_ms
            gps.protocol = "UBX"
            if setup is not None:
                setup.navigating = True
        self._publish(now_ms)
        return True

    @micropython.native
    def _publish(self, now_ms):
        gps = self._gps
        solution = self._solution
        fix = solution[FIX]
        gps.fix = fix > 0
        gps.fix_3d = fix == 3
        gps.alt_m = _known(solution[ALT_M])
        gps.speed_cm_s = _known(solution[SPEED_CM_S])
        gps.course_decideg = _known(solution[COURSE_DECIDEG])
        gps.satellites = _known(solution[SATELLITES])
        gps.pdop_centi = _known(solution[PDOP_CENTI])
        gps.updates = (gps.updates + 1) & _COUNTER_MASK
        self._fresh = True
        self._solution_ms = now_ms
        points = gps.points
        if fix:
            _copy(solution, LAT_E7, points, 0)
        if not solution[GOOD] or solution[SATELLITES] < gps.minimum_satellites:
            self._good = 0
        elif self._good < _GOOD_FOR_HOME:
            self._good += 1
        if self._good == _GOOD_FOR_HOME and gps.takes_home and not gps.home_fix:
            _copy(points, 0, points, 2)
            gps.home_fix = True
        if fix and gps.home_fix:
            self._way_home(points, self._to_home)
            gps.home_distance_m = self._to_home[0]
            gps.home_direction_decideg = self._to_home[1]
        else:
            gps.home_distance_m = gps.home_direction_decideg = None

    def _disconnect(self):
        self._connected = False
        self._gps.protocol = None
        self._nmea.reset()
        if self._setup is not None:
            self._setup.stop()


@micropython.native
def _known(value):
    return None if value == UNKNOWN else value
