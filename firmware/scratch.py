# only on rp2
"""A number that survives a reset of the chip, but no loss of power.

The RP2040 and the RP2350 keep the scratch registers of their watchdog through a time-out of the
watchdog and through `machine.reset()`, and clear them at power-on (data sheets, chapter Watchdog).
The boot ROM and the Pico SDK use number 4 to 7, MicroPython none.
"""

import machine

from firmware import chip

# What a number and its check word differ by, so that neither zeros nor noise are taken for one.
_MAGIC = 0x2B3C95A6


class Scratch:
    """The number in scratch registers 0 to 3. Registers wear not: save as often as you like."""

    def __init__(self):
        first = chip.this_chip().WATCHDOG + chip.WATCHDOG_SCRATCH
        self._registers = tuple(first + 4 * number for number in range(4))

    def load(self):
        """Returns the number that was saved last, None after power-on."""
        # Two copies: the watchdog may have bitten in the middle of `save`.
        for at in (0, 2):
            number = machine.mem32[self._registers[at]]
            if machine.mem32[self._registers[at + 1]] == number ^ _MAGIC:
                return number
        return None

    def save(self, number):
        """Keeps `number`, 0..2^30 - 1: small integers, the only ones that need no memory here."""
        registers = self._registers
        memory = machine.mem32
        memory[registers[0]] = number
        memory[registers[1]] = number ^ _MAGIC
        memory[registers[2]] = number
        memory[registers[3]] = number ^ _MAGIC
