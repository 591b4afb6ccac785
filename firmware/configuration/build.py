"""Makes the control path that a configuration asks for."""

import sys

import machine

from firmware.adapter import Adapter
from firmware.configuration.outputs import SHORTENED, travel_us
from firmware.limits import HOLD, MAXIMUM, MINIMUM, NONE
from firmware.output import OFF, ON, Output

_FAILSAFE = {"hold": HOLD, "none": NONE, "off": OFF, "on": ON}


def adapter(configuration):
    """Returns the `Adapter`, not started; raises `ValueError` for what the chip refuses."""
    values = configuration.values
    wire = values["wire"]
    failsafe = values["failsafe"]
    led = values["led"]
    if configuration.problems and sys.platform == "esp32":
        # A reset leaves pulses on these pins, and nothing else claims them.
        for pin in configuration.board["defaults"].get("outputs", ()):
            machine.Pin(int(pin), machine.Pin.OUT, value=0)
    limits = (failsafe["minimum_lq_percent"], failsafe["minimum_rssi_dbm"])
    return Adapter(
        wire["pin"],
        {pin: output(point) for pin, point in values["outputs"].items()},
        failsafe_ms=failsafe["time_ms"],
        led=led["pin"],
        led_active_low=led["active_low"],
        arming=_arming(values["arming"]),
        link_limits=None if limits == (None, None) else limits,
        broken=bool(configuration.problems),
        wire=wire["driver"],
        tx_pin=wire["tx_pin"],
        baud_rate=wire["baud_rate"],
        inverted=wire["inverted"],
    )


def _arming(values):
    if values["channel"] is None:
        return None
    return (
        values["channel"],
        values["throttle_channel"],
        round(4 * values["threshold_us"]),
        round(4 * values["throttle_low_us"]),
    )


def output(values):
    """Returns the `Output` for the points of one output."""
    failsafe = values["failsafe"]
    if values["kind"] == "switch":
        above_us = values["threshold_us"]
        return Output(
            values["channel"],
            failsafe=_FAILSAFE[failsafe],
            frequency_hz=values["frequency_hz"],
            reverse=values["reverse"],
            switch=(round(4 * above_us), round(4 * (above_us - values["hysteresis_us"]))),
        )
    shortened = SHORTENED[values["kind"]]

    def pulse(us):
        return round(4 * shortened * us)

    low, centre, high = [pulse(us) for us in travel_us(values)]
    limits = (MINIMUM, MAXIMUM)
    if values["motor"]:
        limits = (low, high)
    elif values["minimum_us"] is not None or values["maximum_us"] is not None:
        limits = (
            MINIMUM if values["minimum_us"] is None else low,
            MAXIMUM if values["maximum_us"] is None else high,
        )
    return Output(
        values["channel"],
        failsafe=_FAILSAFE[failsafe] if type(failsafe) is str else pulse(failsafe),
        frequency_hz=values["frequency_hz"],
        shortened=shortened,
        low=low,
        centre=centre,
        high=high,
        limits=limits,
        reverse=values["reverse"],
        deadband=round(4 * values["deadband_us"]),
        slow_us_per_s=shortened * values["slow_us_per_s"],
        motor=values["motor"],
    )
