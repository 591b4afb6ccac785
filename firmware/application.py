"""`Application`: an adapter with sensors, telemetry, MSP and video settings around it."""

import os

from firmware import vtx
from firmware.adapter import LINKED
from firmware.console import Console
from firmware.msp import Msp
from firmware.telemetry import Telemetry

_SETTINGS = "/ghst.json"
_CONFIG = "config: for the program ghst config"
_CALIBRATE = "calibrate [cancel]: begin, then end the calibration of the magnetometer"


class Application:
    """What runs on a board, for `/user.py` to add to.

    `adapter`, `receiver`; `sensors` {name: sensor} and `missing`, lines about those that are left
    out; `state`, the values that MSP answers with; `responder`, to add MSP commands to;
    `settings`, what is changed while it runs; `problems`, lines about what is wrong with the
    user's configuration: if there are any, nothing moves; `on_vtx(kind, application)`, called in
    the main loop (`firmware.vtx`), or None; `rx5808`, the video receiver module of goggles, or
    None; `console`, to add commands to (`firmware.console`); `steps`, functions of the time in ms
    that the main loop calls one after the other in every round: none may take more than 5 ms.
    """

    def __init__(self, configuration, adapter):
        """`configuration`: from `load`, and not kept; `adapter`: made of it, running or not."""
        from firmware import devices

        values = configuration.values
        self.identity = (
            configuration.board["name"],
            values[""]["name"],
            configuration.board["chip"],
        )
        self.problems = configuration.problems
        self.vtx_settings = values["vtx"]
        self.adapter = adapter
        self.receiver = adapter.receiver
        self.sensors, self.missing = devices.sensors(values)
        self.cycle_time_us = 0
        self.on_vtx = None
        self.rx5808 = None
        if values[""]["role"] == "goggles":
            try:
                self.rx5808 = devices.video_receiver(values)
            except ImportError as error:
                self.missing.append(f"rx5808: {error}")
        self._settings = None
        self._calibration = None
        self._config_command = None
        self.msp = Msp(self)
        self.telemetry = Telemetry(adapter, self.sensors, self.msp)
        self.steps = [self._alive]
        self.steps += self.telemetry.steps
        self.steps += [vtx.VtxEvents(self.receiver, self.vtx_event).update, self._poll_settings]
        self.console = Console()
        self.console.add("config", self._config, _CONFIG)
        if "magnetometer" in self.sensors:
            self.console.add("calibrate", self._calibrate, _CALIBRATE)
        self.steps.append(self._poll_console)
        if _exists(_SETTINGS + ".new"):
            self.settings  # noqa: B018 - loading them ends the save that was cut off

    @property
    def settings(self):
        """The `firmware.settings.Settings`, loaded when they are needed."""
        if self._settings is None:
            from firmware.settings import Settings

            self._settings = Settings(_SETTINGS)
            self._settings.load()
        return self._settings

    @property
    def state(self):
        """The `ghst.msp_state.State` that MSP answers from."""
        return self.msp.state

    @property
    def responder(self):
        """The `ghst.msp.Responder`."""
        return self.msp.responder

    def _calibrate(self, arguments):
        if self._calibration is None:
            from firmware.calibration import Calibrate

            self._calibration = Calibrate(self.sensors["magnetometer"], self.settings)
        self._calibration(arguments)

    def _config(self, arguments):
        if self._config_command is None:
            from firmware.config_command import ConfigCommand

            self._config_command = ConfigCommand(self)
        self._config_command(arguments)

    def _poll_console(self, now_ms):
        self.console.update()

    def _alive(self, now_ms):
        link = self.adapter.poll()
        self.telemetry.armed = link == LINKED and self.adapter.outputs.armed

    def vtx_event(self, kind):
        """Tells of new video settings; `kind` as in `firmware.vtx`."""
        if self.rx5808 and kind == vtx.SETUP:
            self.rx5808.set_frequency(self.receiver.vtx_freq_mhz)
        if self.on_vtx:
            self.on_vtx(kind, self)

    def _poll_settings(self, now_ms):
        if self._settings is not None:
            # Writing flash stops all interrupts.
            self._settings.poll(self.adapter.poll() != LINKED)

    def describe(self):
        """Returns lines about telemetry, MSP, the video transmitter and each sensor; allocates."""
        control = self.adapter.control
        lines = [
            f"telemetry: {control.telemetry_frames} frames sent, {control.collisions} collisions",
            f"MSP: {self.receiver.msp_frames} frames, {self.msp.describe()}, "
            f"{self.receiver.msp_lost} frames lost",
        ]
        lines += [
            f"{name}: {sensor.describe()}, {sensor.faults} faults"
            for name, sensor in sorted(self.sensors.items())
        ]
        shapes = self.adapter.outputs.shapes
        if shapes and shapes.weak_frames:
            lines.append(f"control frames of a weak link, left out: {shapes.weak_frames}")
        receiver = self.receiver
        if receiver.vtx_setups:
            # Which nibble is the band is not public.
            lines.append(
                f"VTX set-up: {receiver.vtx_freq_mhz} MHz, {receiver.vtx_power_mw} mW, band and "
                f"channel 0x{receiver.vtx_band_channel:02x}, flags 0x{receiver.vtx_flags:02x}"
            )
        vtx_settings = self.vtx_settings
        if vtx_settings["vtx_band"] or vtx_settings["vtx_freq_mhz"]:
            lines.append(
                f"VTX by MSP: band {vtx_settings['vtx_band']}, "
                f"channel {vtx_settings['vtx_channel']}, {vtx_settings['vtx_freq_mhz']} MHz, "
                f"power step {vtx_settings['vtx_power']}, "
                f"pit mode {'on' if vtx_settings['vtx_pit_mode'] else 'off'}"
            )
        if receiver.vtx_controls:
            lines.append("VTX control: " + receiver.vtx_control.hex())
        if self.rx5808:
            lines.append(f"video receiver: {self.rx5808.frequency_mhz} MHz")
        return lines


def _exists(path):
    try:
        os.stat(path)
    except OSError:
        return False
    return True
