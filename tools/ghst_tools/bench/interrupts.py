"""CPU cycles of the firmware's two interrupts: run to one, and through it."""

from __future__ import annotations

from ghst_tools.bench.rig import CLOCK_HZ, TICK_NS, Running

# Exception numbers: interrupt + 16 (RP2040 datasheet, section 2.3.2: PIO0_IRQ_0, PIO1_IRQ_0). The
# wire is on a state machine of the first block, the tick on one of the second.
FRAME_EXCEPTION, _TICK_EXCEPTION = 16 + 7, 16 + 9

_CYCLE_NS = 1e9 / CLOCK_HZ
_LEAD_NS = 1e6


def exception_ns(running: Running, number: int, limit_ns: float) -> float:
    """Run to the first instruction of the next exception `number`; returns when that was.

    Goes instruction by instruction. Raises TimeoutError after `limit_ns`.
    """
    board, core = running.board, running.board.mcu.core
    end_ns = board.now_ns + limit_ns
    while core.ipsr != number:
        if board.now_ns >= end_ns:
            raise TimeoutError(f"no exception {number} within {limit_ns / 1e3:.0f} us")
        board.run_for(_CYCLE_NS)
    return board.now_ns


def exception_cycles(running: Running, number: int, limit_ns: float) -> int:
    """CPU cycles of the next exception `number`, to its return. Raises as `exception_ns`."""
    board, core = running.board, running.board.mcu.core
    exception_ns(running, number, limit_ns)
    before = board.cycles
    while core.ipsr == number:
        board.run_for(_CYCLE_NS)
    return board.cycles - before


def next_tick_ns(running: Running) -> float:
    """Run to the tick after the next one; returns when its interrupt began."""
    core = running.board.mcu.core
    running.board.run_until(lambda: core.ipsr == _TICK_EXCEPTION, 2 * TICK_NS, poll_ns=2e3)
    running.board.run_for(TICK_NS - 20e3)
    return exception_ns(running, _TICK_EXCEPTION, 50e3)


def frame_cycles(running: Running, frame: bytes) -> int:
    """CPU cycles of the whole interrupt that serves `frame`."""
    end_ns = running.wire.send(frame, running.board.now_ns + _LEAD_NS)
    # The state machine raises the interrupt in the middle of the stop bit.
    running.run_until(end_ns - 2e3)
    cycles = exception_cycles(running, FRAME_EXCEPTION, 100e3)
    running.board.run_for(_LEAD_NS)
    return cycles


def tick_cycles(running: Running) -> int:
    """CPU cycles of the whole interrupt of a tick."""
    next_tick_ns(running)
    return exception_cycles(running, _TICK_EXCEPTION, _CYCLE_NS)
