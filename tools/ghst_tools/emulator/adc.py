"""Voltages at the ADC's inputs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

VREF_VOLTS = 3.3
_STEPS = 4096
_CHANNELS = 5  # GPIO 26 to 29 and the temperature sensor
_FIRST_PIN = 26
# 27 degrees Celsius (RP2040 datasheet, section 4.9.5).
_TEMPERATURE_VOLTS = 0.706
_IN_FROM_PAD = 17  # bit of IO_BANK0's STATUS

Volts = float | Callable[[float], float]


class AdcChannel:
    """One input. A voltage outside 0 to 3.3 V reads as the nearer end of the scale.

    Until a voltage is put on it, a pin has that of its level: what drives it, or its pull.
    `offset_volts` and `noise_volts`, called for each sample, are the ADC's own errors, none at
    first: a real one reads 8 to 24 mV of a pin at 0 V, and has some steps of noise.
    """

    def __init__(self, gpio: Any) -> None:
        """`gpio`: rp2040py's pin, None for the temperature sensor."""
        self._gpio = gpio
        self.offset_volts = 0.0
        self.noise_volts: Callable[[], float] | None = None
        self._volts: Volts | None = None if gpio else _TEMPERATURE_VOLTS

    def set_volts(self, volts: Volts) -> None:
        """Put `volts` on the input: a number, or a function of the emulated time in ns."""
        self._volts = volts

    def sample(self, t_ns: float) -> int:
        """Convert the voltage at `t_ns` to 12 bits."""
        volts = self._volts(t_ns) if callable(self._volts) else self._volts
        if volts is None:
            volts = VREF_VOLTS * (self._gpio.status >> _IN_FROM_PAD & 1)
        volts += self.offset_volts
        if self.noise_volts is not None:
            volts += self.noise_volts()
        return min(max(int(volts / VREF_VOLTS * _STEPS), 0), _STEPS - 1)


def install(mcu: Any) -> list[AdcChannel]:
    """Connect channels to the ADC of `mcu` and return them."""
    pins = [mcu.gpio[_FIRST_PIN + number] for number in range(_CHANNELS - 1)]
    channels = [AdcChannel(gpio) for gpio in [*pins, None]]
    adc, clock = mcu.adc, mcu.clock
    convert = adc.on_adc_read

    def read(channel: int) -> None:
        adc.channel_values[channel] = channels[channel].sample(clock.nanos)
        convert(channel)

    adc.on_adc_read = read
    return channels
