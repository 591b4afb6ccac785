"""The heap that frames take: of an adapter alone, and of the application with all that it does."""

from __future__ import annotations

import json
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import count
from multiprocessing import get_context
from typing import NamedTuple

from ghst import encode  # type: ignore[import-not-found]
from ghst_tools.bench.figures import Effort, Findings, Table
from ghst_tools.bench.rig import Rig, control_frames
from ghst_tools.campaign.pico import NO_SENSORS
from ghst_tools.demo.aircraft import Aircraft, Devices

_RATE_HZ = 500
_POLL_MS = 20
_LIMIT_NS = 30e9
# Until everything is loaded that is loaded when it is used: without sensors, and with all of them.
_WARM_UP_MS, _SENSORS_WARM_UP_MS = 1000, 3000

_ALONE = """
import gc
def fly(count):
    receiver = adapter.receiver
    while not receiver.frames:
        pass
    gc.disable()
    rounds = 0
    first = receiver.frames
    before = gc.mem_alloc()
    while receiver.frames - first < count:
        adapter.poll()
        time.sleep_ms({poll_ms})
        rounds += 1
    taken = gc.mem_alloc() - before
    return receiver.frames - first, 0, 0, rounds, taken
{ready}
print("taken", *fly({frames}), "end of flight")
"""

# A step of the application's main loop. It takes nothing of the heap itself.
_METER = """
import gc, time
rounds = frames = sent = answered = before = 0
def setup(application):
    receiver = application.receiver
    control = application.adapter.control
    begun = time.ticks_ms()
    def step(now_ms):
        global rounds, frames, sent, answered, before
        if rounds < 0:
            return
        if not rounds:
            if time.ticks_diff(now_ms, begun) < {warm_up_ms}:
                return
            gc.collect()
            gc.disable()
            frames = receiver.frames
            sent = control.telemetry_frames
            answered = application.msp.answered
            before = gc.mem_alloc()
        elif rounds == {rounds}:
            taken = gc.mem_alloc() - before
            gc.enable()
            print("taken", receiver.frames - frames, control.telemetry_frames - sent,
                  application.msp.answered - answered, rounds, taken, "end of flight")
            rounds = -2
        rounds += 1
    application.steps.append(step)
"""

# To the flight controller, from a script of the radio: MSP version 1, API_VERSION.
_MSP = bytes(encode.msp(0x21, bytes.fromhex("30000101000000000000")))
_LINK_DATA = bytes(encode.link_data(0x13, (1984,) * 4, rf_mode=6))
_GOGGLES = 0x83


class _Flight(NamedTuple):
    """What was seen meanwhile."""

    frames: int
    telemetry: int
    answers: int
    rounds: int
    taken: int


def _everything() -> Iterator[bytes]:
    """Control frames of all types, MSP requests, and settings of the video transmitter."""
    controls = control_frames()
    for number in count():
        if number % 10 == 0:
            yield _LINK_DATA
        elif number % 50 == 5:
            yield _MSP
        elif number % 50 == 15:
            yield bytes(encode.vtx_setup(0, 5800 + number % 7, 25, 0, address=_GOGGLES))
        else:
            yield next(controls)


def _alone(rig: Rig, effort: Effort) -> _Flight:
    program = _ALONE.format(ready=rig.ready, frames=effort.heap_frames, poll_ms=_POLL_MS)
    running = rig.run(rig.starting() + program)
    running.receiver(control_frames(), _RATE_HZ).start()
    running.board.run_until(lambda: b"end of flight" in running.board.console.output, _LIMIT_NS)
    return _Flight(*running.numbers("taken"))


def _application(rig: Rig, effort: Effort, frames: bool) -> _Flight:
    sensors = effort.heap_sensors
    meter = _METER.format(
        warm_up_ms=_SENSORS_WARM_UP_MS if sensors else _WARM_UP_MS, rounds=effort.heap_frames
    )
    configuration: dict[str, object] = {} if sensors else NO_SENSORS
    running = rig.power_on(
        {"/user.py": meter.encode(), "/ghst.json": json.dumps(configuration).encode()}
    )
    if sensors:
        running.devices = Devices(running.board, Aircraft(), rig.defaults)
    if frames:
        running.receiver(_everything(), _RATE_HZ).start()
    running.board.run_until(lambda: b"end of flight" in running.board.console.output, _LIMIT_NS)
    return _Flight(*running.numbers("taken"))


def heap(rig: Rig, effort: Effort, findings: Findings) -> tuple[Table, ...]:
    """Bytes taken while frames come, and those that the rounds of the main loop take anyway."""
    with ProcessPoolExecutor(mp_context=get_context("fork")) as pool:
        alone_flight = pool.submit(_alone, rig, effort)
        flown, idle = pool.map(partial(_application, rig, effort), (True, False))
        alone = alone_flight.result()
    # The rounds of an adapter alone take nothing.
    rows = (
        ("adapter alone: adapter.poll(), time.sleep_ms(20)", alone, 0),
        ("the application, no frames", idle, idle.taken),
        (
            "the application, all kinds of frames, telemetry",
            flown,
            round(idle.taken * flown.rounds / idle.rounds),
        ),
    )
    findings.heap_bytes = max(abs(flight.taken - anyway) for _, flight, anyway in rows)
    sensors = "all sensors connected and read" if effort.heap_sensors else "no sensors"
    table = Table(
        "Heap taken by frames",
        f"gc.mem_alloc() before and after so many rounds of the main loop at {_RATE_HZ} frames a "
        "second, with the garbage collector switched off. The application is main.py as it is, "
        f"{sensors}, with a step in /user.py that measures, once everything is loaded; frames are "
        "control frames of all types, MSP requests, which it answers, and settings of the video "
        "transmitter, and telemetry goes out. Bytes of the rounds: what as many rounds take "
        "without frames. The rest is what frames take.",
        (
            "main loop",
            "control frames",
            "telemetry frames",
            "MSP answers",
            "rounds",
            "bytes in all",
            "of the rounds",
            "of frames",
        ),
        tuple(
            (
                name,
                *(f"{seen}" for seen in flight),
                f"{anyway}",
                f"{flight.taken - anyway}",
            )
            for name, flight, anyway in rows
        ),
    )
    return (table,)
