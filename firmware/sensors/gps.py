"""A GPS receiver on a UART: its position, its motion and the way home.

    uart = machine.UART(0, tx=0, rx=1)
    gps = Gps(uart)
    if gps.update(time.ticks_ms()) and gps.fix:
        telemetry.gps_primary(frame, gps.lat_e7, gps.lon_e7, gps.alt_m)

Finds the baud rate by itself, reads NMEA or UBX, and sets a u-blox up for ten solutions a second.
"""

from array import array

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython, ptr32

from firmware.sensors import ubx
from firmware.sensors.geodesy import distance_and_direction
from firmware.sensors.gps_port import GpsPort
from firmware.sensors.gps_setup import UbloxSetup
from firmware.sensors.gps_solution import (
    ALT_M,
    COURSE_DECIDEG,
    FIX,
    LAT_E7,
    PDOP_CENTI,
    SATELLITES,
    SPEED_CM_S,
    UNKNOWN,
    empty,
)
from firmware.sensors.gps_stream import NONE, SENTENCE
from firmware.sensors.nmea import Nmea
from ghst.schedule import ticks_diff

# In one update: more would take the RP2040 longer than 2 ms.
_MOST_FRAMES = const(8)

_CHECK_MS = const(20)  # everything but reading
_FIX_MS = const(2000)  # a solution is good for so long
_PVT_MS = const(2000)  # so soon after NAV-PVT, NMEA does not count

_HIGHEST_HOME_PDOP_CENTI = const(500)
_COUNTER_MASK = const(0x3FFFFFFF)


@micropython.viper
def _copy(source: ptr32, at: int, target: ptr32, to: int):
    target[to] = source[at]
    target[to + 1] = source[at + 1]


