"""What an `Application` answers over MSP: its state, and the commands that change something."""

import machine

from firmware import vtx
from ghst.msp import Responder
from ghst.msp_commands import answer
from ghst.msp_state import State

VTX_KEYS = (
    "vtx_band",
    "vtx_channel",
    "vtx_power",
    "vtx_pit_mode",
    "vtx_freq_mhz",
    "vtx_low_power_disarm",
    "vtx_pit_freq_mhz",
)


class Answers:
    """`state` and `responder`; `refresh` brings the former up to date with the sensors."""

    def __init__(self, application):
        self._application = application
        self.responder = Responder()
        self.state = state = State()
        name, craft_name, chip = application.identity
        state.board_name = state.target_name = name.encode()
        state.craft_name = craft_name.encode() or state.board_name
        state.board_identifier = chip[:4].upper().encode()
        state.uid = machine.unique_id()
        state.pulses = application.receiver.pulses
        if "battery" in application.search.waiting:
            state.capacity_mah = application.search.waiting["battery"][1][-1]
        for key in VTX_KEYS:
            setattr(state, key, application.vtx_settings[key])
        answer(self.responder, state, on_vtx=self._vtx_set, on_save=self._save)

    def refresh(self):
        """Takes what sensors and link say now into `state`; what nobody measures is left alone."""
        application = self._application
        state = self.state
        state.armed = application.telemetry.armed
        state.rssi_percent = application.receiver.rssi_percent
        state.cycle_time_us = application.cycle_time_us
        sensors = application.sensors
        if battery := sensors.get("battery"):
            state.capacity_mah = battery.capacity_mah
            state.voltage_mv = battery.voltage_mv
            state.current_ma = battery.current_ma
            state.consumed_mah = battery.consumed_mah
            state.cell_count = battery.cell_count
            state.battery_state = battery.state
        if gps := sensors.get("gps"):
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
        if barometer := sensors.get("barometer"):
            state.altitude_cm = barometer.altitude_cm
            state.vario_cm_s = barometer.vario_cm_s
        if magnetometer := sensors.get("magnetometer"):
            state.heading_decideg = magnetometer.heading_decideg

    def _vtx_set(self, state):
        application = self._application
        for key in VTX_KEYS:
            value = getattr(state, key)
            application.vtx_settings[key] = value
            application.settings.set("vtx", key, value)
        application.vtx_event(vtx.MSP)

    def _save(self):
        self._application.settings.request_save()
        return True
