"""What the pads know: edges since they were asked last, and pulls while a pin is analog.

Sources: RP2040 datasheet and RP2350 datasheet, chapter GPIO. Edges are kept in INTR, whoever
drives the pin and whether or not anybody wants an interrupt, until they are cleared; a reset of
the chip clears them.
"""

import sys

import machine
from micropython import const

_FELL = const(4)
_ROSE = const(8)
_DOWN = const(4)
_UP = const(8)
_INPUT = const(0x40)
# First register of INTR, and of the pads.
if "RP2040" in sys.implementation._machine:
    _EDGES, _PADS = 0x400140F0, 0x4001C004
else:
    _EDGES, _PADS = 0x40028230, 0x40038004


def _place(pin):
    return _EDGES + 4 * (pin >> 3), 4 * (pin & 7)


def clear(pins):
    """Forgets the edges of these pins."""
    for pin in pins:
        register, shift = _place(pin)
        machine.mem32[register] = (_FELL | _ROSE) << shift


def rose(pins):
    """Returns those of `pins` that have risen since they were cleared."""
    return [pin for pin in pins if _edges(pin) & _ROSE]


def changed(pins):
    """Returns those of `pins` that have risen or fallen since they were cleared."""
    return [pin for pin in pins if _edges(pin) & (_ROSE | _FELL)]


def _edges(pin):
    register, shift = _place(pin)
    return machine.mem32[register] >> shift


def pull(pin, up):
    """Pulls a pin up or down that is an input of the ADC, or lets it float with None."""
    register = _PADS + 4 * pin
    value = machine.mem32[register] & ~(_UP | _DOWN | _INPUT)
    if up is not None:
        value |= _UP if up else _DOWN
    machine.mem32[register] = value
