"""The control path in time: how late the registers are, and how late failsafe is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import islice
from multiprocessing import get_context

from ghst_tools.bench.figures import (
    COLLECTING,
    FLOODING,
    IDLE,
    MEETING,
    SENSORS,
    Effort,
    Findings,
    Spread,
    Table,
)
from ghst_tools.bench.interrupts import next_tick_ns
from ghst_tools.bench.rig import CONTROL_TYPES, FAILSAFE_MS, TICK_NS, Rig, Running, control_frames
from ghst_tools.campaign.pico import TALKING_SETUP
from ghst_tools.demo.aircraft import Aircraft, Devices
from ghst_tools.demo.probes import decoder_state
from ghst_tools.emulator.receiver import DownlinkFrame
from ghst_tools.emulator.wire import BAUD

# In each of them a telemetry frame waits as soon as the last one is gone.
LOADS = {
    IDLE: "adapter.poll(); refill(); machine.idle()",
    COLLECTING: "adapter.poll(); refill(); [bytearray(64) for n in range(20)]; gc.collect()",
    FLOODING: "adapter.poll(); refill(); print('x' * 200)",
}
# Until the barometer has its zero and the GPS receiver its new baud rate.
_SENSORS_NS = 1.5e9
_START_LIMIT_NS = 3e9

Frames = Callable[[], Iterator[bytes]]

# A little off 500 Hz, where every frame would keep its phase to the tick of 10 ms.
_RATE_HZ = 500 / (1 + 1 / 400)
_SERVED_WITHIN_NS = 1e6
_LEAD_NS = 1e6

# Where the ends of frames are put around the start of the tick's interrupt: from, and how far.
_AROUND_TICK_NS = (-2e3, 18e3)


def latencies_us(running: Running, count: int) -> tuple[list[float], int]:
    """Last stop bit to last compare register for `count` frames; and how many were not served."""
    return fly(running, count)[:2]


def fly(
    running: Running, count: int, frames: Iterator[bytes] | None = None
) -> tuple[list[float], int, list[DownlinkFrame]]:
    """The same, and the telemetry that came back; `frames`: others than `control_frames()`."""
    receiver = running.receiver(islice(frames or control_frames(), count), _RATE_HZ)
    before = decoder_state(running.board).frames
    receiver.start(running.board.now_ns + _LEAD_NS)
    running.board.run_for(_LEAD_NS + count * 1e9 / _RATE_HZ + _SERVED_WITHIN_NS)
    found = []
    for sent in receiver.sent:
        written = running.compare.last_between(sent.end_ns, sent.end_ns + _SERVED_WITHIN_NS)
        if written is not None:
            found.append((written - sent.end_ns) / 1e3)
    decoded = decoder_state(running.board).frames - before
    return found, count - min(len(found), decoded), receiver.downlink


def collisions_us(running: Running, count: int) -> tuple[list[float], int]:
    """As `latencies_us` for frames that end while the tick's interrupt runs, at `count` places."""
    first_ns = next_tick_ns(running)
    before = decoder_state(running.board).frames
    found = []
    for number, frame in enumerate(islice(control_frames(), count)):
        tick_ns = first_ns + (number + 1) * TICK_NS
        ends_ns = tick_ns + _AROUND_TICK_NS[0] + number * (_AROUND_TICK_NS[1] / count)
        bits = 10 * len(frame)
        running.run_until(ends_ns - bits * 1e9 / BAUD - _LEAD_NS)
        end_ns = running.wire.send(frame, ends_ns - bits * 1e9 / BAUD)
        running.run_until(end_ns + _SERVED_WITHIN_NS)
        written = running.compare.last_between(end_ns, end_ns + _SERVED_WITHIN_NS)
        if written is not None:
            found.append((written - end_ns) / 1e3)
    decoded = decoder_state(running.board).frames - before
    return found, count - min(len(found), decoded)


def _board(rig: Rig, load: str) -> Running:
    """A board with this load."""
    if load != SENSORS:
        return rig.fly(LOADS[load], setup=TALKING_SETUP)
    running = rig.power_on()
    aircraft = Aircraft()
    running.devices = Devices(running.board, aircraft, rig.defaults)
    running.board.run_until(lambda: running.console.link == "searching", _START_LIMIT_NS)
    aircraft.takeoff_ns = running.board.now_ns + _SENSORS_NS
    running.run_until(aircraft.takeoff_ns)
    return running


def flight(
    rig: Rig, count: int, load: str, frames: Frames = control_frames
) -> tuple[list[float], int, list[DownlinkFrame]]:
    """What `fly` finds on a board of its own with this load."""
    return fly(_board(rig, load), count, frames())


