"""Voltages at the ADC's inputs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

VREF_VOLTS = 3.3
_STEPS = 4096
_CHANNELS = 5  # GPIO 26 to 29 and the temperature sensor

Volts = float | Callable[[float], float]


class AdcChannel:
    """One input. A voltage outside 0 to 3.3 V reads as the nearer end of the scale."""

    def __init__(self) -> None:
        self._volts: Volts = 0.0

    def set_volts(self, volts: Volts) -> None:
        """Put `volts` on the input: a number, or a function of the emulated time in ns."""
        self._volts = volts

    def sample(self, t_ns: float) -> int:
        """Convert the voltage at `t_ns` to 12 bits."""
        volts = self._volts(t_ns) if callable(self._volts) else self._volts
        return min(max(int(volts / VREF_VOLTS * _STEPS), 0), _STEPS - 1)


def install(mcu: Any) -> list[AdcChannel]:
    """Connect channels to the ADC of `mcu` and return them."""
    channels = [AdcChannel() for _ in range(_CHANNELS)]
    adc, clock = mcu.adc, mcu.clock
    convert = adc.on_adc_read

    def read(channel: int) -> None:
        adc.channel_values[channel] = channels[channel].sample(clock.nanos)
        convert(channel)

    adc.on_adc_read = read
    return channels
