"""`State`: the values that `ghst.msp_commands` answers with."""

from ghst import __version__

VTX_TYPE_MSP = 5
VTX_TYPE_NONE = 0xFF


class State:
    """The values that go out; the application writes them, all are integers unless said.

    None means not known or no such sensor: it goes out as 0, and STATUS names no sensor for it.

    Identity: `craft_name`, `board_identifier` (4 letters), `target_name`, `board_name`,
    `manufacturer_id`, `build_date` ("Jan 31 2025"), `build_time` ("23:59:59"), `build_revision`
    (7 letters), `uid` (up to 12 bytes), all bytes; `version` (major, minor, patch).

    Control: `pulses`, a sequence of up to 16 channels in quarter microseconds, such as
    `Receiver.pulses` (0 = never received); `armed` bool; `rssi_percent` 0..100;
    `cycle_time_us`; `load_percent` 0..100; `i2c_errors`.

    Battery: `voltage_mv`, `current_ma` (negative: charging), `consumed_mah`, `capacity_mah`,
    `cell_count`, `battery_state` (0 good, 1 warning, 2 critical, 3 not present, 4 starting).

    GPS: `gps_fix` bool, `satellites`, `latitude_e7`, `longitude_e7` (1e-7 degrees), `gps_alt_m`,
    `speed_cm_s`, `course_decideg` 0..3599, `pdop_centi` (1/100), `home_distance_m`,
    `home_direction_decideg` 0..3599, `gps_updates` (counts solutions; its lowest bit goes out).

    Attitude: `heading_decideg`, -1800..3599, `roll_decideg`, `pitch_decideg`, `altitude_cm`,
    `vario_cm_s`.

    Video transmitter: `vtx_type` (3 SmartAudio, 4 Tramp, 5 MSP, 255 none), `vtx_band` and
    `vtx_channel` from 1 (band 0: the frequency counts), `vtx_power` (a step, not mW),
    `vtx_pit_mode` bool, `vtx_freq_mhz` (0 = the band's, not known here), `vtx_ready` bool,
    `vtx_low_power_disarm` 0..2, `vtx_pit_freq_mhz`.
    """

    def __init__(self):
        """Knows nothing but the version of this library."""
        self.craft_name = self.target_name = self.board_name = self.manufacturer_id = b""
        self.board_identifier = self.build_date = self.build_time = b""
        self.build_revision = self.uid = b""
        self.version = tuple(int(part) for part in __version__.split("."))
        self.pulses = ()
        self.armed = False
        self.rssi_percent = self.cycle_time_us = self.load_percent = self.i2c_errors = 0
        self.voltage_mv = self.current_ma = self.consumed_mah = self.capacity_mah = None
        self.cell_count = None
        self.battery_state = 3
        self.gps_fix = False
        self.satellites = self.latitude_e7 = self.longitude_e7 = self.gps_alt_m = None
        self.speed_cm_s = self.course_decideg = self.pdop_centi = None
        self.home_distance_m = self.home_direction_decideg = None
        self.gps_updates = 0
        self.heading_decideg = self.roll_decideg = self.pitch_decideg = None
        self.altitude_cm = self.vario_cm_s = None
        self.vtx_type = VTX_TYPE_MSP
        self.vtx_band = self.vtx_channel = self.vtx_power = self.vtx_freq_mhz = 0
        self.vtx_pit_mode = self.vtx_ready = False
        self.vtx_low_power_disarm = self.vtx_pit_freq_mhz = 0
