"""`Telemetry`: what the sensors measure and MSP answers, one frame for each free slot.

Runs in the main loop; the slot's state machine does what has to be on time.
"""

from micropython import const

from firmware.limits import LINKED
from ghst import telemetry
from ghst.protocol import (
    TYPE_GPS_PRIMARY,
    TYPE_GPS_SECONDARY,
    TYPE_MAG_BARO,
    TYPE_MSP_RESPONSE,
    TYPE_PACK_STATUS,
)
from ghst.schedule import Schedule, ticks_diff

# The slowest sensor gives ten values a second: what is this old has fallen silent.
_TIMEOUT_MS = const(1000)
_GPS_TIMEOUT_MS = const(2000)
# A frame that has not found its slot in this time (five frames of Long Range) tells the past.
_WAIT_MS = const(260)
_COUNTER_MASK = const(0x3FFFFFFF)


class Telemetry:
    """Fills the slot of an adapter from the sensors that are added, and with MSP's answers.

    `armed`, set from outside: whether motors may turn, for the pilot's radio. `expired`: frames
    that have found no slot in time and were thrown away, modulo 2^30.
    """

    def __init__(self, adapter, msp):
        """Has no sensors yet; `msp`: a `firmware.msp.Msp`."""
        self.armed = False
        self.expired = 0
        self._control = adapter.control
        self._receiver = adapter.receiver
        self._msp = msp
        self._schedule = Schedule()
        self._frame = bytearray(14)
        self._chunk = bytearray(telemetry.MSP_CHUNK_SIZE)
        self._payload = bytearray(10)
        self._since_ms = 0
        self._battery = self._gps = self._barometer = self._magnetometer = None
        self._pack = self._position = self._motion = self._mag_baro = None

    def add(self, name, sensor):
        """Takes a sensor: `battery`, `gps`, `barometer` or `magnetometer`.

        Returns what the main loop has to call for it in every round, with the time in ms.
        """
        add = self._schedule.add
        if name == "battery":
            self._battery = sensor
            self._pack = add(TYPE_PACK_STATUS, _TIMEOUT_MS)
            return self._update_battery
        if name == "gps":
            self._gps = sensor
            self._position = add(TYPE_GPS_PRIMARY, _GPS_TIMEOUT_MS)
            self._motion = add(TYPE_GPS_SECONDARY, _GPS_TIMEOUT_MS)
            return self._update_gps
        if self._mag_baro is None:
            self._mag_baro = add(TYPE_MAG_BARO, _TIMEOUT_MS)
        if name == "barometer":
            self._barometer = sensor
            return self._update_barometer
        self._magnetometer = sensor
        return self._update_magnetometer

    def update(self, now_ms):
        """Hands the MSP requests over that came, and a frame for the slot if that is free."""
        while self._receiver.next_msp(self._payload):
            self._msp.feed(self._payload)
        self._fill_slot(now_ms)

    def _update_battery(self, now_ms):
        battery = self._battery
        if battery.update(now_ms):
            if battery.present or battery.current_ma is not None:
                self._pack.refresh(now_ms)
            else:
                self._pack.stop()

    def _update_gps(self, now_ms):
        gps = self._gps
        new = gps.update(now_ms)
        if not gps.fix:
            # The radio would show the old position as a new one. 0x26 tells of the fix itself, and
            # how many satellites there are, for as long as solutions come.
            self._position.stop()
        elif new:
            self._position.refresh(now_ms)
        if new:
            self._motion.refresh(now_ms)

    def _update_barometer(self, now_ms):
        barometer = self._barometer
        if barometer.update(now_ms) and barometer.altitude_cm is not None:
            self._mag_baro.refresh(now_ms)

    def _update_magnetometer(self, now_ms):
        magnetometer = self._magnetometer
        if magnetometer.update(now_ms) and magnetometer.heading_decideg is not None:
            self._mag_baro.refresh(now_ms)

    def _fill_slot(self, now_ms):
        control = self._control
        if control.link != LINKED:
            self._msp.discard()
            control.discard()
            return
        if not control.slot_free:
            if ticks_diff(now_ms, self._since_ms) > _WAIT_MS:
                control.discard()
                self.expired = (self.expired + 1) & _COUNTER_MASK
            return
        kind = self._schedule.next(now_ms, self._msp.pending)
        if kind:
            self._build(kind)
            self._since_ms = now_ms
            control.send(self._frame)

    def _build(self, kind):
        frame = self._frame
        if kind == TYPE_MSP_RESPONSE:
            self._msp.next_chunk(self._chunk)
            telemetry.msp_response(frame, self._chunk)
        elif kind == TYPE_PACK_STATUS:
            battery = self._battery
            telemetry.pack_status(
                frame,
                battery.voltage_mv or 0,
                battery.current_ma or 0,
                battery.consumed_mah or 0,
                self.armed,
            )
        elif kind == TYPE_GPS_PRIMARY:
            gps = self._gps
            telemetry.gps_primary(frame, gps.lat_e7 or 0, gps.lon_e7 or 0, gps.alt_m or 0)
        elif kind == TYPE_GPS_SECONDARY:
            gps = self._gps
            telemetry.gps_secondary(
                frame,
                gps.speed_cm_s or 0,
                gps.course_decideg or 0,
                gps.satellites or 0,
                gps.home_distance_m or 0,
                gps.home_direction_decideg or 0,
                gps.fix,
                gps.fix and gps.home_fix,
            )
        else:
            self._build_mag_baro(frame)

    def _build_mag_baro(self, frame):
        heading = altitude = vario = None
        if self._magnetometer:
            heading = self._magnetometer.heading_decideg
            if heading is not None and heading > 1800:
                heading -= 3600
        if self._barometer:
            vario = self._barometer.vario_cm_s
            altitude = self._barometer.altitude_cm
            if altitude is not None:
                altitude = (altitude + 50) // 100
        telemetry.mag_baro(frame, heading, altitude, vario)
