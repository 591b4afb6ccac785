"""I2C targets behind two pins that software drives itself (`SoftI2C`, and `scan()` of `I2C`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from ghst_tools.emulator.pins import Cause, Pin

if TYPE_CHECKING:
    from ghst_tools.emulator.i2c import I2cTarget

_ACK_BIT = 8


class PinBus:
    """The targets' end of SDA and SCL, both pulled up. A target never stretches the clock."""

    def __init__(self, targets: Mapping[int, I2cTarget], sda: Pin, scl: Pin) -> None:
        self._targets = targets
        self._sda, self._scl = sda, scl
        self._target: I2cTarget | None = None
        self._active = False  # between start and stop
        self._addressing = False  # the byte under way is the address
        self._reading = False  # the target sends the bytes
        self._bit = 0  # number of the bit under way
        self._byte = 0
        self._acknowledged = False
        self._held_clocks = 0  # until the target that holds SDA lets go
        self._let_go: Callable[[], None] | None = None
        sda.pull(True)
        scl.pull(True)
        sda.watch_level(self._sda_changed)
        scl.watch_level(self._scl_changed)

    def hold_sda(self, clocks: int, let_go: Callable[[], None]) -> None:
        """Keep SDA low until the clock has fallen `clocks` times, then call `let_go`.

        A target does so that was interrupted while it sent a byte of zeros.
        """
        self._held_clocks, self._let_go = clocks, let_go
        self._active = False
        self._drive(None)

    def _drive(self, level: bool | None) -> None:
        self._sda.drive(False if self._held_clocks else level)

    def _count_held_clock(self) -> None:
        self._held_clocks -= 1
        if not self._held_clocks:
            self._drive(None)
            if self._let_go is not None:
                self._let_go()

    def _sda_changed(self, _t_ns: float, level: bool | None, cause: Cause) -> None:
        if cause != "device" or not self._scl.level:
            return
        if self._target is not None:
            self._target.stop()
            self._target = None
        self._active = self._addressing = not level  # falling: start; rising: stop
        self._reading = False
        self._bit, self._byte = -1, 0  # the clock falls once before the first bit

    def _scl_changed(self, _t_ns: float, level: bool | None, _cause: Cause) -> None:
        if self._held_clocks and not level:
            self._count_held_clock()
        if not self._active:
            return
        if level:
            self._sample()
        else:
            self._advance()

    def _sample(self) -> None:
        if self._bit < _ACK_BIT and not self._reading:
            self._byte = self._byte << 1 | bool(self._sda.level)
        elif self._bit == _ACK_BIT and self._reading:
            self._acknowledged = not self._sda.level

    def _advance(self) -> None:
        """The clock has fallen: the next bit begins."""
        self._bit += 1
        if self._bit == _ACK_BIT:
            self._drive(None if self._reading else self._take())
        elif self._bit > _ACK_BIT:
            self._bit, byte, self._byte = 0, self._byte, 0
            if self._addressing:
                self._addressing = False
                self._reading = bool(byte & 1) and self._target is not None
            elif self._reading and not self._acknowledged:
                self._reading = self._active = False
            if self._reading and self._target is not None:
                self._byte = self._target.read()
        if self._bit < _ACK_BIT:
            low = self._reading and not self._byte >> (7 - self._bit) & 1
            self._drive(False if low else None)

    def _take(self) -> bool | None:
        """Hand over the byte that is complete; False drives the acknowledgement."""
        if self._addressing:
            target = self._targets.get(self._byte >> 1)
            if target is not None and target.start(bool(self._byte & 1)):
                self._target = target
                return False
            self._active = False
            return None
        if self._target is not None and self._target.write(self._byte):
            return False
        return None
