"""The emulated aircraft: its battery, its way through the air, and the devices that measure them.

All quantities are functions of the emulated time in nanoseconds since power-on.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping
from typing import Any, NamedTuple

from ghst_tools.emulator import Board
from ghst_tools.emulator.gps import UbloxGps
from ghst_tools.emulator.gps_messages import Place
from ghst_tools.emulator.i2c_bmp280 import Bmp280
from ghst_tools.emulator.i2c_magnetometers import Qmc5883l
from ghst_tools.emulator.i2c_sensors import field_at, pressure_at

HOME_LAT_DEG, HOME_LON_DEG, HOME_ALT_M = 47.3, 8.5, 412.0
RADIUS_M = 100.0
SATELLITES = 14

_SPEED_M_S = 30.0
_CLIMB = 4.0 / _SPEED_M_S  # metres up for each metre flown
_START_COURSE_DEG = 90.0
_RUN_UP_S = 1.0  # from standstill to full speed
_EARTH_RADIUS_M = 6_371_009.0

_FULL_V, _V_PER_MAH, _OHM = 16.8, 0.02, 0.025
_IDLE_A, _FULL_A = 0.5, 30.0
_MAH_PER_A_NS = 1 / 3.6e9
_THROTTLE = 3
_LOWEST, _HIGHEST = 4000, 8000  # quarter microseconds

_FIRST_ADC_PIN = 26
_BMP280_ADDRESS, _QMC5883L_ADDRESS = 0x76, 0x0D
_AIR_C = 20.0
_SOLUTION_MS = 500


class _Load(NamedTuple):
    t_ns: float
    amps: float
    mah: float


class Aircraft:
    """Flies a climbing circle of 100 m radius from `takeoff_ns` on, to the left, home at its edge.

    Its battery, small for a flight of seconds, loses 0.02 V with each mAh and sags with the
    current, which follows the throttle, channel 3.
    """

    def __init__(self) -> None:
        self.takeoff_ns = math.inf
        self._loads = [_Load(0.0, _IDLE_A, 0.0)]

    def channels(self, t_ns: float, pulses: Mapping[int, int]) -> None:
        """Follow the channels received at `t_ns`, in quarter microseconds; in order of time."""
        throttle = (pulses.get(_THROTTLE, _LOWEST) - _LOWEST) / (_HIGHEST - _LOWEST)
        amps = _IDLE_A + (_FULL_A - _IDLE_A) * min(max(throttle, 0.0), 1.0)
        self._loads.append(_Load(t_ns, amps, self.consumed_mah(t_ns)))

    def amps(self, t_ns: float) -> float:
        """Current out of the battery."""
        return self._load(t_ns).amps

    def consumed_mah(self, t_ns: float) -> float:
        """Charge used since power-on."""
        load = self._load(t_ns)
        return load.mah + load.amps * (t_ns - load.t_ns) * _MAH_PER_A_NS

    def volts(self, t_ns: float) -> float:
        """Voltage of the battery."""
        return _FULL_V - _V_PER_MAH * self.consumed_mah(t_ns) - _OHM * self.amps(t_ns)

    def height_m(self, t_ns: float) -> float:
        """Height above home."""
        return _CLIMB * self._flown_m(t_ns)

    def climb_cm_s(self, t_ns: float) -> float:
        """Vertical speed, up positive."""
        return 100 * _CLIMB * self._speed_m_s(t_ns)

    def course_deg(self, t_ns: float) -> float:
        """Where it flies to and its nose points, 0..360."""
        return (_START_COURSE_DEG - math.degrees(self._flown_m(t_ns) / RADIUS_M)) % 360

    def place(self, t_ns: float) -> Place:
        """What a GPS receiver on it sees."""
        angle = self._flown_m(t_ns) / RADIUS_M
        north = math.degrees(RADIUS_M * (1 - math.cos(angle)) / _EARTH_RADIUS_M)
        east = math.degrees(RADIUS_M * math.sin(angle) / _EARTH_RADIUS_M)
        return Place(
            HOME_LAT_DEG + north,
            HOME_LON_DEG + east / math.cos(math.radians(HOME_LAT_DEG)),
            HOME_ALT_M + self.height_m(t_ns),
            self._speed_m_s(t_ns),
            self.course_deg(t_ns),
            SATELLITES,
        )

    def _load(self, t_ns: float) -> _Load:
        return self._loads[max(0, bisect_right(self._loads, t_ns, key=lambda load: load.t_ns) - 1)]

    def _speed_m_s(self, t_ns: float) -> float:
        return _SPEED_M_S * min(max((t_ns - self.takeoff_ns) / 1e9, 0.0) / _RUN_UP_S, 1.0)

    def _flown_m(self, t_ns: float) -> float:
        flown_s = max((t_ns - self.takeoff_ns) / 1e9, 0.0)
        if flown_s < _RUN_UP_S:
            return _SPEED_M_S * flown_s**2 / (2 * _RUN_UP_S)
        return _SPEED_M_S * (flown_s - _RUN_UP_S / 2)


def home_from(place: Place) -> tuple[float, float]:
    """Distance of home in metres and its direction in degrees, 0..360, seen from `place`."""
    north = math.radians(HOME_LAT_DEG - place.lat_deg)
    east = math.radians(HOME_LON_DEG - place.lon_deg) * math.cos(math.radians(HOME_LAT_DEG))
    return _EARTH_RADIUS_M * math.hypot(north, east), math.degrees(math.atan2(east, north)) % 360


class Devices:
    """What is connected to the board of the sensors that its `defaults` name."""

    def __init__(self, board: Board, aircraft: Aircraft, defaults: Mapping[str, Any]) -> None:
        self.gps: UbloxGps | None = None
        if (battery := defaults.get("battery")) is not None:
            divider, volts_per_a = battery["divider"], battery["current_mv_per_a"] / 1000
            board.adc(battery["voltage_pin"] - _FIRST_ADC_PIN).set_volts(
                lambda t_ns: aircraft.volts(t_ns) / divider
            )
            board.adc(battery["current_pin"] - _FIRST_ADC_PIN).set_volts(
                lambda t_ns: aircraft.amps(t_ns) * volts_per_a
            )
        if "gps" in defaults:
            # 9600 baud and NMEA: the firmware sets it up for 115200 and ten solutions a second.
            uart = board.uart(defaults["gps"]["uart"])
            self.gps = UbloxGps(uart, board.clock, aircraft.place, period_ms=_SOLUTION_MS)
            self.gps.start()
        if "barometer" in defaults:
            board.i2c(defaults["i2c"]["bus"]).attach(
                _BMP280_ADDRESS,
                Bmp280(
                    board,
                    lambda t_ns: pressure_at(HOME_ALT_M + aircraft.height_m(t_ns)),
                    lambda t_ns: _AIR_C,
                ),
            )
        if "magnetometer" in defaults:
            board.i2c(defaults["i2c"]["bus"]).attach(
                _QMC5883L_ADDRESS,
                Qmc5883l(board, lambda t_ns: field_at(aircraft.course_deg(t_ns))),
            )
