"""PWM, to the cycle: replaces rp2040py's model (defect 9 and what it gets wrong at the pin).

rp2040py 0.3.6 rounds times through floats, wraps late, reads EN back as 0 and never takes back a
DREQ. This model follows the RP2040 datasheet, section 4.5:

* a slice counts from 0 to TOP, one step every DIV system clocks (8.4 fixed point; the fraction is
  spread over the steps); an output is high while the counter is below its compare value, so
  compare 0 gives no pulse and compare TOP + 1 a constant high;
* TOP and the compare values are double-buffered: while a slice runs they take effect when it
  wraps, while it stands they take effect at once. No write can shorten or double a pulse;
* a slice that is disabled stops where it is, and its outputs stay as they are;
* phase-correct mode counts up and down and takes over new values at 0.

The counter modes that are clocked by an input pin (DIVMODE other than free-running) do not count.
"""

from __future__ import annotations

from typing import Any

from rp2040py.irq import IRQ
from rp2040py.peripherals.dma import DREQChannel
from rp2040py.peripherals.peripheral import BasePeripheral

_CYCLE_NS = 8.0
_SLICES = 8
_STRIDE = 0x14
_CSR, _DIV, _CTR, _CC, _TOP = 0x00, 0x04, 0x08, 0x0C, 0x10
_EN, _INTR, _INTE, _INTF, _INTS = 0xA0, 0xA4, 0xA8, 0xAC, 0xB0
_CSR_EN, _CSR_PH_CORRECT, _CSR_A_INV, _CSR_B_INV = 1 << 0, 1 << 1, 1 << 2, 1 << 3
_CSR_DIVMODE = 3 << 4
_CSR_PH_RET, _CSR_PH_ADV = 1 << 6, 1 << 7


class _Slice:
    """One slice: a counter and two compare outputs.

    The counter is described by where it stood (`_base`) at a time (`_base_ns`): it is worked out
    when somebody looks, and an alarm is set only for the next time an output changes.
    """

    def __init__(self, pwm: Pwm, index: int) -> None:
        self._pwm = pwm
        self._index = index
        self._clock = pwm.rp2040.clock
        self._alarm = self._clock.create_alarm(self._step)
        self._masks = tuple(
            sum(1 << pin for pin in (2 * index + half, 2 * index + half + 16) if pin < 30)
            for half in (0, 1)
        )
        self.reset()

    def reset(self) -> None:
        self._alarm.cancel()
        self.csr, self.div, self.cc, self.top = 0, 1 << 4, 0, 0xFFFF
        self._cc, self._top = 0, 0xFFFF  # the values in effect
        self._base, self._base_ns = 0, self._clock.nanos
        self._next = 0
        self._drive()

    @property
    def running(self) -> bool:
        return self.csr & (_CSR_EN | _CSR_DIVMODE) == _CSR_EN

    def read(self, offset: int) -> int:
        if offset == _CTR:
            return self._counter(self._position())
        return {_CSR: self.csr, _DIV: self.div, _CC: self.cc, _TOP: self.top}[offset]

    def write(self, offset: int, value: int) -> None:
        position = self._position()
        if offset == _CSR:
            counter = self._counter(position)
            nudge = bool(value & _CSR_PH_ADV) - bool(value & _CSR_PH_RET)
            value &= 0xFF & ~(_CSR_PH_ADV | _CSR_PH_RET)
            changed, self.csr = value ^ self.csr, value
            if not changed & (_CSR_EN | _CSR_PH_CORRECT | _CSR_DIVMODE) and not nudge:
                self._drive(position)  # at most the polarity
                return
            if changed & _CSR_PH_CORRECT:
                position = counter
            position = (position + nudge) % self._period()
        elif offset == _DIV:
            self.div = value & 0xFFF
        elif offset == _CTR:
            position = value & 0xFFFF
        elif offset == _CC:
            self.cc = value
        elif offset == _TOP:
            self.top = value & 0xFFFF
        if offset in (_CC, _TOP) and self.running:
            return  # waits in the buffer for the next wrap
        self._rebase(position)

    def _rebase(self, position: int) -> None:
        self._base, self._base_ns = position, self._clock.nanos
        self._next = position
        if not self.running:
            self._cc, self._top = self.cc, self.top
            self._alarm.cancel()
            return
        self._drive()
        self._arm()

    # -- the counter as a function of time ----------------------------------------------------

    def _period(self) -> int:
        if self.csr & _CSR_PH_CORRECT:
            return max(2 * self._top, 1)
        return self._top + 1

    def _counter(self, position: int) -> int:
        if self.csr & _CSR_PH_CORRECT and position > self._top:
            return 2 * self._top - position
        return position

    def _divider(self) -> int:
        return self.div if self.div >> 4 else self.div | 256 << 4  # INT 0 divides by 256

    def _position(self) -> int:
        if not self.running:
            return self._base
        cycles = int((self._clock.nanos - self._base_ns) / _CYCLE_NS + 1e-4)
        position = self._base + (cycles << 4) // self._divider()
        # A counter set above TOP runs on to 0xFFFF before it wraps.
        if self._base > self._top and not self.csr & _CSR_PH_CORRECT:
            return position if position <= 0xFFFF else 0
        return min(position, self._period())  # the wrap itself is the alarm's

    def _time_of(self, position: int) -> float:
        steps = position - self._base
        cycles = -(-steps * self._divider() >> 4)  # the first whole cycle that has so many steps
        return self._base_ns + cycles * _CYCLE_NS

    def _arm(self) -> None:
        """Set the alarm for the next position at which something happens."""
        period = self._period()
        here = self._next
        if self._base > self._top and not self.csr & _CSR_PH_CORRECT:
            self._next = 0x10000
        else:
            events = [period]
            for compare in (self._cc & 0xFFFF, self._cc >> 16):
                events.append(compare)
                if self.csr & _CSR_PH_CORRECT:
                    events.append(2 * self._top - compare + 1)
            self._next = min(
                event for event in events if here < event <= period or event == period
            )
        self._alarm.schedule(self._time_of(self._next) - self._clock.nanos)

    def _step(self) -> None:
        if self._next < self._period() and not self._base > self._top:
            self._drive(self._next)
            self._arm()
            return
        self._base_ns = self._time_of(self._next)
        self._base = self._next = 0
        self._cc, self._top = self.cc, self.top
        self._drive(0)
        self._arm()
        self._pwm.wrapped(self._index)

    def _drive(self, position: int | None = None) -> None:
        if position is None:
            position = self._position()
        counter = self._counter(position)
        high_a = counter < self._cc & 0xFFFF
        high_b = counter < self._cc >> 16
        self._pwm.drive(self._masks[0], high_a != bool(self.csr & _CSR_A_INV))
        self._pwm.drive(self._masks[1], high_b != bool(self.csr & _CSR_B_INV))


