"""Makes the sensors that the configuration names, of those whose files are on the board."""

import sys

import machine


def sensors(values):
    """Returns ({name: sensor}, [line about each one that is left out]).

    `values`: those of the configuration. Left out is what has impossible options, too: no sensor
    keeps the servos from moving.
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
        if not values[name]["enabled"]:
            continue
        try:
            sensor = make(values[name], values, buses)
        except ImportError as error:
            missing.append(f"{name}: its file is not on this board: {error}")
        except (ValueError, TypeError) as error:
            missing.append(f"{name}: {error}")
        else:
            made[name] = sensor
    return made, missing


def _battery(own, values, buses):
    from firmware.sensors.battery import Battery

    if sys.platform == "esp32":
        from firmware.calibrated_adc import CalibratedAdc as Adc
        from firmware.rtc_scratch import Scratch
    else:
        from machine import ADC as Adc

        from firmware.scratch import Scratch

    voltage = own["voltage_pin"]
    current = own["current_pin"]
    return Battery(
        None if voltage is None else Adc(voltage),
        None if current is None else Adc(current),
        store=Scratch(),
        divider_permille=round(own["divider"] * 1000),
        current_mv_per_a=own["current_mv_per_a"],
        current_offset_mv=own["current_offset_mv"],
        reference_mv=own["reference_mv"],
        cells=own["cells"],
        cell_low_mv=own["cell_low_mv"],
        cell_critical_mv=own["cell_critical_mv"],
        capacity_mah=own["capacity_mah"],
    )


def _gps(own, values, buses):
    from firmware.sensors.gps import Gps

    uart = machine.UART(own["uart"], tx=own["tx_pin"], rx=own["rx_pin"])
    return Gps(uart, minimum_satellites=own["minimum_satellites"], configure=own["configure"])


def _bus(values, buses):
    from firmware.sensors.i2c_bus import I2cBus

    if "i2c" not in buses:
        port = values["i2c"]
        buses["i2c"] = I2cBus(port["bus"], sda=port["sda_pin"], scl=port["scl_pin"])
    return buses["i2c"]


def _barometer(own, values, buses):
    from firmware.sensors.barometer import Barometer

    return Barometer(_bus(values, buses), address=own["address"])


def _magnetometer(own, values, buses):
    from firmware.sensors.magnetometer import Magnetometer

    return Magnetometer(
        _bus(values, buses),
        address=own["address"],
        offset_nt=own["offset_nt"],
        declination_decideg=round(10 * own["declination_deg"]),
        rotation_deg=own["rotation_deg"],
        upside_down=own["upside_down"],
    )


def video_receiver(values):
    """Returns the `Rx5808` of goggles, None where it has no pins."""
    own = values["rx5808"]
    pins = [own[key] for key in ("clock_pin", "data_pin", "select_pin")]
    if None in pins:
        return None
    from firmware.rx5808 import Rx5808

    return Rx5808(*[machine.Pin(pin) for pin in pins])
