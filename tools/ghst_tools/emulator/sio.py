"""The single-cycle IO block: what firmware asks it for all the time, answered first.

rp2040py 0.3.6 goes through the registers one after the other, and those of the divider, which
every `//` and `%` needs, are near the end. The answers are the same.
Source: RP2040 datasheet, section 2.3.1.
"""

from __future__ import annotations

from typing import Any

from rp2040py.sio import RPSIO

_CPUID = 0x000
_UDIVIDEND, _UDIVISOR = 0x060, 0x064
_QUOTIENT, _REMAINDER, _CSR = 0x070, 0x074, 0x078
_CSR_READY, _CSR_DIRTY = 1 << 0, 1 << 1
_CYCLES = 8
_WORD = 0xFFFFFFFF


class Sio(RPSIO):
    """The SIO block of the chip."""

    def read_uint32(self, offset: int) -> int | float:
        if offset == _QUOTIENT:
            self.div_csr &= ~_CSR_DIRTY
            return self.div_quotient
        if offset == _REMAINDER:
            return self.div_remainder
        if offset == _CSR:
            return self.div_csr
        if offset == _CPUID:
            return 0
        return super().read_uint32(offset)

    def write_uint32(self, offset: int, value: int) -> None:
        if offset == _UDIVIDEND:
            self.div_dividend = value
        elif offset == _UDIVISOR:
            self.div_divisor = value
        else:
            super().write_uint32(offset, value)
            return
        if self.div_divisor == 0:
            self.update_hardware_divider(False)
            return
        self.div_quotient, self.div_remainder = divmod(
            self.div_dividend & _WORD, self.div_divisor & _WORD
        )
        self.div_csr = _CSR_READY | _CSR_DIRTY
        self.rp2040.core.cycles += _CYCLES


def install(mcu: Any) -> None:
    """Replace the SIO block of `mcu`; to be done before the chip runs."""
    mcu.sio = Sio(mcu)