def latency(rig: Rig, effort: Effort, findings: Findings) -> tuple[Table, ...]:
    """From the wire to the registers, and telemetry, under each load of the main loop."""
    rows, slots = [], []
    # A board for each load: they are the same whether they run one after the other or not.
    with ProcessPoolExecutor(mp_context=get_context("fork")) as pool:
        flights = list(pool.map(partial(flight, rig, effort.latency_frames), effort.loads))
    for name, (found, lost, downlink) in zip(effort.loads, flights, strict=True):
        rows.append((name, *latency_cells(found, lost)))
        findings.latencies_us[name] = found
        findings.lost += lost
        starts = [(frame.after_ns or 0.0) / 1e3 for frame in downlink]
        findings.slots_us[name] = starts
        spread = Spread.of(starts)
        times = (spread.minimum, spread.mean, spread.p99, spread.maximum)
        broken = sum(not frame.ok for frame in downlink)
        findings.broken += broken
        slots.append((name, f"{spread.count}", f"{broken}", *(f"{us:.2f}" for us in times)))
    found, lost = collisions_us(rig.asleep, effort.collisions)
    rows.append((MEETING, *latency_cells(found, lost)))
    findings.latencies_us[MEETING] = found
    findings.lost += lost
    kinds = ", ".join(f"0x{kind:02x}" for kind in CONTROL_TYPES)
    table = Table(
        "Last stop bit to last PWM compare register",
        f"{len(rig.servos)} plain servos. Microseconds from the end of a frame's last stop bit on "
        "the wire to the last write of a compare register. Frames of the types "
        f"{kinds} in turn with random values, at {_RATE_HZ:.2f} Hz: 500 Hz, and so far off that "
        "their phase to the firmware's tick of 10 ms is ever another. Telemetry goes out behind "
        "most of them. All sensors: main.py as it is, with a battery, a GPS receiver, a barometer "
        "and a magnetometer connected. The last row is the worst "
        "case made on purpose: one frame each 10 ms, timed to end just before or within the "
        "tick's own interrupt, which it interrupts in its turn.",
        ("main loop", "frames", "lost", "min", "mean", "p99", "max"),
        tuple(rows),
    )
    sent = Table(
        "Telemetry slot",
        "Microseconds from the end of a control frame's last stop bit to the first start bit of "
        "the telemetry behind it, in the same flights. But for the application, which sends what "
        "its sensors have, a new frame waits as soon as the last one is gone. Broken are frames "
        "without all their stop bits.",
        ("main loop", "frames", "broken", "min", "mean", "p99", "max"),
        tuple(slots),
    )
    return table, sent


def latency_cells(found: list[float], lost: int) -> tuple[str, ...]:
    """Of a row: frames that were served, lost ones, minimum, mean, p99, maximum."""
    spread = Spread.of(found)
    times = (spread.minimum, spread.mean, spread.p99, spread.maximum)
    return (f"{spread.count}", f"{lost}", *(f"{us:.2f}" for us in times))


def failsafe_ms(running: Running, phase_ns: float) -> float:
    """From the last frame's end to the last compare register, with frames at this phase."""
    frames = islice(control_frames(), len(CONTROL_TYPES))
    receiver = running.receiver(frames, 250)
    start_ns = (running.board.now_ns // TICK_NS + 1) * TICK_NS + phase_ns
    receiver.start(start_ns)
    running.run_until(start_ns + len(CONTROL_TYPES) * 4e6)
    receiver.stop()
    last_ns = receiver.sent[-1].end_ns
    running.run_until(last_ns + 2 * FAILSAFE_MS * 1e6)
    written = running.compare.last_between(last_ns + _SERVED_WITHIN_NS, running.board.now_ns)
    if written is None:
        raise TimeoutError(f"no failsafe within {2 * FAILSAFE_MS} ms")
    return (written - last_ns) / 1e6


def failsafe(rig: Rig, effort: Effort) -> tuple[Table, ...]:
    """From silence to failsafe."""
    running = rig.asleep
    phases = effort.failsafe_phases
    found = Spread.of(
        [failsafe_ms(running, number * TICK_NS / phases) for number in range(phases)]
    )
    table = Table(
        "Failsafe",
        f"failsafe_ms = {FAILSAFE_MS}, main loop asleep; milliseconds from the end of the last "
        "frame to the compare registers that end the pulses, with the last frame at "
        f"{phases} phases of the tick of 10 ms. A pulse under way is finished.",
        ("link losses", "min", "max"),
        ((f"{found.count}", f"{found.minimum:.3f}", f"{found.maximum:.3f}"),),
    )
    return (table,)
