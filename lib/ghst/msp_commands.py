"""What a flight controller is asked over MSP, answered from a `ghst.msp_state.State`.

    state = State()
    responder = ghst.msp.Responder()
    answer(responder, state, on_vtx=..., on_save=...)
    state.voltage_mv = 16800

Layouts: the public MSP messages as Betaflight 4.3 and 4.4 send them at API version 1.44; where
iNav's are shorter, theirs are the beginning of these. An answer allocates nothing, as long as
texts are bytes and no callback allocates.
"""

API_VERSION = 1, 44
FC_VARIANT = b"GHMP"
MAX_CHANNELS = 16

_VTX_LAST_CODED = 63  # a frequency up to here codes band and channel, eight each
_VTX_LAST_MHZ = 5999
_LAST_LOW_POWER_DISARM = 2  # until it is armed first; 0: off, 1: always


def answer(responder, state, on_vtx=None, on_save=None):
    """Registers the answers below with a `ghst.msp.Responder`; returns the `Commands`.

    `on_vtx(state)` is called when a request has changed the `vtx_` values. `on_save()` is called
    for EEPROM_WRITE: True means that the configuration is saved, or will be when that is safe;
    False, or no `on_save` at all, is replied as an error.
    """
    commands = Commands(state, on_vtx, on_save)
    for number, handler in (
        (1, commands.api_version),
        (2, commands.fc_variant),
        (3, commands.fc_version),
        (4, commands.board_info),
        (5, commands.build_info),
        (10, commands.name),
        (88, commands.vtx_config),
        (89, commands.set_vtx_config),
        (101, commands.status),
        (105, commands.rc),
        (106, commands.raw_gps),
        (107, commands.comp_gps),
        (108, commands.attitude),
        (109, commands.altitude),
        (110, commands.analog),
        (130, commands.battery_state),
        (160, commands.uid),
        (250, commands.eeprom_write),
    ):
        responder.command(number, handler)
    return commands


