"""What the chips can do on which pin, and how many servo outputs they have.

Sources: RP2040 datasheet 1.4.3 and RP2350 datasheet, GPIO functions (the UART functions that only
the RP2350 has, F11, are left out); the ESP-IDF's pages on GPIO, ADC and LEDC of each ESP32 chip.
"""

from dataclasses import dataclass

KINDS = ("gpio", "input", "output", "led")
"""How a pin is reached: both ways, one way only, or not at all but for the LED on it."""


@dataclass(frozen=True)
class Outputs:
    """The hardware that makes servo pulses.

    Of "pwm_slices" two channels share a timer, and GPIO n and n+16 a channel; of "ledc" any
    channel takes any timer, and any pin any channel.
    """

    kind: str
    channels: int
    timers: int


@dataclass(frozen=True)
class Chip:
    """One chip; of the ESP32 family only the pins that are safe to use.

    Left out there are the pins of the flash, those that the chip looks at while it boots
    (strapping), of USB, and of the console.
    """

    name: str
    title: str
    outputs: Outputs
    adc_limit_mv: int
    """What an ADC pin reads at most; all take 3.3 V."""
    gpio: frozenset[int]
    input_only: frozenset[int] = frozenset()
    adc: frozenset[int] = frozenset()
    """Of the ESP32 family: pins of ADC1. ADC2 belongs to Wi-Fi."""

    @property
    def is_rp2(self) -> bool:
        return self.outputs.kind == "pwm_slices"

    def functions(self, gpio: int) -> frozenset[str]:
        """Everything but KINDS that the pin can be.

        "pwm3B": output B of slice 3; "uart0 tx", "i2c1 sda", "adc2": the only unit and signal
        that it has. "ledc", "uart", "i2c": of any unit, any signal; "adc".
        """
        if self.is_rp2:
            return _rp2(gpio)
        functions = {"adc"} if gpio in self.adc else set()
        if gpio in self.gpio:
            functions |= {"ledc", "uart", "i2c"}
        return frozenset(functions)


def _rp2(gpio: int) -> frozenset[str]:
    functions = {f"pwm{gpio >> 1 & 7}{'AB'[gpio & 1]}"}
    functions.add(f"i2c{gpio >> 1 & 1} {('sda', 'scl')[gpio & 1]}")
    if gpio & 3 in (0, 1):
        functions.add(f"uart{gpio + 4 >> 3 & 1} {('tx', 'rx')[gpio & 3]}")
    if gpio >= 26:
        functions.add(f"adc{gpio - 26}")
    return frozenset(functions)


def _set(*parts: int | range) -> frozenset[int]:
    return frozenset(
        pin for part in parts for pin in (part if isinstance(part, range) else (part,))
    )


# The RP2350 has twelve slices; in its small package no pin has the last four.
_PWM = Outputs("pwm_slices", channels=16, timers=8)

CHIPS = {
    chip.name: chip
    for chip in (
        Chip("rp2040", "RP2040", _PWM, 3300, _set(range(30))),
        Chip("rp2350", "RP2350", _PWM, 3300, _set(range(30))),
        Chip(
            "esp32",
            "ESP32",
            Outputs("ledc", channels=16, timers=8),
            adc_limit_mv=2450,
            gpio=_set(4, 13, 14, range(16, 20), range(21, 24), range(25, 28), 32, 33),
            input_only=_set(range(34, 40)),
            adc=_set(range(32, 40)),
        ),
        Chip(
            "esp32s3",
            "ESP32-S3",
            Outputs("ledc", channels=8, timers=4),
            adc_limit_mv=3100,
            gpio=_set(1, 2, range(4, 19), 21, range(38, 43), 47, 48),
            adc=_set(range(1, 11)),
        ),
        Chip(
            "esp32c3",
            "ESP32-C3",
            Outputs("ledc", channels=6, timers=4),
            adc_limit_mv=2500,
            gpio=_set(0, 1, range(3, 8), 10),
            adc=_set(range(5)),
        ),
    )
}
