"""Where the pulses of the outputs are read for the console command `status`."""

import sys

import machine
import uctypes


def places(outputs, pulse_scale):
    """Yields GPIO, address of the halfword with its pulse, and its scale (`firmware.status_line`).

    `outputs`: `ServoOutputs` or `LedcOutputs`; `pulse_scale`: the scale of a quarter microsecond.
    """
    if sys.platform != "rp2":
        # LEDC does not tell: what it was given.
        for index, pin in enumerate(outputs.pins):
            yield pin, uctypes.addressof(outputs.shown) + 2 * index, pulse_scale
        return
    from firmware import chip

    base = chip.this_chip().PWM
    for pin in outputs.pins:
        registers = base + (pin >> 1 & 7) * chip.PWM_SLICE_SIZE
        divider = machine.mem32[registers + chip.PWM_DIVIDER]  # in sixteenths
        scale = round(divider * 100_000_000 / machine.freq())
        yield pin, registers + chip.PWM_COMPARE + 2 * (pin & 1), scale