def _divided(value, divisor):
    """Returns value / divisor to the nearest integer; None stays None."""
    return None if value is None else (value + divisor // 2) // divisor


class Commands:
    """The handlers; each writes one message."""

    def __init__(self, state, on_vtx=None, on_save=None):
        """Answers from `state`; the callbacks are described at `answer`."""
        self.state = state
        self.on_vtx = on_vtx
        self.on_save = on_save

    def api_version(self, request, reply):
        """1: MSP protocol 0, API major, minor."""
        reply.u8(0)
        reply.u8(API_VERSION[0])
        reply.u8(API_VERSION[1])

    def fc_variant(self, request, reply):
        """2: four letters that name the firmware."""
        reply.text(FC_VARIANT)

    def fc_version(self, request, reply):
        """3: major, minor, patch."""
        major, minor, patch = self.state.version
        reply.u8(major)
        reply.u8(minor)
        reply.u8(patch)

    def board_info(self, request, reply):
        """4: names of the board; what flight controllers have and this has not is 0."""
        state = self.state
        reply.text(state.board_identifier, 4)
        reply.u16(0)  # hardware revision
        reply.u8(0)  # a flight controller without OSD
        reply.u8(1)  # capabilities: a virtual COM port
        reply.counted_text(state.target_name)
        reply.counted_text(state.board_name)
        reply.counted_text(state.manufacturer_id)
        reply.text(b"", 32, 0)  # signature
        reply.u8(0xFF)  # MCU: not one of the list
        reply.u8(2)  # configured
        reply.u16(0)  # gyro sample rate
        reply.u32(0)  # configuration problems
        reply.u8(0)  # SPI devices
        reply.u8(0)  # I2C devices

    def build_info(self, request, reply):
        """5: date, time and revision, 11, 8 and 7 letters."""
        reply.text(self.state.build_date, 11)
        reply.text(self.state.build_time, 8)
        reply.text(self.state.build_revision, 7)

    def name(self, request, reply):
        """10: the craft's name."""
        reply.text(self.state.craft_name)

    def status(self, request, reply):
        """101: what runs; bit 0 of the modes is ARM."""
        state = self.state
        sensors = 0
        if state.altitude_cm is not None:
            sensors |= 2
        if state.heading_decideg is not None:
            sensors |= 4
        if state.satellites is not None:
            sensors |= 8
        reply.u16(state.cycle_time_us)
        reply.u16(state.i2c_errors)
        reply.u16(sensors)
        reply.u32(1 if state.armed else 0)
        reply.u8(0)  # profile
        reply.u16(state.load_percent)
        reply.u16(0)  # gyro cycle time
        reply.u8(0)  # bytes of further modes
        reply.u8(0)  # number of reasons not to arm
        reply.u32(0)  # those reasons
        reply.u8(0)  # no reboot required

    def rc(self, request, reply):
        """105: the channels in microseconds, in the receiver's order."""
        pulses = self.state.pulses
        for index in range(min(MAX_CHANNELS, len(pulses))):
            reply.u16(pulses[index] + 2 >> 2)

    def raw_gps(self, request, reply):
        """106: fix, satellites, position, altitude in m, cm/s, 0.1 degrees, PDOP."""
        state = self.state
        reply.u8(1 if state.gps_fix else 0)
        reply.u8(state.satellites)
        reply.s32(state.latitude_e7)
        reply.s32(state.longitude_e7)
        reply.u16(state.gps_alt_m)
        reply.u16(state.speed_cm_s)
        reply.u16(state.course_decideg)
        reply.u16(state.pdop_centi)

    def comp_gps(self, request, reply):
        """107: metres and whole degrees to home; a bit that changes with each solution."""
        state = self.state
        reply.u16(state.home_distance_m)
        reply.u16(_whole_degrees(state.home_direction_decideg))
        reply.u8((state.gps_updates or 0) & 1)

    def attitude(self, request, reply):
        """108: roll and pitch in 0.1 degrees, heading in whole degrees 0..359."""
        state = self.state
        reply.s16(state.roll_decideg)
        reply.s16(state.pitch_decideg)
        reply.s16(_whole_degrees(state.heading_decideg))

    def altitude(self, request, reply):
        """109: altitude in cm, vario in cm/s."""
        reply.s32(self.state.altitude_cm)
        reply.s16(self.state.vario_cm_s)

    def analog(self, request, reply):
        """110: 0.1 V, mAh, RSSI 0..1023, 0.01 A, 0.01 V."""
        state = self.state
        reply.u8(_divided(state.voltage_mv, 100))
        reply.u16(state.consumed_mah)
        reply.u16(_divided((state.rssi_percent or 0) * 1023, 100))
        reply.s16(_divided(state.current_ma, 10))
        reply.u16(_divided(state.voltage_mv, 10))

    def battery_state(self, request, reply):
        """130: cells, capacity in mAh, 0.1 V, mAh, 0.01 A, state, 0.01 V."""
        state = self.state
        reply.u8(state.cell_count)
        reply.u16(state.capacity_mah)
        reply.u8(_divided(state.voltage_mv, 100))
        reply.u16(state.consumed_mah)
        reply.s16(_divided(state.current_ma, 10))
        reply.u8(state.battery_state)
        reply.u16(_divided(state.voltage_mv, 10))

    def uid(self, request, reply):
        """160: twelve bytes that name the chip."""
        reply.text(self.state.uid, 12, 0)

    def eeprom_write(self, request, reply):
        """250: has the configuration saved."""
        return self.on_save is not None and bool(self.on_save())

    def vtx_config(self, request, reply):
        """88: the settings of the video transmitter; there is no table of bands."""
        state = self.state
        reply.u8(state.vtx_type)
        reply.u8(state.vtx_band)
        reply.u8(state.vtx_channel)
        reply.u8(state.vtx_power)
        reply.u8(1 if state.vtx_pit_mode else 0)
        reply.u16(state.vtx_freq_mhz)
        reply.u8(1 if state.vtx_ready else 0)
        reply.u8(state.vtx_low_power_disarm)
        reply.u16(state.vtx_pit_freq_mhz)
        reply.u32(0)  # table: not available, no bands, channels and powers

    def set_vtx_config(self, request, reply):
        """89: new settings: as many of the fields as came."""
        if request.size < 2:
            return False
        state = self.state
        coded = request.u16(0)
        if coded <= _VTX_LAST_CODED:
            state.vtx_band = (coded >> 3) + 1
            state.vtx_channel = (coded & 7) + 1
            state.vtx_freq_mhz = 0
        elif coded <= _VTX_LAST_MHZ:
            state.vtx_band = state.vtx_channel = 0
            state.vtx_freq_mhz = coded
        if request.size >= 4:
            state.vtx_power = request.u8(2)
            state.vtx_pit_mode = request.u8(3) != 0
        if request.size >= 5 and request.u8(4) <= _LAST_LOW_POWER_DISARM:
            state.vtx_low_power_disarm = request.u8(4)
        if request.size >= 7:
            state.vtx_pit_freq_mhz = request.u16(5)
        if request.size >= 11:
            # Band, channel and frequency each in a field of its own replace the coded ones.
            state.vtx_band = request.u8(7)
            state.vtx_channel = request.u8(8)
            state.vtx_freq_mhz = 0 if state.vtx_band else request.u16(9)
        if self.on_vtx is not None:
            self.on_vtx(state)
        return True


def _whole_degrees(decideg):
    """Returns tenths of a degree, any turn, as 0..359 degrees; None stays None."""
    return None if decideg is None else decideg % 3600 // 10
