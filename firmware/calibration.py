"""The console command `calibrate`: finds the magnetometer's hard-iron offset and keeps it."""


def calibrate(magnetometer, settings, arguments):
    """Answers a line of the console: one begins, the next ends and keeps the offset.

    `magnetometer`: a `Magnetometer`; `settings`: the `Settings` that keep the offset.
    """
    if arguments == "cancel":
        magnetometer.cancel_calibration()
        print("calibration: cancelled, the old offset holds")
    elif arguments:
        print("calibrate or calibrate cancel")
    elif not magnetometer.calibrating:
        magnetometer.start_calibration()
        print("calibration: turn the model level, a full circle, then: calibrate")
    else:
        _finish(magnetometer, settings)


def _finish(magnetometer, settings):
    try:
        offset_nt = magnetometer.finish_calibration()
    except ValueError as error:
        print(f"calibration: {error}. It goes on: turn further, or: calibrate cancel")
        return
    settings.set("magnetometer", "offset_nt", offset_nt)
    settings.request_save()
    print("calibration: offset", *offset_nt, "nT; saved as soon as there is no link")
