"""`Telemetry`: what the sensors measure and MSP answers, one frame for each free slot.

Runs in the main loop; the slot's state machine does what has to be on time.
"""

from micropython import const

from firmware.interrupts import LINKED
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


class Telemetry:
    """Fills the slot of an adapter from the sensors that it is given, and answers MSP.

    `sensors`: {name: sensor}, of `battery`, `gps`, `barometer`, `magnetometer` those that there
    are. Their values also go into `state`, from which `responder` answers.
    """

    def __init__(self, adapter, sensors, state, responder):
        self._control = adapter.control
        self._receiver = adapter.receiver
        self._state = state
        self._responder = responder
        self._schedule = Schedule()
        self._frame = bytearray(14)
        self._chunk = bytearray(telemetry.MSP_CHUNK_SIZE)
        self._payload = bytearray(10)
        self._since_ms = 0
        self._battery = sensors.get("battery")
        self._gps = sensors.get("gps")
        self._barometer = sensors.get("barometer")
        self._magnetometer = sensors.get("magnetometer")
        add = self._schedule.add
        if self._battery:
            self._pack = add(TYPE_PACK_STATUS, _TIMEOUT_MS)
        if self._gps:
            self._position = add(TYPE_GPS_PRIMARY, _GPS_TIMEOUT_MS)
            self._motion = add(TYPE_GPS_SECONDARY, _GPS_TIMEOUT_MS)
        if self._barometer or self._magnetometer:
            self._mag_baro = add(TYPE_MAG_BARO, _TIMEOUT_MS)
        self.steps = self._steps()

    def _steps(self):
        steps = []
        for sensor, step in (
            (self._battery, self._update_battery),
            (self._gps, self._update_gps),
            (self._barometer, self._update_barometer),
            (self._magnetometer, self._update_magnetometer),
        ):
            if sensor:
                steps.append(step)
        steps += (self._listen, self._fill_slot)
        return steps

    def _update_battery(self, now_ms):
        battery = self._battery
        if not battery.update(now_ms):
            return
        if battery.present or battery.current_ma is not None:
            self._pack.refresh(now_ms)
        else:
            self._pack.stop()
        state = self._state
        state.voltage_mv = battery.voltage_mv
        state.current_ma = battery.current_ma
        state.consumed_mah = battery.consumed_mah
        state.cell_count = battery.cell_count
        state.battery_state = battery.state

    def _update_gps(self, now_ms):
        gps = self._gps
        if gps.update(now_ms):
            state = self._state
            state.gps_fix = gps.fix
            state.satellites = gps.satellites
            state.latitude_e7 = gps.lat_e7
            state.longitude_e7 = gps.lon_e7
            state.gps_alt_m = gps.alt_m
            state.speed_cm_s = gps.speed_cm_s
            state.course_decideg = gps.course_decideg
            state.pdop_centi = gps.pdop_centi
            state.home_distance_m = gps.home_distance_m
            state.home_direction_decideg = gps.home_direction_decideg
            state.gps_updates = gps.updates
            if gps.fix:
                self._position.refresh(now_ms)
                self._motion.refresh(now_ms)
        if not gps.fix:
            self._state.gps_fix = False
            self._position.stop()
            self._motion.stop()

    def _update_barometer(self, now_ms):
        barometer = self._barometer
        if barometer.update(now_ms) and barometer.altitude_cm is not None:
            self._mag_baro.refresh(now_ms)
        self._state.altitude_cm = barometer.altitude_cm
        self._state.vario_cm_s = barometer.vario_cm_s

    def _update_magnetometer(self, now_ms):
        magnetometer = self._magnetometer
        if magnetometer.update(now_ms) and magnetometer.heading_decideg is not None:
            self._mag_baro.refresh(now_ms)
        self._state.heading_decideg = magnetometer.heading_decideg

    def _listen(self, now_ms):
        """Hands the MSP requests over that came since the last round."""
        while self._receiver.next_msp(self._payload):
            self._responder.feed(self._payload)

    def _fill_slot(self, now_ms):
        control = self._control
        if control.link != LINKED:
            self._responder.discard()
            control.discard()
            return
        if not control.slot_free:
            if ticks_diff(now_ms, self._since_ms) > _WAIT_MS:
                control.discard()
            return
        kind = self._schedule.next(now_ms, self._responder.reply.pending)
        if kind:
            self._build(kind)
            self._since_ms = now_ms
            control.send(self._frame)

    def _build(self, kind):
        frame = self._frame
        if kind == TYPE_MSP_RESPONSE:
            self._responder.next_chunk(self._chunk)
            telemetry.msp_response(frame, self._chunk)
        elif kind == TYPE_PACK_STATUS:
            battery = self._battery
            telemetry.pack_status(
                frame,
                battery.voltage_mv or 0,
                battery.current_ma or 0,
                battery.consumed_mah or 0,
                self._state.armed,
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
                gps.home_fix,
            )
        else:
            self._build_mag_baro(frame)

    def _build_mag_baro(self, frame):
        state = self._state
        heading = state.heading_decideg
        if heading is not None and heading > 1800:
            heading -= 3600
        altitude = state.altitude_cm
        if altitude is not None:
            altitude = (altitude + 50) // 100
        telemetry.mag_baro(frame, heading, altitude, state.vario_cm_s)
