"""The bus of the chip, without a detour that rp2040py takes at every access.

The compiled core of rp2040py 0.3.6 asks before each access whether somebody has overridden the
method for it, and has Python make a bound method to find out: two thirds of all the time a busy
chip takes. With the bound methods at hand in the chip itself there is nothing to be made. They
come first, since the chip has some forty attributes and these are looked up millions of times a
second.

What runs, and when, is the same to the cycle.
"""

from __future__ import annotations

from typing import Any

_ACCESSES = (
    "read_uint16",  # each instruction is fetched with it
    "read_uint32",
    "write_uint32",
    "read_uint8",
    "write_uint8",
    "write_uint16",
)


def install(mcu: Any) -> None:
    """Put the methods for access to the bus of `mcu` where they are found at once."""
    attributes = mcu.__dict__
    others = dict(attributes)
    attributes.clear()
    for name in _ACCESSES:
        setattr(mcu, name, getattr(mcu, name))
    attributes.update(others)
