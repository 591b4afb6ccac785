"""Numbers of the control path that every board shares: limits of pulses, failsafe, the link."""

from micropython import const

# Pulse limits in quarter microseconds: 800 us and 2200 us.
MINIMUM = const(3200)
MAXIMUM = const(8800)

# Failsafe of an output; any other value is a pulse width in quarter microseconds.
NONE = const(0)
HOLD = const(-1)

SEARCHING = const(0)
LINKED = const(1)
FAILSAFE = const(2)

# The word of the frame interrupt where `shape` finds what it works on (`firmware.shapes`).
SHAPES = const(25)
