"""What the firmware tells of its state; loaded when it is to be told."""


def write(reporter, before, now):
    """Prints what is another in `now` than in `before`, or all of the state if both are None.

    Both are (link, times that the main loop stood still, faults).
    """
    application = reporter.application
    if now is None:
        print(reporter.hello, end="")
        for line in _state(application):
            print(line)
    if now is None or now[0] != before[0]:
        _print_link(application.adapter)
    if now is None or now[1] != before[1]:
        print("main loop: stood still", application.adapter.control.stuck, "times")
    if reporter.fault and (now is None or now[2] != before[2]):
        fault = reporter.fault
        print(f"main loop: {application.faults} faults, the last: {type(fault).__name__}: {fault}")


def _print_link(adapter):
    receiver = adapter.receiver
    text = adapter.link
    if receiver.rf_mode:
        from ghst.rf_modes import RF_MODES

        name = RF_MODES.get(receiver.rf_mode, (f"mode {receiver.rf_mode}",))[0]
        text += f", {name}, LQ {receiver.lq} %, RSSI {receiver.rssi_dbm} dBm"
    text += f"; frames {receiver.frames}, CRC errors {receiver.crc_errors}"
    text += f", bytes skipped {receiver.skipped_bytes}, failsafes {adapter.control.failsafes}"
    print("link:", text)


def _state(application):
    """Returns lines about telemetry, MSP, the video transmitter and each sensor."""
    control = application.adapter.control
    receiver = application.receiver
    lines = [
        f"telemetry: {control.telemetry_frames} frames sent, {control.collisions} collisions",
        f"MSP: {receiver.msp_frames} frames, {application.msp.describe()}, "
        f"{receiver.msp_lost} frames lost",
    ]
    sensors = application.sensors
    for name in sorted(list(sensors) + list(application.search.waiting)):
        if name in sensors:
            sensor = sensors[name]
            lines.append(f"{name}: {sensor.describe()}, {sensor.faults} faults")
        else:
            lines.append(f"{name}: {_ABSENT[name]}")
    lines += [f"sensor left out: {line}" for line in application.missing]
    shapes = application.adapter.outputs.shapes
    if shapes and shapes.weak_frames:
        lines.append(f"control frames of a weak link, left out: {shapes.weak_frames}")
    if receiver.vtx_setups:
        # Which nibble is the band is not public.
        lines.append(
            f"VTX set-up: {receiver.vtx_freq_mhz} MHz, {receiver.vtx_power_mw} mW, band and "
            f"channel 0x{receiver.vtx_band_channel:02x}, flags 0x{receiver.vtx_flags:02x}"
        )
    vtx_settings = application.vtx_settings
    if vtx_settings["vtx_band"] or vtx_settings["vtx_freq_mhz"]:
        lines.append(
            f"VTX by MSP: band {vtx_settings['vtx_band']}, "
            f"channel {vtx_settings['vtx_channel']}, {vtx_settings['vtx_freq_mhz']} MHz, "
            f"power step {vtx_settings['vtx_power']}, "
            f"pit mode {'on' if vtx_settings['vtx_pit_mode'] else 'off'}"
        )
    settings = application._settings  # the property would load them
    if settings and settings.error:
        lines.append(f"settings: {settings.error}")
    if receiver.vtx_controls:
        lines.append("VTX control: " + receiver.vtx_control.hex())
    if application.rx5808:
        lines.append(f"video receiver: {application.rx5808.frequency_mhz} MHz")
    return lines


_ABSENT = {
    "battery": "not plugged in",
    "gps": "nothing comes from a receiver",
    "barometer": "no barometer answers",
    "magnetometer": "no magnetometer answers",
}
