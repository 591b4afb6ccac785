"""`Application`: an adapter with sensors, telemetry, MSP and video settings around it.

What not every flight needs is loaded when it is used, and what is used once is forgotten again.
"""

import os
import select
import sys

from firmware import vtx
from firmware.forget import erase
from firmware.limits import LINKED
from firmware.report import Reporter
from firmware.search import Search
from firmware.usb_room import ready

_SETTINGS = "/ghst.json"


class Application:
    """What runs on a board, for `/user.py` to add to.

    `adapter`, `receiver`; `sensors` {name: sensor}, each from the moment on in which there is
    something to measure, and `missing`, lines about those that are left out; `state`, the values
    that MSP answers with; `responder`, to add MSP commands to; `settings`, what is changed while
    it runs; `problems`, lines about what is wrong with the user's configuration: if there are any,
    nothing moves; `on_vtx(kind, application)`, called in the main loop (`firmware.vtx`), or None;
    `rx5808`, the video receiver module of goggles, or None; `console`, to add commands to
    (`firmware.console`); `writing`, whether a line is under way there, between whose parts nothing
    may be said; `faults`, how many exceptions the main loop has survived; `steps`, functions of
    the time in ms that the main loop calls one after the other in every round: none may take more
    than 5 ms.
    """

    def __init__(self, configuration, adapter, hello):
        """`configuration`: from `load`, and not kept; `adapter`: made of it, running or not.

        `hello`: what is running here, for the console.
        """
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
        self.sensors = {}
        waiting, self.missing = devices.waiting(values, adapter.control.restarted)
        self.search = Search(waiting)
        self.cycle_time_us = 0
        self.faults = 0
        self.on_vtx = None
        self.rx5808 = None
        if values[""]["role"] == "goggles":
            try:
                self.rx5808 = devices.video_receiver(values)
            except ImportError as error:
                self.missing.append(f"rx5808: {error}")
        self.reporter = Reporter(self, hello)
        self.writing = False
        self._settings = self._msp = self._telemetry = self._console = None
        self._vtx_setups = self._vtx_controls = 0
        self._typed = select.poll()
        self._typed.register(sys.stdin, select.POLLIN)
        self.steps = [self._alive, self._find_sensors, self._watch_vtx, self._poll_console]
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
    def msp(self):
        """The `firmware.msp.Msp`."""
        if self._msp is None:
            from firmware.msp import Msp

            self._msp = Msp(self)
        return self._msp

    @property
    def state(self):
        """The `ghst.msp_state.State` that MSP answers from."""
        return self.telemetry and self.msp.state

    @property
    def responder(self):
        """The `ghst.msp.Responder`."""
        # Who adds to it waits for a request: then the way of the answer has to be there.
        return self.telemetry and self.msp.responder

    @property
    def telemetry(self):
        """The `firmware.telemetry.Telemetry`, loaded when there is something to send."""
        if self._telemetry is None:
            from firmware.telemetry import Telemetry

            self._telemetry = Telemetry(self.adapter, self.msp)
            self.steps.append(self._telemetry.update)
        return self._telemetry

    @property
    def console(self):
        """The `firmware.console.Console`, loaded when something is typed."""
        if self._console is None:
            from firmware.commands import add_commands
            from firmware.console import Console

            self._console = console = Console(self._typed)
            add_commands(console, self)
        return self._console

    def _alive(self, now_ms):
        link = self.adapter.poll()
        if self._telemetry:
            self._telemetry.armed = link == LINKED and self.adapter.outputs.armed
        elif self.receiver.msp_frames:
            self.telemetry  # noqa: B018 - loaded, it looks for them itself
        if self._settings is not None:
            # Writing flash stops all interrupts.
            self._settings.poll(link != LINKED)

    def _find_sensors(self, now_ms):
        name = self.search.update(now_ms)
        if name:
            self._add_sensor(name)

    def _add_sensor(self, name):
        from firmware import devices

        arguments = self.search.waiting.pop(name)[1]
        try:
            sensor = devices.make(name, arguments, self.search)
        except ImportError as error:
            self._leave_out(name, f"its file is not on this board: {error}")
        except (ValueError, TypeError) as error:
            self._leave_out(name, error)
        else:
            self.sensors[name] = sensor
            self.steps.append(self.telemetry.add(name, sensor))
        erase("firmware.devices")

    def _leave_out(self, name, reason):
        self.missing.append(f"{name}: {reason}")
        print(f"sensor left out: {name}: {reason}")

    def _watch_vtx(self, now_ms):
        """Tells of each new frame, or of the newest where several came within a round."""
        receiver = self.receiver
        if receiver.vtx_controls != self._vtx_controls:
            self._vtx_controls = receiver.vtx_controls
            self.vtx_event(vtx.CONTROL)
        if receiver.vtx_setups != self._vtx_setups:
            self._vtx_setups = receiver.vtx_setups
            self.vtx_event(vtx.SETUP)

    def vtx_event(self, kind):
        """Tells of new video settings; `kind` as in `firmware.vtx`."""
        if self.rx5808 and kind == vtx.SETUP:
            self.rx5808.set_frequency(self.receiver.vtx_freq_mhz)
        if self.on_vtx:
            self.on_vtx(kind, self)

    def _poll_console(self, now_ms):
        if not self.writing and (self._console or ready(self._typed)):
            self.console.update()


def _exists(path):
    try:
        os.stat(path)
    except OSError:
        return False
    return True
