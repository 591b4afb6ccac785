"""A `Gps`, its UART and a main loop, in simulated time: what the GPS tests on CPython share."""

from __future__ import annotations

from firmware.sensors.gps import Gps
from simulated_uart import Clock, SimulatedUart

from ghst_tools.emulator.gps import NmeaGps, UbloxGps
from ghst_tools.emulator.gps_messages import Place

HERE = Place(47.3769052, 8.5417231, 431.987, 12.344, 271.26)
BAUDRATES = (9600, 38400, 57600, 115200)


class Bench:
    """A `Gps`, its UART, and a main loop that comes round every `round_ms`."""

    def __init__(self, *, round_ms: float = 4.0, start_ms: int = 0, **options: object) -> None:
        self.clock = Clock()
        self.uart = SimulatedUart(self.clock)
        self.gps = Gps(self.uart, **options)
        self.round_ms = round_ms
        self.start_ms = start_ms
        self.place = HERE
        self.solutions = 0

    def path(self, t_ns: float) -> Place:
        return self.place

    def nmea(self, **options: object) -> NmeaGps:
        receiver = NmeaGps(self.uart, self.clock, self.path, **options)
        receiver.start()
        return receiver

    def ublox(self, **options: object) -> UbloxGps:
        receiver = UbloxGps(self.uart, self.clock, self.path, **options)
        receiver.start()
        return receiver

    @property
    def now_ms(self) -> int:
        return (self.start_ms + round(self.clock.nanos / 1e6)) & 0x3FFFFFFF

    def round(self) -> bool:
        self.clock.run_until(self.clock.nanos + self.round_ms * 1e6)
        new = self.gps.update(self.now_ms)
        self.solutions += new
        return new

    def run(self, seconds: float) -> None:
        end = self.clock.nanos + seconds * 1e9
        while self.clock.nanos < end:
            self.round()

    def until(self, what: str, limit_s: float) -> float:
        """Run until the expression `what` holds of `gps`; returns how many seconds it took."""
        start = self.clock.nanos
        while not eval(what, {"gps": self.gps}):
            assert self.clock.nanos - start < limit_s * 1e9, f"{what}: {self.gps.describe()}"
            self.round()
        return (self.clock.nanos - start) / 1e9


def values(gps: Gps) -> tuple[object, ...]:
    return (
        *(gps.fix, gps.fix_3d, gps.lat_e7, gps.lon_e7, gps.alt_m, gps.speed_cm_s),
        *(gps.course_decideg, gps.satellites, gps.pdop_centi),
    )


NMEA_VALUES = (True, True, 473769052, 85417232, 432, 1234, 2713, 12, 140)
UBX_VALUES = (True, True, 473769052, 85417231, 432, 1234, 2713, 12, 140)
NOTHING = (False, False, None, None, None, None, None, None, None)
