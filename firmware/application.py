"""`Application`: an adapter with sensors, telemetry, MSP and video settings around it."""

import machine

from firmware import devices, vtx
from firmware.adapter import LINKED
from firmware.console import Console
from firmware.settings import Settings
from firmware.telemetry import Telemetry
from ghst.msp import Responder
from ghst.msp_commands import answer
from ghst.msp_state import State

_VTX_KEYS = (
    "vtx_band",
    "vtx_channel",
    "vtx_power",
    "vtx_pit_mode",
    "vtx_freq_mhz",
    "vtx_low_power_disarm",
    "vtx_pit_freq_mhz",
)


class Application:
    """What runs on a board, for `/user.py` to add to.

    `configuration`; `adapter`, `receiver`; `sensors` {name: sensor} and `missing`, lines about
    those that are left out; `state`, the values that MSP answers with; `responder`, to add MSP
    commands to; `settings`; `on_vtx(kind, application)`, called in the main loop
    (`firmware.vtx`), or None; `rx5808`, the video receiver module of goggles, or None; `console`,
    to add commands to (`firmware.console`); `steps`, functions of the time in ms that the main
    loop calls one after the other in every round: none may take more than 5 ms.
    """

    def __init__(self, configuration, adapter):
        """`configuration`: from `load`; `adapter`: as it describes it, running or not."""
        self.configuration = configuration
        values = configuration.values
        self.adapter = adapter
        self.receiver = adapter.receiver
        self.settings = Settings()
        self.settings.load()
        self.sensors, self.missing = devices.sensors(values)
        self.on_vtx = None
        self.rx5808 = self._video_receiver() if values[""]["role"] == "goggles" else None
        self.state = self._state()
        self.responder = Responder()
        answer(self.responder, self.state, on_vtx=self._vtx_set, on_save=self._save)
        self.telemetry = Telemetry(self.adapter, self.sensors, self.state, self.responder)
        self.steps = [self._alive]
        self.steps += self.telemetry.steps
        self.steps += [vtx.VtxEvents(self.receiver, self._vtx_event).update, self._poll_settings]
        self.console = Console()
        self._add_commands()
        self.steps.append(self._poll_console)

    def _add_commands(self):
        if "magnetometer" in self.sensors:
            from firmware.calibration import HELP, Calibrate

            calibrate = Calibrate(self.sensors["magnetometer"], self.settings)
            self.console.add("calibrate", calibrate, HELP)

    def _poll_console(self, now_ms):
        self.console.update()

    def _video_receiver(self):
        try:
            return devices.video_receiver(self.configuration.values)
        except ImportError as error:
            self.missing.append(f"rx5808: {error}")
        return None

    def _state(self):
        state = State()
        board = self.configuration.board
        values = self.configuration.values
        state.board_name = state.target_name = board["name"].encode()
        state.craft_name = values[""]["name"].encode() or state.board_name
        state.board_identifier = board["chip"][:4].upper().encode()
        state.uid = machine.unique_id()
        state.pulses = self.receiver.pulses
        battery = self.sensors.get("battery")
        state.capacity_mah = battery.capacity_mah if battery else None
        for key in _VTX_KEYS:
            setattr(state, key, values["vtx"][key])
        return state

    def _alive(self, now_ms):
        link = self.adapter.poll()
        self.state.armed = link == LINKED and self.adapter.outputs.armed
        self.state.rssi_percent = self.receiver.rssi_percent

    def _vtx_event(self, kind):
        if self.rx5808 and kind == vtx.SETUP:
            self.rx5808.set_frequency(self.receiver.vtx_freq_mhz)
        if self.on_vtx:
            self.on_vtx(kind, self)

    def _vtx_set(self, state):
        for key in _VTX_KEYS:
            self.settings.set("vtx", key, getattr(state, key))
        self._vtx_event(vtx.MSP)

    def _save(self):
        self.settings.request_save()
        return True

    def _poll_settings(self, now_ms):
        # Writing flash stops all interrupts.
        self.settings.poll(self.adapter.poll() != LINKED)

    def describe(self):
        """Returns lines about telemetry, MSP, the video transmitter and each sensor; allocates."""
        control = self.adapter.control
        responder = self.responder
        lines = [
            f"telemetry: {control.telemetry_frames} frames sent, {control.collisions} collisions",
            f"MSP: {self.receiver.msp_frames} frames, {responder.answered} answered, "
            f"{responder.errors} errors, {self.receiver.msp_lost} frames lost",
        ]
        lines += [
            f"{name}: {sensor.describe()}, {sensor.faults} faults"
            for name, sensor in sorted(self.sensors.items())
        ]
        receiver = self.receiver
        if receiver.vtx_setups:
            # Which nibble is the band is not public.
            lines.append(
                f"VTX set-up: {receiver.vtx_freq_mhz} MHz, {receiver.vtx_power_mw} mW, band and "
                f"channel 0x{receiver.vtx_band_channel:02x}, flags 0x{receiver.vtx_flags:02x}"
            )
        state = self.state
        if state.vtx_band or state.vtx_freq_mhz:
            lines.append(
                f"VTX by MSP: band {state.vtx_band}, channel {state.vtx_channel}, "
                f"{state.vtx_freq_mhz} MHz, power step {state.vtx_power}, "
                f"pit mode {'on' if state.vtx_pit_mode else 'off'}"
            )
        if receiver.vtx_controls:
            lines.append("VTX control: " + receiver.vtx_control.hex())
        if self.rx5808:
            lines.append(f"video receiver: {self.rx5808.frequency_mhz} MHz")
        return lines