class Gps:
    """A GPS receiver; a sensor as `firmware.sensors` describes it.

    Of the last solution, None where not known, all None without a fix but for `satellites` and
    `pdop_centi`: `lat_e7`, `lon_e7` (1e-7 degrees), `alt_m` (above mean sea level), `speed_cm_s`
    and `course_decideg` (0..3599) over ground, `satellites`, `pdop_centi` (0.01).
    `fix`: whether there is a position now, at most 2 s old; `fix_3d`: in three dimensions.
    `home_fix`: whether home is known; `home_distance_m`, `home_direction_decideg` (0..3599, where
    home lies seen from here). Home is the first position in three dimensions from enough
    satellites, not above a PDOP of 5.00.
    `updates`: solutions so far, `faults`: sentences and frames that were broken or made no sense,
    and how often the receiver was lost, both modulo 2^30. `baudrate`: None while it is searched
    for; `protocol`: "NMEA", "UBX", None before the first solution.

    `update` allocates nothing but for a new baud rate and the messages of the set-up; to read
    `lon_e7` allocates beyond 107 degrees.
    """

    def __init__(self, uart, *, minimum_satellites=6, configure=True):
        """Takes the UART over and begins to listen.

        `uart`: a `machine.UART`; its baud rate and its buffers are set here. `minimum_satellites`
        for home: 4..32. `configure`: whether a u-blox is set up. Raises `ValueError`.
        """
        if not 4 <= minimum_satellites <= 32:
            raise ValueError(f"minimum_satellites is {minimum_satellites}, must be 4..32")
        self._minimum_satellites = minimum_satellites
        self._port = GpsPort(uart)
        self._setup = UbloxSetup(uart) if configure else None
        self._connected = False
        self._solution = empty()
        self._nmea = Nmea(self._solution)
        # From here to home: the current position, and that of home.
        self._points = array("i", (0, 0, 0, 0))
        self._to_home = array("i", (0, 0))
        self.updates = self.faults = 0
        self.home_fix = False
        self.protocol = None
        self._pvt_ms = self._checked_ms = 0
        self._forget()

    @property
    def baudrate(self):
        """Bits a second; None while it is searched for."""
        return self._port.baudrate

    @property
    def lat_e7(self):
        """Latitude in 1e-7 degrees, north positive."""
        return self._points[0] if self.fix else None

    @property
    def lon_e7(self):
        """Longitude in 1e-7 degrees, east positive."""
        return self._points[1] if self.fix else None

    @micropython.native
    def update(self, now_ms):
        """Takes what has come; returns True once for each solution, with a fix or without.

        `now_ms`: from `time.ticks_ms()`. To be called every 20 ms or more often.
        """
        port = self._port
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

    def reset_home(self):
        """Forgets home: the next good position becomes it."""
        self.home_fix = False
        self.home_distance_m = self.home_direction_decideg = None

    def describe(self):
        """Returns one line: fix, satellites, distance home, protocol and baud rate."""
        if self.baudrate is None:
            return f"no receiver found, listening at {self._port.listening} baud"
        text = "3D fix" if self.fix_3d else "2D fix" if self.fix else "no fix"
        if self.satellites is not None:
            text += f", {self.satellites} satellites"
        if self.home_distance_m is not None:
            text += f", home {self.home_distance_m} m"
        return f"{text}, {self.protocol or 'no solution'} at {self.baudrate} baud"

    @micropython.native
    def _check(self, now_ms):
        port = self._port
        self._fault(port.check(now_ms) + self._nmea.take_errors())
        if port.baudrate is None:
            if self._connected:
                self._disconnect()
        elif self._setup is not None:
            baudrate = self._setup.update(now_ms)
            if baudrate:
                port.change(baudrate)
        if self._fresh and ticks_diff(now_ms, self._solution_ms) > _FIX_MS:
            self._forget()

    def _fault(self, count):
        self.faults = (self.faults + count) & _COUNTER_MASK

    @micropython.native
    def _take(self, kind, now_ms):
        port = self._port
        setup = self._setup
        if setup is not None:
            if not self._connected:
                setup.start(port.baudrate, now_ms)
            setup.heard = True
        self._connected = True
        if kind == SENTENCE:
            if self.protocol == "UBX" and ticks_diff(now_ms, self._pvt_ms) <= _PVT_MS:
                return False
            if not self._nmea.feed(port.frame, port.length, now_ms):
                return False
            if self.protocol == "UBX" and setup is not None and not setup.busy:
                # It has forgotten what it was told: its supply was interrupted.
                setup.start(port.baudrate, now_ms)
            self.protocol = "NMEA"
        else:
            name = ubx.name(port.frame)
            if name != ubx.NAV_PVT:
                if name == ubx.ACK_ACK and setup is not None:
                    setup.acknowledged = True
                return False
            if not ubx.read_pvt(port.frame, port.length, self._solution):
                self._fault(1)
                return False
            self._pvt_ms = now_ms
            self.protocol = "UBX"
            if setup is not None:
                setup.navigating = True
        self._publish(now_ms)
        return True

    @micropython.native
    def _publish(self, now_ms):
        solution = self._solution
        fix = solution[FIX]
        self.fix = fix > 0
        self.fix_3d = fix == 3
        self.alt_m = _known(solution[ALT_M])
        self.speed_cm_s = _known(solution[SPEED_CM_S])
        self.course_decideg = _known(solution[COURSE_DECIDEG])
        self.satellites = _known(solution[SATELLITES])
        self.pdop_centi = _known(solution[PDOP_CENTI])
        self._fresh = True
        self._solution_ms = now_ms
        self.updates = (self.updates + 1) & _COUNTER_MASK
        if fix:
            _copy(solution, LAT_E7, self._points, 0)
        if (
            fix == 3
            and not self.home_fix
            and solution[SATELLITES] >= self._minimum_satellites
            and solution[PDOP_CENTI] <= _HIGHEST_HOME_PDOP_CENTI
        ):
            _copy(self._points, 0, self._points, 2)
            self.home_fix = True
        if fix and self.home_fix:
            distance_and_direction(self._points, self._to_home)
            self.home_distance_m = self._to_home[0]
            self.home_direction_decideg = self._to_home[1]
        else:
            self.home_distance_m = self.home_direction_decideg = None

    def _forget(self):
        self.fix = self.fix_3d = self._fresh = False
        self.alt_m = self.speed_cm_s = self.course_decideg = None
        self.satellites = self.pdop_centi = None
        self.home_distance_m = self.home_direction_decideg = None

    def _disconnect(self):
        self._connected = False
        self.protocol = None
        self._nmea.reset()
        if self._setup is not None:
            self._setup.stop()


@micropython.native
def _known(value):
    return None if value == UNKNOWN else value
