"""Makes the sensors that the configuration names, of those whose files are on the board.

At the start only what `firmware.search` looks with is made of them. This module is loaded for
that, and again with each sensor that is there.
"""

import sys

import machine

_BAROMETERS = b"\x76\x77\x5c\x5d"
_MAGNETOMETERS = b"\x0d\x1c\x1e"
_GPS_BAUD_RATE = 9600  # at the slowest, something is heard of every sender
_I2C_TIMEOUT_US = 800  # an address and a byte at 400 kHz, and the interrupts meanwhile
_I2C_HZ = 400_000
_UNPLUGGED_MS = 3000  # as `firmware.sensors.cells` has it


def waiting(values, restarted):
    """Returns ({name: (probe, arguments)}, [line about each sensor that cannot be]).

    `values`: those of the configuration; `restarted`: whether the watchdog has restarted the chip.
    No sensor keeps the servos from moving.
    """
    found = {}
    missing = []
    for name, prepare in (
        ("battery", _battery_probe),
        ("gps", _gps_probe),
        ("barometer", _barometer_probe),
        ("magnetometer", _magnetometer_probe),
    ):
        if values[name]["enabled"]:
            try:
                found[name] = prepare(values[name], values["i2c"], restarted)
            except (ValueError, TypeError) as error:
                missing.append(f"{name}: {error}")
    return found, missing


def _battery_probe(own, i2c, restarted):
    if sys.platform == "esp32":
        from firmware.calibrated_adc import CalibratedAdc as Adc
    else:
        from machine import ADC as Adc

    pins = own["voltage_pin"], own["current_pin"]
    inputs = [None if pin is None else Adc(pin) for pin in pins]
    arguments = (
        inputs,
        round(own["divider"] * 1000),
        own["current_mv_per_a"],
        own["current_offset_mv"],
        own["reference_mv"],
        own["cells"],
        own["cell_low_mv"],
        own["cell_critical_mv"],
        own["capacity_mah"],
    )
    # Without a voltage, a current as small as any counts.
    probe = [adc for adc in inputs if adc] if inputs[0] else None
    return probe, arguments


def _gps_probe(own, i2c, restarted):
    # The ESP-IDF takes no buffer that is smaller than what the UART itself holds.
    size = 256 if sys.platform == "esp32" else 64
    pins = {"tx": own["tx_pin"], "rx": own["rx_pin"]}
    uart = machine.UART(own["uart"], _GPS_BAUD_RATE, rxbuf=size, txbuf=size, **pins)
    # The watchdog bites in the air, too: then home is not where the model is now.
    return uart, (uart, own["minimum_satellites"], own["configure"], not restarted)


def _i2c_probe(own, i2c, addresses):
    scl, sda = machine.Pin(i2c["scl_pin"]), machine.Pin(i2c["sda_pin"])
    if sys.platform == "esp32":
        # As `firmware.sensors.i2c_bus` has it, for the same reason.
        controller = machine.SoftI2C(scl, sda, freq=_I2C_HZ, timeout=_I2C_TIMEOUT_US)
    else:
        controller = machine.I2C(
            i2c["bus"], sda=sda, scl=scl, freq=_I2C_HZ, timeout=_I2C_TIMEOUT_US
        )
    return controller, addresses if own["address"] is None else bytes((own["address"],))


def _barometer_probe(own, i2c, restarted):
    return _i2c_probe(own, i2c, _BAROMETERS), (i2c, own["address"])


def _magnetometer_probe(own, i2c, restarted):
    arguments = (
        i2c,
        own["address"],
        own["offset_nt"],
        round(10 * own["declination_deg"]),
        own["rotation_deg"],
        own["upside_down"],
    )
    return _i2c_probe(own, i2c, _MAGNETOMETERS), arguments


def make(name, arguments, search):
    """Returns the sensor `name`; raises `ImportError` and `ValueError`.

    `arguments`: from `waiting`; `search`: a `firmware.search.Search`, whose `bus` is made here.
    """
    makers = {
        "battery": _battery,
        "gps": _gps,
        "barometer": _barometer,
        "magnetometer": _magnetometer,
    }
    return makers[name](search, *arguments)


def _battery(
    search, inputs, divider_permille, mv_per_a, offset_mv, reference_mv, cells, low, critical, mah
):
    from firmware.sensors.battery import Battery

    if sys.platform == "esp32":
        from firmware.rtc_scratch import Scratch
    else:
        from firmware.scratch import Scratch

    store = Scratch()
    if search.pause_ms > _UNPLUGGED_MS:
        store.save(0)  # of a battery that was unplugged when the board was reset
    return Battery(
        *inputs,
        store=store,
        divider_permille=divider_permille,
        current_mv_per_a=mv_per_a,
        current_offset_mv=offset_mv,
        reference_mv=reference_mv,
        cells=cells,
        cell_low_mv=low,
        cell_critical_mv=critical,
        capacity_mah=mah,
    )


def _gps(search, uart, minimum_satellites, configure, takes_home):
    from firmware.sensors.gps import Gps

    return Gps(
        uart,
        minimum_satellites=minimum_satellites,
        configure=configure,
        takes_home=takes_home,
    )


def _bus(search, i2c):
    if search.bus is None:
        from firmware.sensors.i2c_bus import I2cBus

        search.bus = I2cBus(i2c["bus"], sda=i2c["sda_pin"], scl=i2c["scl_pin"])
    return search.bus


def _barometer(search, i2c, address):
    from firmware.sensors.barometer import Barometer

    return Barometer(_bus(search, i2c), address=address)


def _magnetometer(search, i2c, address, offset_nt, declination_decideg, rotation_deg, upside_down):
    from firmware.sensors.magnetometer import Magnetometer

    return Magnetometer(
        _bus(search, i2c),
        address=address,
        offset_nt=offset_nt,
        declination_decideg=declination_decideg,
        rotation_deg=rotation_deg,
        upside_down=upside_down,
    )


def video_receiver(values):
    """Returns the `Rx5808` of goggles, None where it has no pins."""
    own = values["rx5808"]
    pins = [own[key] for key in ("clock_pin", "data_pin", "select_pin")]
    if None in pins:
        return None
    from firmware.rx5808 import Rx5808

    return Rx5808(*[machine.Pin(pin) for pin in pins])
