"""What the firmware's two interrupts cost: cycles of each, and the share of the CPU."""

from __future__ import annotations

from ghst_tools.bench.figures import Effort, Findings, Table
from ghst_tools.bench.rig import CLOCK_HZ, CONTROL_TYPES, TICK_NS, Rig, Running, control_frames

# Exception numbers: interrupt + 16 (RP2040 datasheet, section 2.3.2: PIO0_IRQ_0, PIO1_IRQ_0). The
# wire is on a state machine of the first block, the tick on one of the second.
FRAME_EXCEPTION, _TICK_EXCEPTION = 16 + 7, 16 + 9

_CYCLE_NS = 1e9 / CLOCK_HZ
_LEAD_NS = 1e6
_ROUNDS = 2  # the ring of 256 bytes wraps once in 18 frames

_RATES_HZ = (55, 160, 250, 500)

# Counts as fast as the CPU gets round, and leaves it to interrupts only. MicroPython sends what
# was printed while the program sleeps: from `spin` on nothing comes any more.
_COUNTING = """
import micropython, time, uctypes
from array import array
from firmware.adapter import Adapter
adapter = Adapter({arguments})
adapter.start()
@micropython.viper
def spin(count: ptr32):
    while True:
        count[0] += 1
count = array("I", [0])
print("count", uctypes.addressof(count), "end")
{ready}
time.sleep_ms({pause_ms})
spin(count)
"""
_PAUSE_MS = 20


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


def cycles(rig: Rig) -> tuple[Table, ...]:
    """What the two interrupts cost."""
    running = rig.asleep
    found: dict[str, list[int]] = {}
    frames = control_frames()
    for _ in range(_ROUNDS * len(CONTROL_TYPES)):
        frame = next(frames)
        found.setdefault(f"frame 0x{frame[2]:02x}", []).append(frame_cycles(running, frame))
    found["tick, every 10 ms"] = [tick_cycles(running)]
    table = Table(
        "CPU cycles of the whole interrupts",
        "From the first instruction of the exception to its return, with MicroPython's own part. "
        f"{_ROUNDS} frames of each type with random values. Once in 18 frames a frame lies across "
        "the end of the receive ring and takes longer; it is one of those here.",
        ("interrupt", "cycles, least", "cycles, most", "us at 125 MHz, most"),
        tuple(
            (name, f"{min(seen)}", f"{max(seen)}", f"{max(seen) * 1e6 / CLOCK_HZ:.2f}")
            for name, seen in found.items()
        ),
    )
    return (table,)


def share(rig: Rig, effort: Effort, findings: Findings) -> tuple[Table, ...]:
    """The share of the CPU that control frames take from the main program."""
    program = _COUNTING.format(arguments=rig.arguments(), ready=rig.ready, pause_ms=_PAUSE_MS)
    running = rig.run(program)
    board = running.board
    (address,) = running.numbers("count")
    board.run_for(2e6 * _PAUSE_MS)

    def rounds() -> int:
        before = board.read32(address)
        board.run_for(effort.share_s * 1e9)
        return board.read32(address) - before

    without = rounds()
    rows = [("none", "0", f"{without}", "")]
    receiver = running.receiver(control_frames(), 0.0)
    for rate_hz in _RATES_HZ:
        before = len(receiver.sent)
        receiver.rate_hz = rate_hz
        # In the middle of their slots, so that none is cut at either end.
        receiver.start(board.now_ns + 0.5e9 / rate_hz)
        left = rounds()
        receiver.stop()
        sent = len(receiver.sent) - before
        findings.share_percent = 100 * (1 - left / without)
        taken = f"{findings.share_percent:.2f} %"
        rows.append((f"{rate_hz}", f"{sent}", f"{left}", taken))
    table = Table(
        "Share of the CPU",
        "What control frames take from a main program: how often it gets round a loop of machine "
        f"code in {effort.share_s:g} s, against the same without frames (the tick and USB run in "
        "either case).",
        ("frames per second", "frames", "rounds", "taken by the frames"),
        tuple(rows),
    )
    return (table,)
