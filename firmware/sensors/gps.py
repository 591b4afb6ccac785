"""A GPS receiver on a UART: its position, its motion and the way home.

    uart = machine.UART(0, tx=0, rx=1)
    gps = Gps(uart)
    if gps.update(time.ticks_ms()) and gps.fix:
        telemetry.gps_primary(frame, gps.lat_e7, gps.lon_e7, gps.alt_m)

Finds the baud rate by itself, reads NMEA or UBX, and sets a u-blox up for ten solutions a second.
What does that (`firmware.sensors.gps_reader`) is loaded when something comes from the receiver.
"""

import sys
from array import array

try:
    from micropython import const
except ImportError:
    from ghst._host import const

from firmware.sensors.gps_port import SLOWEST

# So long as nothing comes, in bytes; what comes then is dropped when the reader takes over.
_RXBUF = const(64)
_TXBUF = const(32)


class Gps:
    """A GPS receiver; a sensor as `firmware.sensors` describes it.

    Of the last solution, None where not known, all None without a fix but for `satellites` and
    `pdop_centi`: `lat_e7`, `lon_e7` (1e-7 degrees), `alt_m` (above mean sea level), `speed_cm_s`
    and `course_decideg` (0..3599) over ground, `satellites`, `pdop_centi` (0.01).
    `fix`: whether there is a position now, at most 2 s old; `fix_3d`: in three dimensions.
    `home_fix`: whether home is known; `home_distance_m`, `home_direction_decideg` (0..3599, where
    home lies seen from here). Home is the last of the first five good positions in a row: in
    three dimensions, from enough satellites, not above a PDOP of 5.00, and with UBX not less
    exact than 10 m. Of a receiver that tells no PDOP for seconds, HDOP counts, up to 2.50.
    `takes_home`: as given; home stays unknown while it is False.
    `updates`: solutions so far, `faults`: sentences and frames that were broken or made no sense,
    and how often the receiver was lost, both modulo 2^30. `baudrate`: None while it is searched
    for; `protocol`: "NMEA", "UBX", None before the first solution.

    But for the first time that something comes, `update` allocates nothing but for a new baud
    rate and the messages of the set-up; to read `lon_e7` allocates beyond 107 degrees.
    """

    def __init__(self, uart, *, minimum_satellites=6, configure=True, takes_home=True):
        """Takes the UART over and begins to listen.

        `uart`: a `machine.UART`; its baud rate and its buffers are set here. `minimum_satellites`
        for home: 4..32. `configure`: whether a u-blox is set up. `takes_home`: whether the model
        is on the ground, so that home is where it is now. Raises `ValueError`.
        """
        if not 4 <= minimum_satellites <= 32:
            raise ValueError(f"minimum_satellites is {minimum_satellites}, must be 4..32")
        self.minimum_satellites = minimum_satellites
        self._configure = configure
        self._uart = uart
        self._reader = None
        # Here and home: latitude and longitude of each.
        self.points = array("i", (0, 0, 0, 0))
        self.updates = self.faults = 0
        self.home_fix = False
        self.takes_home = takes_home
        self.baudrate = self.protocol = None
        self.forget()
        # The ESP-IDF takes no buffer that is smaller than what the UART itself holds.
        rxbuf, txbuf = (256, 256) if sys.platform == "esp32" else (_RXBUF, _TXBUF)
        uart.init(baudrate=SLOWEST, bits=8, parity=None, stop=1, rxbuf=rxbuf, txbuf=txbuf)

    @property
    def lat_e7(self):
        """Latitude in 1e-7 degrees, north positive."""
        return self.points[0] if self.fix else None

    @property
    def lon_e7(self):
        """Longitude in 1e-7 degrees, east positive."""
        return self.points[1] if self.fix else None

    def update(self, now_ms):
        """Takes what has come; returns True once for each solution, with a fix or without.

        `now_ms`: from `time.ticks_ms()`. To be called every 20 ms or more often.
        """
        if self._reader:
            return self._reader.update(now_ms)
        # At the slowest baud rate something is heard of every sender.
        if self._uart.any():
            from firmware.sensors.gps_reader import GpsReader

            self._reader = GpsReader(self, self._uart, self._configure)
        return False

    def forget(self):
        """Makes what a solution has None, and `fix` False."""
        self.fix = self.fix_3d = False
        self.alt_m = self.speed_cm_s = self.course_decideg = None
        self.satellites = self.pdop_centi = None
        self.home_distance_m = self.home_direction_decideg = None

    def reset_home(self):
        """Forgets home: the next good position becomes it, in the air, too."""
        self.home_fix = False
        self.takes_home = True
        self.home_distance_m = self.home_direction_decideg = None

    def describe(self):
        """Returns one line: fix, satellites, distance home, protocol and baud rate."""
        if self._reader is None:
            return "nothing comes from a receiver"
        if self.baudrate is None:
            return f"no receiver found, listening at {self._reader.port.listening} baud"
        text = "3D fix" if self.fix_3d else "2D fix" if self.fix else "no fix"
        if self.satellites is not None:
            text += f", {self.satellites} satellites"
        if self.home_distance_m is not None:
            text += f", home {self.home_distance_m} m"
        elif not self.takes_home:
            text += ", no home: restarted by the watchdog"
        return f"{text}, {self.protocol or 'no solution'} at {self.baudrate} baud"
