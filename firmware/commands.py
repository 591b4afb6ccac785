"""What the console of an `Application` answers; loaded when something is typed."""

from firmware.forget import erase


def add_commands(console, application):
    """Adds the commands to a `firmware.console.Console`; each loads what it needs."""
    loaded = []

    def config(arguments):
        if not loaded:
            from firmware.config_command import ConfigCommand

            loaded.append(ConfigCommand(application))
        loaded[0](arguments)

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
    if "magnetometer" in application.sensors or "magnetometer" in application.search.waiting:
        text = "calibrate [cancel]: begin, then end the calibration of the magnetometer"
        console.add("calibrate", calibrate, text)
