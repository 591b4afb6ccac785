# only on esp32
"""A number that survives a reset of the chip, but no loss of power.

The ESP32 family keeps the memory of `machine.RTC` through a time-out of the watchdog and through
`machine.reset()` (MicroPython, RTC.memory).
"""

import machine

# What a number and its check word differ by, so that noise is not taken for one.
_MAGIC = 0x2B3C95A6


class Scratch:
    """The number in the RTC's memory, which wears not: save as often as you like."""

    def __init__(self):
        self._rtc = machine.RTC()

    def load(self):
        """Returns the number that was saved last, None after power-on."""
        memory = self._rtc.memory()
        if len(memory) != 8:
            return None
        number = int.from_bytes(memory[:4], "little")
        return number if int.from_bytes(memory[4:], "little") == number ^ _MAGIC else None

    def save(self, number):
        """Keeps `number`, 0..2^30 - 1."""
        check = number ^ _MAGIC
        self._rtc.memory(number.to_bytes(4, "little") + check.to_bytes(4, "little"))
