"""What the console of an `Application` answers; loaded when something is typed."""

import time

from firmware.forget import erase


def add_commands(console, application):
    """Adds the commands to a `firmware.console.Console`; each loads what it needs."""
    loaded = []

    def config(arguments):
        if not loaded:
            from firmware.config_command import ConfigCommand

            loaded.append(ConfigCommand(application))
        loaded[0](arguments)

    says = []

    def status(arguments):
        if not says:
            try:
                from firmware.status import Status

                says.append(Status(application))
            except MemoryError:
                print('{"ghst": "error", "text": "not enough memory for it"}')
                return
            application.steps.append(say)
        says[0].command(arguments)

    def say(now_ms):
        status = says[0]
        if time.ticks_diff(now_ms, status.due_ms) < 0:
            return
        status.update(now_ms)
        application.writing = status.writing
        if status.finished:
            says.clear()
            application.steps.remove(say)
            erase("firmware.status")

    def calibrate(arguments):
        magnetometer = application.sensors.get("magnetometer")
        if magnetometer is None:
            print("no magnetometer answers")
            return
        from firmware import calibration

        calibration.calibrate(magnetometer, application.settings, arguments)
        erase("firmware.calibration")

    console.add("", application.reporter.show, "(Enter): the state of everything")
    console.add("config", config, "config: for the program ghst config")
    console.add("status", status, "status [ms | off]: everything as JSON, once or again and again")
    if "magnetometer" in application.sensors or "magnetometer" in application.search.waiting:
        text = "calibrate [cancel]: begin, then end the calibration of the magnetometer"
        console.add("calibrate", calibrate, text)
