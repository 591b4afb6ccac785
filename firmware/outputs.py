"""Servo outputs: pulses by the PWM hardware, compare registers written from the interrupt.

The hardware takes a new compare value over at the end of a period, so a pulse is never cut short
or doubled, and both channels of a slice share one register, which is written in one go.
"""

import time
from array import array

import machine

from firmware import chip
from firmware.interrupts import HOLD, MAXIMUM, MINIMUM, NONE, SLICE_WORDS


class ServoOutputs:
    """The servo pins of a board, what each of them follows, and what it does in failsafe.

    The interrupt writes pulses through `table`, slice by slice. `failsafe_pulses` holds what each
    output gives without its channel; `failsafe_rules` tells for each output what to put there:
    two words, its channel and its rule.
    """

    def __init__(self, channels, *, failsafe=None, frequency=50):
        """Prepares the pins; they stay low until a pulse width is written.

        `channels`: {GPIO number: channel 1..16}, none for goggles. `failsafe`: {GPIO number:
        HOLD, NONE or a pulse width in quarter microseconds}, NONE where absent. `frequency`:
        50..400 Hz. Raises `ValueError` for pins that share a PWM channel and for values outside
        these ranges.
        """
        for pin in failsafe or ():
            if pin not in channels:
                raise ValueError(f"failsafe names GP{pin}, which is no servo output")
        if not 50 <= frequency <= 400:
            raise ValueError(f"servo frequency is {frequency} Hz, must be 50..400")
        self._pins = sorted(channels)
        self._base = chip.this_chip().PWM
        self._period_ms = -(-1000 // frequency)
        # The finest step that 16 bits can count a period in and that divides the clock evenly.
        rate = 4_000_000 if frequency >= 62 else 3_200_000
        self._divider = (machine.freq() * 16 + rate // 2) // rate
        counts = machine.freq() * 16 / self._divider
        self._top = round(counts / frequency) - 1
        self._slices = sorted({pin >> 1 & 7 for pin in self._pins})
        self.table = self._new_table(round(counts * 65536 / 4_000_000))
        self.failsafe_pulses = array("H", [0] * len(self._pins))
        self.failsafe_rules = array("i", [0] * (2 * len(self._pins)))
        self._claim(channels, failsafe or {})
        self.enabled = tuple(
            (self._register(number, chip.PWM_CONTROL), 1) for number in self._slices
        )
        self._prepare()

    def _new_table(self, scale):
        table = array("i", [0] * (SLICE_WORDS * len(self._slices)))
        for index, number in enumerate(self._slices):
            table[index * SLICE_WORDS] = self._register(number, chip.PWM_COMPARE)
            table[index * SLICE_WORDS + 1] = scale
        return table

    def _claim(self, channels, failsafe):
        claimed = {}
        for index, pin in enumerate(self._pins):
            channel = channels[pin]
            rule = failsafe.get(pin, NONE)
            if not 1 <= channel <= 16:
                raise ValueError(f"GP{pin}: channel is {channel}, must be 1..16")
            if rule not in (NONE, HOLD) and not MINIMUM <= rule <= MAXIMUM:
                raise ValueError(f"GP{pin}: failsafe is {rule / 4} us, must be 800..2200")
            word = self._slices.index(pin >> 1 & 7) * SLICE_WORDS + 2 + (pin & 1)
            if word in claimed:
                raise ValueError(f"GP{pin} shares its PWM channel with GP{claimed[word]}")
            # The other half of a slice with one output takes the same pulse; no pin shows it.
            for half in (word, word ^ 1):
                if half not in claimed:
                    self.table[half] = channel - 1
                    self.table[half + 2] = index
            claimed[word] = pin
            self.failsafe_rules[2 * index] = channel - 1
            self.failsafe_rules[2 * index + 1] = rule

    def _register(self, number, offset):
        return self._base + number * chip.PWM_SLICE_SIZE + offset

    def _prepare(self):
        write = machine.mem32
        for number in self._slices:
            write[self._register(number, chip.PWM_CONTROL)] = 0
            write[self._register(number, chip.PWM_COUNTER)] = 0
            write[self._register(number, chip.PWM_COMPARE)] = 0
            write[self._register(number, chip.PWM_DIVIDER)] = self._divider
            write[self._register(number, chip.PWM_TOP)] = self._top
            write[self._register(number, chip.PWM_CONTROL)] = 1
        for pin in self._pins:
            machine.Pin(pin, mode=machine.Pin.ALT, alt=machine.Pin.ALT_PWM)

    def stop(self):
        """Ends the pulses: a running one is finished, then the pins are driven low."""
        for number in self._slices:
            machine.mem32[self._register(number, chip.PWM_COMPARE)] = 0
        time.sleep_ms(2 * self._period_ms)
        for pin in self._pins:
            machine.Pin(pin, machine.Pin.OUT, value=0)
        for number in self._slices:
            machine.mem32[self._register(number, chip.PWM_CONTROL)] = 0