class Pwm(BasePeripheral):
    """The PWM block; `gpio_value` and `gpio_direction` are what rp2040py's pads read."""

    def __init__(self, mcu: Any) -> None:
        super().__init__(mcu, "PWM")
        self.gpio_value = 0
        self.gpio_direction = 0x3FFFFFFF
        self._int_raw = self._int_enable = self._int_force = 0
        self._slices = [_Slice(self, index) for index in range(_SLICES)]

    def reset(self) -> None:
        self._int_raw = self._int_enable = self._int_force = 0
        for pwm_slice in self._slices:
            pwm_slice.reset()
        self._check_interrupts()

    def read_uint32(self, offset: int) -> int:
        if offset < _EN:
            return self._slices[offset // _STRIDE].read(offset % _STRIDE)
        if offset == _EN:
            return sum((s.csr & _CSR_EN) << index for index, s in enumerate(self._slices))
        if offset == _INTR:
            return self._int_raw
        if offset == _INTE:
            return self._int_enable
        if offset == _INTF:
            return self._int_force
        if offset == _INTS:
            return self._int_raw & self._int_enable | self._int_force
        return int(super().read_uint32(offset))

    def write_uint32(self, offset: int, value: int) -> None:
        if offset < _EN:
            self._slices[offset // _STRIDE].write(offset % _STRIDE, value)
        elif offset == _EN:
            for index, pwm_slice in enumerate(self._slices):
                enable = value >> index & 1
                if pwm_slice.csr & _CSR_EN != enable:
                    pwm_slice.write(_CSR, pwm_slice.csr & ~_CSR_EN | enable)
        elif offset == _INTR:
            self._int_raw &= ~(self.raw_write_value & 0xFF)
        elif offset == _INTE:
            self._int_enable = value & 0xFF
        elif offset == _INTF:
            self._int_force = value & 0xFF
        else:
            super().write_uint32(offset, value)
        if offset > _EN:
            self._check_interrupts()

    def gpio_on_input(self, index: int) -> None:
        """An input has changed; none clocks a slice here."""

    def drive(self, mask: int, high: bool) -> None:
        """Set the outputs in `mask`."""
        value = self.gpio_value | mask if high else self.gpio_value & ~mask
        if value == self.gpio_value:
            return
        self.gpio_value = value
        while mask:
            self.rp2040.gpio[(mask & -mask).bit_length() - 1].check_for_updates()
            mask &= mask - 1

    def wrapped(self, index: int) -> None:
        """Slice `index` has wrapped: raise its interrupt and pass one DREQ."""
        self._int_raw |= 1 << index
        self._check_interrupts()
        dma = self.rp2040.dma
        dma.set_dreq(DREQChannel.DREQ_PWM_WRAP0 + index)
        dma.clear_dreq(DREQChannel.DREQ_PWM_WRAP0 + index)

    def _check_interrupts(self) -> None:
        pending = self._int_raw & self._int_enable | self._int_force
        self.rp2040.set_interrupt(IRQ.PWM_WRAP, bool(pending))


def install(mcu: Any) -> None:
    """Replace the PWM block of `mcu`; to be done before the chip runs."""
    mcu.pwm = mcu.peripherals[0x40050] = Pwm(mcu)
