# only on rp2
"""Servo outputs: pulses by the PWM hardware, compare registers written from the interrupt.

The hardware takes a new compare value over at the end of a period, so a pulse is never cut short
or doubled, and both channels of a slice share one register, which is written in one go.
"""

import time
from array import array

import machine
import uctypes

from firmware import chip
from firmware.interrupts import SLICE_WORDS
from firmware.limits import MAXIMUM, MINIMUM
from firmware.output import by_pin, shapes

# The finest step for a frequency in Hz and above: PWM counts a second. 16 bits count a period, the
# rate divides the clock evenly, and a product with the longest pulse has 31 bits.
_RATES = ((123, 8_000_000), (62, 4_000_000), (0, 3_200_000))


class ServoOutputs:
    """The outputs of a board, what each of them follows, and what it does in failsafe.

    The interrupt writes pulses through `table`, slice by slice. `failsafe_pulses` holds what each
    output gives without its channel; `failsafe_rules` tells for each output what to put there:
    two words, the address of its pulse and its rule. `shapes`: `Shapes` if there are outputs that
    are not plain, else None. `pins`: the GPIO numbers, rising.
    """

    def __init__(self, channels, receiver, *, failsafe=None, arming=None, link_limits=None):
        """Prepares the pins; they stay low until a pulse width is written.

        `channels`: {GPIO number: `Output` or channel 1..16}, none for goggles. `receiver`: the
        `ghst.Receiver` that brings the channels. `failsafe`: {GPIO number: HOLD, NONE or a pulse
        width in quarter microseconds} of those given as a channel. `arming`: None or the arguments
        of `Shapes.set_arming`, `link_limits`: None or those of `Shapes.set_link_limits`. Raises
        `ValueError` for pins that share a PWM channel or a slice with another frequency, and for
        values that cannot be.
        """
        self._outputs = by_pin(channels, failsafe or {})
        self.pins = sorted(self._outputs)
        self._base = chip.this_chip().PWM
        self._slices = sorted({pin >> 1 & 7 for pin in self.pins})
        self._period_ms = 20
        self.table = array("i", [0] * (SLICE_WORDS * len(self._slices)))
        self.failsafe_pulses = array("H", [0] * len(self.pins))
        self.failsafe_rules = array("i", [0] * (2 * len(self.pins)))
        self._unused = array("i", [0])
        clock = chip.this_chip().TIMER_RAW_LOW
        self.shapes = shapes(self._outputs, receiver, clock, arming, link_limits)
        self._claim(receiver)
        self.enabled = tuple(
            (self._register(number, chip.PWM_CONTROL), 1) for number in self._slices
        )
        self._prepare()
        self._outputs = None  # it is all in the tables now

    @property
    def lost_address(self):
        """Address of the word that the tick sets when the link ends."""
        return self.shapes.lost_address if self.shapes else uctypes.addressof(self._unused)

    @property
    def shape(self):
        """The function that works the shapes out in the frame interrupt, or None."""
        if self.shapes is None:
            return None
        try:
            from firmware.shape_thumb import shape
        except ImportError:  # no Arm core
            from firmware.shape_viper import shape
        return shape

    @property
    def armed(self):
        """Whether motors run, where something arms them; else always."""
        return self.shapes is None or not self.shapes.arming or self.shapes.armed

    def _claim(self, receiver):
        claimed = {}
        frequencies = {}
        for index, pin in enumerate(self.pins):
            output = self._outputs[pin]
            number = pin >> 1 & 7
            place = (number, pin & 1)
            if place in claimed:
                raise ValueError(f"GP{pin} shares its PWM channel with GP{claimed[place]}")
            other = frequencies.setdefault(number, pin)
            if self._outputs[other].frequency_hz != output.frequency_hz:
                raise ValueError(f"GP{pin} shares its PWM slice, so its frequency, with GP{other}")
            failsafe = uctypes.addressof(self.failsafe_pulses) + 2 * index
            pulse = uctypes.addressof(receiver.pulses) + 2 * (output.channel - 1)
            if output.shaped:
                pulse = self.shapes.add(output, failsafe)
            at = self._slices.index(number) * SLICE_WORDS
            self.table[at] = self._register(number, chip.PWM_COMPARE)
            scale, added = _scale(output)
            words = (pulse, scale, added, failsafe)
            # The other half of a slice with one output takes the same pulse; no pin shows it.
            for half in (pin & 1, ~pin & 1):
                if half == pin & 1 or (number, half) not in claimed:
                    for word in range(4):
                        self.table[at + 1 + 4 * half + word] = words[word]
            claimed[place] = pin
            self.failsafe_rules[2 * index] = pulse
            self.failsafe_rules[2 * index + 1] = output.failsafe
            if output.switch:
                # Off before its channel has come: zero would be no known level.
                self.failsafe_pulses[index] = MINIMUM

    def _register(self, number, offset):
        return self._base + number * chip.PWM_SLICE_SIZE + offset

    def _prepare(self):
        write = machine.mem32
        for number in self._slices:
            first = next(pin for pin in self.pins if pin >> 1 & 7 == number)
            hertz = self._outputs[first].frequency_hz
            write[self._register(number, chip.PWM_CONTROL)] = 0
            write[self._register(number, chip.PWM_COUNTER)] = 0
            write[self._register(number, chip.PWM_COMPARE)] = 0
            write[self._register(number, chip.PWM_DIVIDER)] = _divider(hertz)
            write[self._register(number, chip.PWM_TOP)] = _top(hertz)
            write[self._register(number, chip.PWM_CONTROL)] = 1
        for pin in self.pins:
            machine.Pin(pin, mode=machine.Pin.ALT, alt=machine.Pin.ALT_PWM)

    def stop(self):
        """Ends the pulses: a running one is finished, then the pins are driven low."""
        for number in self._slices:
            machine.mem32[self._register(number, chip.PWM_COMPARE)] = 0
        time.sleep_ms(2 * self._period_ms)
        for pin in self.pins:
            machine.Pin(pin, machine.Pin.OUT, value=0)
        for number in self._slices:
            machine.mem32[self._register(number, chip.PWM_CONTROL)] = 0


def _divider(hertz):
    """Returns the clock divider in sixteenths."""
    rate = next(rate for least, rate in _RATES if hertz >= least)
    return (machine.freq() * 16 + rate // 2) // rate


def _counts(hertz):
    """Returns PWM counts a second."""
    return machine.freq() * 16 / _divider(hertz)


def _top(hertz):
    return round(_counts(hertz) / hertz) - 1


def _scale(output):
    """Returns the factor from a pulse to its compare value, and what is added, times 65536."""
    hertz = output.frequency_hz
    if not output.switch:
        return round(_counts(hertz) * 65536 / 4_000_000 / output.shortened), 0x8000
    # Off is 0, on is beyond the period: more than 31 bits, and taken as unsigned.
    scale = ((_top(hertz) + 1) << 16) // (MAXIMUM - MINIMUM)
    rest = ((_top(hertz) + 1) << 16) - scale * (MAXIMUM - MINIMUM)
    return scale, _word(rest - MINIMUM * scale)


def _word(value):
    """Returns the signed word with the lowest 32 bits of `value`."""
    value &= 0xFFFFFFFF
    return value - (value >> 31 << 32)
