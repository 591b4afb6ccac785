"""`I2cBus`: an I2C bus that several sensors share; its transfers never raise and never hang.

A transfer ends after its time-out at the latest: 0.8 ms at 400 kHz. When the bus does not move or
a line stays low behind a fault, nobody gets the bus until the lines have been freed: nine clocks
and a stop bring every target that still sends a byte to its end (I2C-bus specification, UM10204,
section 3.1.16), then the controller starts afresh. What does not help is tried again after 10 ms,
20 ms and so on up to a second. Only a transfer that fails allocates: the exception that
MicroPython raises.
"""

import errno
import sys
import time

import machine
import micropython
from machine import Pin
from micropython import const

from ghst.schedule import ticks_diff

MAXIMUM_READ = const(12)
"""The longest read in bytes, so that it fits into the time-out."""

_SLOWEST = const(100_000)
_FASTEST = const(400_000)
# Beyond the bytes themselves: the interrupts and the USB that run meanwhile.
_SLACK_US = const(500)
_FIRST_PAUSE_MS = const(10)
_LONGEST_PAUSE_MS = const(1000)
_CLOCKS = const(9)
_HALF_CLOCK_US = const(5)
_COUNTER_MASK = const(0x3FFFFFFF)


class I2cBus:
    """One controller of the chip and its two pins.

    `faults` counts transfers that failed: nobody answered, an answer broke off, or the bus did not
    move; `timeouts` the last kind alone; `recoveries` how often the lines were freed. All modulo
    2^30.
    """

    def __init__(self, id, *, sda, scl, freq=400_000):
        """`id`: number of the controller; `sda`, `scl`: GPIO numbers; `freq`: 100000..400000 Hz.

        Raises `ValueError` for a frequency or pins that cannot be.
        """
        if not _SLOWEST <= freq <= _FASTEST:
            raise ValueError(f"I2C at {freq} Hz: must be {_SLOWEST}..{_FASTEST}")
        self.faults = 0
        self.timeouts = 0
        self.recoveries = 0
        self._id = id
        self._sda = sda
        self._scl = scl
        self._freq = freq
        self._timeout_us = _SLACK_US + (MAXIMUM_READ + 1) * 9 * 1_000_000 // freq
        self._register = bytearray(1)
        self._command = bytearray(2)
        self._blocked = False
        self._blocked_ms = 0
        self._now_ms = 0
        self._pause_ms = _FIRST_PAUSE_MS
        try:
            self._start_controller()
        except ValueError as error:
            raise ValueError(
                f"I2C{id} cannot have SDA on GP{sda} and SCL on GP{scl}: {error}"
            ) from error

    def _start_controller(self):
        if sys.platform == "esp32":
            # There a controller is waited for, and that for a tenth of a second with each byte
            # (ports/esp32/machine_i2c.c): no pulse would move. The CPU does it in good time.
            self._i2c = machine.SoftI2C(
                Pin(self._scl), Pin(self._sda), freq=self._freq, timeout=self._timeout_us
            )
            return
        # Its time-out is for one write or one read; a write and then a read have it twice.
        self._i2c = machine.I2C(
            self._id,
            sda=Pin(self._sda),
            scl=Pin(self._scl),
            freq=self._freq,
            timeout=self._timeout_us,
        )

    def ready(self, now_ms):
        """Whether transfers are possible now; a sensor asks at the start of each `update`.

        Frees the lines when that is due, which takes 0.5 ms; then the answer is still False.
        """
        self._now_ms = now_ms
        if not self._blocked:
            return True
        if ticks_diff(now_ms, self._blocked_ms) >= self._pause_ms:
            self._blocked_ms = now_ms
            self._pause_ms = min(2 * self._pause_ms, _LONGEST_PAUSE_MS)
            if self._free_lines():
                self._blocked = False
                self.recoveries = (self.recoveries + 1) & _COUNTER_MASK
        return False

    # Native: as bytecode it would take the heap for its frame.
    @micropython.native
    def read(self, address, register, buffer):
        """Reads registers from `register` on into `buffer`; returns whether all of them came.

        `address`: 7 bits; `buffer`: at most `MAXIMUM_READ` bytes.
        """
        if self._blocked:
            return False
        self._register[0] = register
        timed_out = False
        # Not readfrom_mem_into(): when nobody answers it bit-bangs another address on the pins.
        try:
            if self._i2c.writeto(address, self._register, False) == 1:
                self._i2c.readfrom_into(address, buffer)
                self._pause_ms = _FIRST_PAUSE_MS
                return True
        except OSError as error:
            timed_out = error.errno == errno.ETIMEDOUT
        self._failed(timed_out)
        return False

    @micropython.native
    def write(self, address, register, value):
        """Writes one register; returns whether the target acknowledged all of it."""
        if self._blocked:
            return False
        self._command[0] = register
        self._command[1] = value
        timed_out = False
        try:
            if self._i2c.writeto(address, self._command) == 2:
                self._pause_ms = _FIRST_PAUSE_MS
                return True
        except OSError as error:
            timed_out = error.errno == errno.ETIMEDOUT
        self._failed(timed_out)
        return False

    def _failed(self, timed_out):
        self.faults = (self.faults + 1) & _COUNTER_MASK
        if timed_out:
            self.timeouts = (self.timeouts + 1) & _COUNTER_MASK
        elif Pin(self._sda).value() and Pin(self._scl).value():
            return
        self._blocked = True
        self._blocked_ms = self._now_ms

    def _free_lines(self):
        """Clocks the targets to the end of what they send; returns whether both lines are high."""
        sda = Pin(self._sda, Pin.OPEN_DRAIN, Pin.PULL_UP, value=1)
        scl = Pin(self._scl, Pin.OPEN_DRAIN, Pin.PULL_UP, value=1)
        time.sleep_us(_HALF_CLOCK_US)
        if scl.value():
            for _ in range(_CLOCKS):
                scl.value(0)
                time.sleep_us(_HALF_CLOCK_US)
                scl.value(1)
                time.sleep_us(_HALF_CLOCK_US)
            # A stop: SDA rises while SCL is high.
            scl.value(0)
            sda.value(0)
            time.sleep_us(_HALF_CLOCK_US)
            scl.value(1)
            time.sleep_us(_HALF_CLOCK_US)
            sda.value(1)
            time.sleep_us(_HALF_CLOCK_US)
        free = bool(sda.value() and scl.value())
        self._start_controller()
        return free

    def describe(self):
        """Returns a line for the status, such as "I2C0, 400 kHz: 3 faults, 1 recovered"."""
        text = f"I2C{self._id}, {self._freq // 1000} kHz: {self.faults} faults"
        text += f", {self.recoveries} recovered" if self.recoveries else ""
        return text + (", blocked" if self._blocked else "")
