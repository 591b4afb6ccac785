"""Measures pulses at output pins, on the pin itself: an input reads what the PWM drives."""

import machine
import rp2
from machine import Pin
from micropython import const
from rp2 import PIO, asm_pio

TIMERS = const(3)
"""How many pins can be measured at once: the state machines of block 0 that are free."""

_FIRST = const(1)
_CYCLES_PER_ROUND = const(2)


# fmt: off
# ruff: noqa: F821 - the words of asm_pio
@asm_pio(in_shiftdir=PIO.SHIFT_RIGHT, autopush=True, push_thresh=32)
def _pulse():
    wait(0, pin, 0)             # a pulse that has begun already is not whole
    wait(1, pin, 0)
    mov(x, invert(null))
    label("high")
    jmp(x_dec, "next")
    label("next")
    jmp(pin, "high")
    in_(x, 32)
# fmt: on


class PulseTimer:
    """Measures high pulses on one pin, to within two cycles of the chip's clock."""

    def __init__(self, number, pin):
        """`number`: 0..2, which timer; `pin`: GPIO number, left as it is. Begins at once."""
        pin = Pin(pin)
        self._machine = rp2.StateMachine(
            _FIRST + number, _pulse, freq=machine.freq(), in_base=pin, jmp_pin=pin
        )
        self._machine.active(1)

    def finish(self):
        """Ends, and returns the widths in ns of up to four whole pulses."""
        self._machine.active(0)
        found = []
        while self._machine.rx_fifo():
            rounds = ~self._machine.get() & 0xFFFFFFFF
            found.append(rounds * _CYCLES_PER_ROUND * 1_000_000 // (machine.freq() // 1000))
        return found


def forget():
    """Gives the memory of block 0 back."""
    rp2.PIO(0).remove_program(_pulse)
