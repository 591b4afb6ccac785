"""The checks before the firmware is started: jumper, ADC, I2C."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ghst_tools.selftest.context import Context
from ghst_tools.selftest.result import Result, Verdict, judged
from ghst_tools.selftest.session import ask

_FULL_SCALE = 65535
_REFERENCE_V = 3.3
# RP2040 datasheet, section 4.9.5; the voltage of single chips differs by as much as 20 degrees.
_AT_27_V = 0.706
_V_PER_DEGREE = 0.001721
_TEMPERATURES = (-20, 85)
# The pulls have 50 to 80 kOhm; converting takes a current that may be that of 100 kOhm.
_LOW_V = 0.3
_HIGH_V = 1.5
_SCAN_MS = 200
_I2C_NAMES = {
    0x0D: "QMC5883L",
    0x1C: "LIS3MDL",
    0x1E: "HMC5883L or LIS3MDL",
    0x5C: "LPS22H",
    0x5D: "LPS22H",
    0x76: "BMP280, BME280 or DPS310",
    0x77: "BMP280, BME280 or DPS310",
}


def jumper(context: Context) -> Result:
    """Whether the wire is quiet and tied to the pin that plays the receiver."""
    wire, pin = context.name(context.wire_pin), context.name(context.pin)
    tied = f"{wire} and {pin} tied"
    found = ask(context.session, f"selftest_board.tie({context.wire_pin}, {context.pin})")

    def wrong(measured: str, hint: str) -> Result:
        return Result("jumper", tied, measured, Verdict.WIRING, f"{hint}: see {context.picture}")

    if not found["quiet"]:
        return wrong("somebody talks", f"take the receiver off {wire}")
    low = [name for name, level in zip((wire, pin), found["high"], strict=True) if not level]
    if low:
        names = " and ".join(low)
        verb = "is" if len(low) == 1 else "are"
        return wrong(f"{names} low", f"{names} {verb} held low: take off what is connected there")
    for key, level in (("low", 0), ("up", 1)):
        at_wire, at_pin = found[key]
        if at_pin != level:
            held = "high" if at_pin else "low"
            return wrong(f"{pin} stays {held}", f"{pin} is held {held}: take off what is there")
        if at_wire != level:
            return wrong("not tied", f"{wire} and {pin} are not tied")
    return judged("jumper", tied, "tied", True)


def analog(context: Context) -> Iterator[Result]:
    """The temperature sensor, and the ADC's pin for the battery against its own pulls."""
    battery = context.board.defaults["battery"]["voltage_pin"]
    found = ask(context.session, f"selftest_board.analog({battery})")
    volts = {key: value * _REFERENCE_V / _FULL_SCALE for key, value in found.items()}
    degrees = 27 - (volts["temperature"] - _AT_27_V) / _V_PER_DEGREE
    low, high = _TEMPERATURES
    yield judged(
        "ADC: temperature of the chip",
        f"{low}..{high} °C",
        f"{degrees:.0f} °C",
        low <= degrees <= high,
        "the ADC or its reference (ADC_VREF) is broken",
    )
    name = context.name(battery)
    expected = f"below {_LOW_V} V pulled down, above {_HIGH_V} V pulled up"
    measured = f"{volts['down']:.2f} V, {volts['up']:.2f} V"
    if volts["down"] < _LOW_V and volts["up"] > _HIGH_V:
        yield judged(f"ADC: {name}", expected, measured, True)
    else:
        yield Result(
            f"ADC: {name}",
            expected,
            measured,
            Verdict.WIRING,
            f"take off what is connected to {name}, the battery's divider too; with nothing there "
            "the pin is broken",
        )


def i2c(context: Context) -> Iterator[Result]:
    """The lines of the bus of the sensors, and who answers."""
    port = context.board.defaults["i2c"]
    pins = (port["sda_pin"], port["scl_pin"])
    names = [context.name(pin) for pin in pins]
    found = ask(context.session, f"selftest_board.i2c({port['bus']}, {pins[0]}, {pins[1]})")
    fault = _line_fault(names, found)
    expected = "SDA and SCL high, each low alone"
    if fault is not None:
        measured, hint = fault
        yield Result("I2C: lines", expected, measured, Verdict.WIRING, hint)
        yield Result("I2C: scan", "ends", "-", Verdict.SKIPPED)
        return
    yield judged("I2C: lines", expected, "so", True)
    answers = [f"0x{address:02x} ({_who(address)})" for address in found["answers"]]
    took_ms = found["scan_ms"]
    yield judged(
        "I2C: scan",
        f"ends within {_SCAN_MS} ms",
        f"{', '.join(answers) or 'nobody answers'}; {took_ms} ms",
        took_ms <= _SCAN_MS,
        "something on the bus holds it up: take the sensors off one by one",
    )


def _line_fault(names: list[str], found: dict[str, Any]) -> tuple[str, str] | None:
    """What is wrong with the lines, and what to do about it."""
    low = " and ".join(name for name, level in zip(names, found["high"], strict=True) if not level)
    if low:
        hint = f"{low} held low: take the sensors off; with nothing there the pin is shorted"
        return f"{low} low", hint
    driven = (tuple(found["sda_low"]), tuple(found["scl_low"]))
    if driven != ((0, 1), (1, 0)):
        measured = "SDA low: {}/{}, SCL low: {}/{}".format(*driven[0], *driven[1])
        return measured, f"{names[0]} and {names[1]} are shorted to each other or to 3.3 V"
    return None


def _who(address: int) -> str:
    return _I2C_NAMES.get(address, "unknown")
