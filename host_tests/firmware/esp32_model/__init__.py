"""The ESP32 port of MicroPython as the firmware sees it: `machine` and `time`, strict and in time.

Modelled from the documentation of MicroPython 1.25 (docs/library/machine.*.rst and
docs/esp32/quickref.rst, quoted where it decides), and where that is silent from the sources of the
port (ports/esp32/machine_*.c). Arguments that the port does not know are errors, values out of
range are errors, interrupts are soft (run between two steps of the main program, one at a time, up
to eight waiting), and each call takes time. Runs on CPython and on MicroPython's unix port.
"""

from esp32_model.board import BYTE_US, Board, ChipReset
from esp32_model.machine import Machine

__all__ = ("BYTE_US", "Board", "ChipReset", "Machine")
