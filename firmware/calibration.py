"""The console command `calibrate`: finds the magnetometer's hard-iron offset and keeps it."""


class Calibrate:
    """Begins with one call and ends with the next; the offset goes into the configuration."""

    def __init__(self, magnetometer, settings):
        """`magnetometer`: a `Magnetometer`; `settings`: the `Settings` that keep the offset."""
        self._magnetometer = magnetometer
        self._settings = settings

    def __call__(self, arguments):
        """Answers a line of the console."""
        magnetometer = self._magnetometer
        if arguments == "cancel":
            magnetometer.cancel_calibration()
            print("calibration: cancelled, the old offset holds")
        elif arguments:
            print("calibrate or calibrate cancel")
        elif not magnetometer.calibrating:
            magnetometer.start_calibration()
            print("calibration: turn the model level, a full circle, then: calibrate")
        else:
            self._finish()

    def _finish(self):
        try:
            offset_nt = self._magnetometer.finish_calibration()
        except ValueError as error:
            print(f"calibration: {error}. It goes on: turn further, or: calibrate cancel")
            return
        self._settings.set("magnetometer", "offset_nt", offset_nt)
        self._settings.request_save()
        print("calibration: offset", *offset_nt, "nT; saved as soon as there is no link")
