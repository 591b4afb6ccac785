"""An RX5808 video receiver module (RTC6715) on three pins of the emulated board.

It notes every departure from the data sheet in `errors` and does not take the word then, where a
real module would take something. Source: RTC6715 data sheet, SPI timing and register map.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

from ghst_tools.emulator.board import Board

SYNTHESIZER_A, SYNTHESIZER_B, POWER_DOWN, STATE = 0x00, 0x01, 0x0A, 0x0F
DEFAULTS = {SYNTHESIZER_A: 0x00008, SYNTHESIZER_B: 0x02A05, POWER_DOWN: 0x10DF3}

_BITS = 25
_MINIMUM_NS = 100.0
"""The longest of the data sheet's minimum times (20, 30 and 100 ns), asked of every level."""
_OSCILLATOR_MHZ = 8
_INTERMEDIATE_MHZ = 479
_RESERVED = range(0x0B, 0x0F)
# Mixer, IF buffer, synthesizer, bias, IF and base-band regulators, RSSI, demodulator, video
# amplifier and clamp: the parts that power-on leaves on.
_FOR_VIDEO = 0xFFFFF & ~DEFAULTS[POWER_DOWN]


class Write(NamedTuple):
    """A register that was written."""

    t_ns: float
    address: int
    value: int


class Rx5808Module:
    """The module; `writes` are the words it has taken, `registers` what is in it now."""

    def __init__(self, board: Board, *, clock: int, data: int, select: int) -> None:
        self.registers: dict[int, int] = dict(DEFAULTS)
        self.writes: list[Write] = []
        self.errors: list[str] = []
        self.powered = True
        self._levels = {"clock": False, "data": False, "select": True}
        self._changed_ns: dict[str, float] = dict.fromkeys(self._levels, -_MINIMUM_NS)
        self._bits: list[bool] = []
        for name, pin in (("clock", clock), ("data", data), ("select", select)):
            self._levels[name] = bool(board.pin(pin).level)
            board.pin(pin).watch_level(partial(self._changed, name))

    @property
    def frequency_mhz(self) -> float:
        """What the synthesizer's registers tune the module to."""
        n, a = divmod(self.registers[SYNTHESIZER_B], 1 << 7)
        step_mhz = _OSCILLATOR_MHZ / self.registers[SYNTHESIZER_A]
        return 2 * (32 * n + a) * step_mhz + _INTERMEDIATE_MHZ

    @property
    def receives_video(self) -> bool:
        """Whether all parts are on that a picture needs."""
        return self.powered and not self.registers[POWER_DOWN] & _FOR_VIDEO

    def power(self, on: bool) -> None:
        """Switch the module off, or on with its registers as after power-on."""
        self.powered = on
        self.registers = dict(DEFAULTS)
        self._bits.clear()

    def _changed(self, name: str, t_ns: float, level: bool | None, _cause: str) -> None:
        level = bool(level)
        if level is self._levels[name]:
            return
        self._levels[name] = level
        last_ns = max(self._changed_ns.values())
        self._changed_ns[name] = t_ns
        if not self.powered:
            return
        if self._bits and t_ns - last_ns < _MINIMUM_NS:
            self._error(t_ns, f"{name} changes {t_ns - last_ns:.0f} ns after the last change")
        if name == "clock" and level:
            self._clock_rises(t_ns)
        elif name == "data" and self._levels["clock"]:
            self._error(t_ns, "data changes while the clock is high")
        elif name == "select":
            self._select_changes(t_ns, level)

    def _clock_rises(self, t_ns: float) -> None:
        if self._levels["select"]:
            self._error(t_ns, "the clock rises while select is high")
        else:
            self._bits.append(self._levels["data"])

    def _select_changes(self, t_ns: float, level: bool) -> None:
        if self._levels["clock"]:
            self._error(t_ns, "select changes while the clock is high")
        # Without a bit nothing is written: it is what a reset of the board does.
        if level and self._bits:
            self._take(t_ns)
        self._bits.clear()

    def _take(self, t_ns: float) -> None:
        if len(self._bits) != _BITS:
            self._error(t_ns, f"{len(self._bits)} bits instead of {_BITS}")
            return
        word = sum(bit << place for place, bit in enumerate(self._bits))
        address, writes, value = word & 0xF, word >> 4 & 1, word >> 5
        if not writes:
            self._error(t_ns, f"register {address:#x} is read, and nobody listens")
        elif address in _RESERVED:
            self._error(t_ns, f"register {address:#x} is reserved")
        else:
            if address == STATE:
                self.registers = dict(DEFAULTS)
            self.registers[address] = value
            self.writes.append(Write(t_ns, address, value))

    def _error(self, t_ns: float, text: str) -> None:
        self.errors.append(f"{t_ns / 1e3:.3f} us: {text}")
