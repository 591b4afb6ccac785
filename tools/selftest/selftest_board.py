"""What can be looked at before the firmware is started: jumper, ADC, I2C, restart."""

import time

import machine
import selftest_pads as pads
from machine import ADC, I2C, Pin

from firmware import chip

# A receiver in the slowest mode has sent two frames in this time.
_LISTEN_MS = 120
_SETTLE_MS = 2
_SAMPLES = 16
_SCRATCH = 7  # of the watchdog; `firmware.scratch` has 0 to 3, the boot ROM 4


def tie(wire_pin, pin):
    """Returns how the Ghost wire is, and whether `pin` is tied to it.

    "quiet": whether nobody has talked; "high": levels of both with pull-ups. If all of these are
    true, "low", "up": levels of both while `pin` drives low, then high against a pull-down.
    """
    wire = Pin(wire_pin, Pin.IN, Pin.PULL_UP)
    other = Pin(pin, Pin.IN, Pin.PULL_UP)
    time.sleep_ms(_SETTLE_MS)
    pads.clear((wire_pin, pin))
    high = (wire.value(), other.value())
    time.sleep_ms(_LISTEN_MS)
    found = {"quiet": not pads.changed((wire_pin, pin)), "high": high}
    if found["quiet"] and all(high):
        found["low"] = _drive(wire, other, Pin.PULL_UP, 0)
        found["up"] = _drive(wire, other, Pin.PULL_DOWN, 1)
    Pin(wire_pin, Pin.IN, Pin.PULL_UP)
    Pin(pin, Pin.IN, Pin.PULL_UP)
    return found


def _drive(wire, other, pull, level):
    wire.init(Pin.IN, pull)
    other.init(Pin.OUT, value=level)
    time.sleep_ms(_SETTLE_MS)
    return (wire.value(), other.value())


def analog(pin):
    """Returns readings of the ADC, 0..65535: temperature sensor, `pin` pulled down, pulled up."""
    adc = ADC(pin)
    found = {"temperature": _average(ADC(ADC.CORE_TEMP))}
    for name, up in (("down", False), ("up", True)):
        pads.pull(pin, up)
        time.sleep_ms(_SETTLE_MS)
        found[name] = _average(adc)
    pads.pull(pin, None)
    return found


def _average(adc):
    return sum([adc.read_u16() for _ in range(_SAMPLES)]) // _SAMPLES


def i2c(bus, sda_pin, scl_pin):
    """Returns the state of the bus and who answers.

    "high": levels of SDA and SCL, pulled up; "sda_low", "scl_low": both, while one is driven low.
    If these are right, "answers": addresses, "scan_ms": how long that took.
    """
    sda = Pin(sda_pin, Pin.IN, Pin.PULL_UP)
    scl = Pin(scl_pin, Pin.IN, Pin.PULL_UP)
    time.sleep_ms(_SETTLE_MS)
    found = {"high": (sda.value(), scl.value())}
    if all(found["high"]):
        # SCL first: a stop while SCL is high ends what a target may have taken for a start.
        for name, line in (("scl_low", scl), ("sda_low", sda)):
            line.init(Pin.OPEN_DRAIN, Pin.PULL_UP, value=0)
            time.sleep_us(20)
            found[name] = (sda.value(), scl.value())
            line.init(Pin.IN, Pin.PULL_UP)
            time.sleep_us(20)
        if (found["sda_low"], found["scl_low"]) == ((0, 1), (1, 0)):
            begun_ms = time.ticks_ms()
            controller = I2C(bus, sda=sda, scl=scl, freq=400_000, timeout=1000)
            found["answers"] = controller.scan()
            found["scan_ms"] = time.ticks_diff(time.ticks_ms(), begun_ms)
    Pin(sda_pin, Pin.IN, Pin.PULL_UP)
    Pin(scl_pin, Pin.IN, Pin.PULL_UP)
    return found


def count_ms(ms):
    """Writes a number where a reset leaves it."""
    machine.mem32[chip.this_chip().WATCHDOG + chip.WATCHDOG_SCRATCH + 4 * _SCRATCH] = ms


def restart(pins):
    """Returns why the chip was restarted last and which of `pins` have risen since.

    "reason": bit 0 for the watchdog's time-out; "counted_ms": what `count_ms` wrote last.
    """
    first = chip.this_chip().WATCHDOG
    return {
        "reason": machine.mem32[first + chip.WATCHDOG_REASON],
        "counted_ms": machine.mem32[first + chip.WATCHDOG_SCRATCH + 4 * _SCRATCH],
        "rose": pads.rose(pins),
    }
