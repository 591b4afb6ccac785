"""Makes the sensors that the board's description names, of those whose files are on the board."""

import machine


def sensors(board, settings):
    """Returns ({name: sensor}, [line about each one that is left out]).

    `board`: a `firmware.board.Board`; `settings`: `Settings` with what was calibrated. Left out
    is what has impossible options, too: no sensor keeps the servos from moving.
    """
    made = {}
    missing = []
    buses = {}
    for name, make in (
        ("battery", _battery),
        ("gps", _gps),
        ("barometer", _barometer),
        ("magnetometer", _magnetometer),
    ):
        if name not in board.sensors:
            continue
        options = dict(board.sensors[name])
        offset_nt = settings.get(name, "offset_nt")
        if offset_nt is not None:
            options["offset_nt"] = offset_nt
        try:
            sensor = make(board, options, buses)
        except ImportError as error:
            missing.append(f"{name}: its file is not on this board: {error}")
        except (ValueError, TypeError) as error:
            missing.append(f"{name}: sensors.{name} in the board's description: {error}")
        else:
            made[name] = sensor
    return made, missing


def _pin_of(board, key):
    value = board.pins.get(key)
    if value is None:
        raise ValueError(f"pins.{key} is missing")
    return value


def _battery(board, options, buses):
    from firmware.scratch import Scratch
    from firmware.sensors.battery import Battery

    voltage = board.pins.get("battery_adc")
    # A current sensor cannot be told from an open input: there is one where its scale is given.
    current = board.pins.get("current_adc") if "current_mv_per_a" in options else None
    if "divider" in options:
        options["divider_permille"] = round(options.pop("divider") * 1000)
    return Battery(
        None if voltage is None else machine.ADC(voltage),
        None if current is None else machine.ADC(current),
        store=Scratch(),
        **options,
    )


def _gps(board, options, buses):
    from firmware.sensors.gps import Gps

    port = _pin_of(board, "gps_uart")
    return Gps(machine.UART(port["id"], tx=port["tx"], rx=port["rx"]), **options)


def _bus(board, buses):
    from firmware.sensors.i2c_bus import I2cBus

    if "i2c" not in buses:
        port = _pin_of(board, "i2c")
        buses["i2c"] = I2cBus(port["id"], sda=port["sda"], scl=port["scl"])
    return buses["i2c"]


def _barometer(board, options, buses):
    from firmware.sensors.barometer import Barometer

    return Barometer(_bus(board, buses), **options)


def _magnetometer(board, options, buses):
    from firmware.sensors.magnetometer import Magnetometer

    return Magnetometer(_bus(board, buses), **options)


def video_receiver(board):
    """Returns the `Rx5808` of goggles; raises `ValueError` or `ImportError` if it cannot be."""
    from firmware.rx5808 import Rx5808

    pins = _pin_of(board, "rx5808")
    return Rx5808(*[machine.Pin(pins[key]) for key in ("clock", "data", "select")])
