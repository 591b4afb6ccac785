"""Looks into the running chip from outside, as a debug probe does: the firmware knows nothing."""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterable
from typing import NamedTuple

from ghst import decoder  # type: ignore[import-not-found]
from ghst_tools.emulator import Board

# RP2040 datasheet, sections 2.5.7 (DMA) and 4.5.3 (PWM).
_DMA = 0x50000000
_DMA_CHANNELS, _DMA_STRIDE = 12, 0x40
_DMA_WRITE_ADDRESS, _DMA_CONTROL = 0x04, 0x10
_DREQ_PIO0_RX0 = 4
_PWM_STRIDE, _PWM_COMPARE, _PWM_SLICES_END = 0x14, 0x0C, 0xA0


class CompareWrites:
    """When the firmware writes the compare registers of the servos' PWM slices."""

    def __init__(self, board: Board, pins: Iterable[int]) -> None:
        self._board = board
        self._slices = {pin >> 1 & 7 for pin in pins}
        self._times: list[float] = []
        self._write = board.mcu.pwm.write_uint32
        board.mcu.pwm.write_uint32 = self._observe

    def last_between(self, start_ns: float, end_ns: float) -> float | None:
        """Time of the last write in this interval, its end excluded; None if there is none."""
        first = bisect_right(self._times, start_ns)
        after = bisect_left(self._times, end_ns)
        return self._times[after - 1] if after > first else None

    def _observe(self, offset: int, value: int) -> None:
        if offset < _PWM_SLICES_END:
            number, register = divmod(offset, _PWM_STRIDE)
            if register == _PWM_COMPARE and number in self._slices:
                self._times.append(self._board.now_ns)
        self._write(offset, value)


class DecoderState(NamedTuple):
    """What the firmware's `ghst.Receiver` has counted and knows."""

    frames: int = 0
    crc_errors: int = 0
    lq: int = 0
    rssi_dbm: int = 0


def decoder_memory(board: Board) -> int | None:
    """Address of the memory that the firmware's `ghst.decoder` works on; None before it runs.

    DMA moves the received bytes into the ring in it, so that the DMA channel tells where it is.
    """
    for channel in range(_DMA_CHANNELS):
        registers = _DMA + channel * _DMA_STRIDE
        control = board.read32(registers + _DMA_CONTROL)
        if control & 1 and control >> 15 & 0x3F == _DREQ_PIO0_RX0:
            target = board.read32(registers + _DMA_WRITE_ADDRESS)
            return (target & ~(decoder.RING_SIZE - 1)) - int(decoder.RING)
    return None


def decoder_state(board: Board) -> DecoderState:
    """Read the state of the firmware's receiver from the memory; all zero before it runs."""
    memory = decoder_memory(board)
    if memory is None:
        return DecoderState()

    def word(index: int) -> int:
        return board.read32(memory + 4 * index)

    return DecoderState(
        frames=word(decoder.FRAMES),
        crc_errors=word(decoder.CRC_ERRORS),
        lq=word(decoder.LINK_QUALITY),
        rssi_dbm=-word(decoder.RSSI),
    )


class ConsoleLog:
    """The lines that the board prints, each with the time at which it was complete."""

    _LINK = re.compile(r"^link: (\w+)")

    def __init__(self, board: Board) -> None:
        self.lines: list[tuple[float, str]] = []
        self._board = board
        self._partial = b""
        board.console.on_data = self._received

    @property
    def link(self) -> str:
        """The state of the link, in the firmware's own word."""
        for _, line in reversed(self.lines):
            if found := self._LINK.match(line):
                return found[1]
        return "?"

    def link_since(self, t_ns: float, state: str) -> float | None:
        """When the board first said, after `t_ns`, that the link is in `state`."""
        for line_ns, line in self.lines:
            found = self._LINK.match(line)
            if line_ns > t_ns and found and found[1] == state:
                return line_ns
        return None

    def _received(self, data: bytes) -> None:
        *lines, self._partial = (self._partial + data).split(b"\n")
        for line in lines:
            text = line.decode(errors="replace").strip()
            self.lines.append((self._board.now_ns, text))
