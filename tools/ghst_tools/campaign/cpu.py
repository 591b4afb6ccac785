"""Faults of the software that runs beside the control path, and of the chip under it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import partial
from itertools import pairwise

import ghst  # type: ignore[import-not-found]
from ghst_tools.campaign.outputs import Outputs, moving
from ghst_tools.campaign.pico import NO_SENSORS, Pico
from ghst_tools.campaign.picos import connect_battery, forked
from ghst_tools.campaign.resets import RESETS, reset
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Row, Trial, equal, expect

CONFIGURATION = NO_SENSORS | {"battery": {"enabled": True}}
READY = b"sensors: battery"
# A console command for each fault: `fault NAME`.
USER = b"""
import gc, machine, time
kept = [None]
def spin(application):
    while True:
        pass
def sleep(application):
    time.sleep(3600)
def fail(*arguments):
    raise RuntimeError("of the user")
def recurse(application):
    recurse(application)
def fill(application):
    for keep in (lambda: (kept[0], bytearray(512)), lambda: (kept[0],)) * 2:
        try:
            while True:
                kept[0] = keep()
        except MemoryError:
            gc.collect()
    print("heap full:", gc.mem_free(), "bytes free")
def fill_and_free(application):
    try:
        fill(application)
        bytearray(512)
    finally:
        kept[0] = None
def collect(application):
    application.steps.append(lambda now_ms: gc.collect())
    print("main loop: collected from now on")
def leave(application):
    raise SystemExit
def step(application):
    application.steps.insert(0, fail)
def sensor(application):
    application.sensors["battery"].update = fail
def hanging_sensor(application):
    application.sensors["battery"].update = spin
def vtx(application):
    application.on_vtx = fail
def msp(application):
    application.responder.command(0x3000, fail)
def deaf(application):
    state = machine.disable_irq()
    begun = time.ticks_us()
    while time.ticks_diff(time.ticks_us(), begun) < 50_000:
        pass
    machine.enable_irq(state)
def deaf_for_ever(application):
    machine.disable_irq()
    spin(application)
def setup(application):
    application.console.add("fault", lambda name: globals()[name](application), "fault NAME")
"""

# What the board tells when nothing is left, also for less than `_PIECE` bytes.
_FILLING = ("fill", "fill_and_free")
_HEAP_FULL = re.compile(rb"heap full: (\d+) bytes free\r\n")
_PIECE = 512
_RATE_HZ = 250
_RUN_NS = 0.4e9
_DEAF_NS = 50e6
_VTX_SETUP = bytes(ghst.encode.vtx_setup(0, 5800, 25, 0x48))
# MSP version 2, command 0x3000, nothing behind it (protocol.md, "MSP inside GHST").
_MSP_REQUEST = bytes(ghst.encode.msp(0x21, b"\x50\x00\x00\x30" + bytes(6)))

# Name of the command, what it is, and what the board tells to Enter afterwards.
STANDS, SAYS_NOTHING = "", "nothing that is looked at"
_OF_THE_USER = "faults, the last: RuntimeError: of the user"
FAULTS: tuple[tuple[str, str, str, bytes | None], ...] = (
    ("spin", "the main loop is stuck in a loop", STANDS, None),
    ("sleep", "the main loop sleeps for an hour", STANDS, None),
    ("fail", "an exception in a console command", _OF_THE_USER, None),
    ("step", "an exception in a user's step, in every round", _OF_THE_USER, None),
    ("leave", "SystemExit in a user's code", "faults, the last: SystemExit: ", None),
    ("recurse", "recursion without end", "maximum recursion depth exceeded", None),
    ("fill_and_free", "all of the heap taken, then freed", "the last: MemoryError: ", None),
    ("fill", "all of the heap taken and kept", SAYS_NOTHING, None),
    ("collect", "garbage collection in every round", "main loop: collected ", None),
    ("sensor", "an exception in a sensor, in every round", _OF_THE_USER, None),
    ("hanging_sensor", "a sensor that never returns", STANDS, None),
    ("vtx", "an exception in a user's callback for video settings", _OF_THE_USER, _VTX_SETUP),
    (
        "msp",
        "an exception in a user's MSP command",
        "MSP: 1 frames, 0 answered, 1 errors",
        _MSP_REQUEST,
    ),
)


def start(setting: Setting) -> Pico:
    """A board with the application and the faults to choose from."""
    return setting.picos.boot(CONFIGURATION, READY, files={"/user.py": USER})


def fault(pico: Pico, name: str, after: str, frame: bytes | None) -> str:
    """Bring a fault about in flight; every frame still moves the servos, no pulse is missing."""
    connect_battery(pico)
    outputs = Outputs(pico)
    receiver = pico.fly(
        lambda index, t: frame if frame and index == 80 else moving(index), _RATE_HZ
    )
    pico.board.run_for(100e6)
    output = pico.board.console.output
    pico.board.console.write(f"fault {name}\r".encode())
    if name in _FILLING:
        pico.board.run_until(lambda: _HEAP_FULL.search(output) is not None, 2e9)
    pico.board.run_for(_RUN_NS)
    receiver.stop()
    pico.board.run_for(3e6)
    controls = outputs.frames(receiver.sent)
    equal(controls, len(receiver.sent) - (frame is not None), "control frames")
    outputs.finish()
    expect(not pico.board.resets, "the watchdog has reset the board")
    happened = f"all {controls} control frames written to the outputs, {outputs.shown()}; no reset"
    full = _HEAP_FULL.search(output)
    if full is not None:
        expect(int(full[1]) < _PIECE, f"{int(full[1])} bytes of the heap are free")
        happened += f"; {int(full[1])} bytes of the heap were left"
    if after == SAYS_NOTHING:
        return happened
    told = _answer(pico)
    if after == STANDS:
        equal(told, None, "the answer of a main loop that should stand still")
        return f"{happened}; the main loop stands still"
    expect(told is not None, "the main loop stands still")
    lines = [line for line in str(told).splitlines() if after in line]
    expect(bool(lines), f"the board does not tell {after!r}: {told!r}")
    return f'{happened}; the main loop goes on and tells "{lines[-1]}"'


def deaf(pico: Pico) -> str:
    """A user's code keeps all interrupts off for 50 ms."""
    outputs = Outputs(pico)
    receiver = pico.fly(lambda index, t: moving(index), _RATE_HZ)
    pico.board.run_for(100e6)
    pico.board.console.write(b"fault deaf\r")
    pico.board.run_for(200e6)
    receiver.stop()
    pico.board.run_for(3e6)
    writes = [write.t_ns for write in pico.compares]
    silence, ends_ns = max((later - sooner, later) for sooner, later in pairwise(writes))
    expect(_DEAF_NS < silence < _DEAF_NS + 2e9 / _RATE_HZ, f"no compare write for {silence} ns")
    heard = [sent for sent in receiver.sent if sent.end_ns < ends_ns - silence]
    unheard = [sent for sent in receiver.sent[len(heard) :] if sent.end_ns < ends_ns]
    expect(10 <= len(unheard) <= 15, f"{len(unheard)} frames had no effect")
    outputs.frames(heard)
    outputs.later(unheard)
    outputs.frames(receiver.sent)
    outputs.finish()
    expect(not pico.board.resets, "the watchdog has reset the board")
    return (
        f"{len(unheard) - 1} frames had no effect, the one after them when the interrupts were on "
        f"again, all others had at once; {outputs.shown()}; no reset"
    )


def _answer(pico: Pico) -> str | None:
    """What the console answers to Enter, and has said before; None if it does not answer."""
    start = len(pico.board.console.output)
    pico.board.console.write(b"\r")
    try:
        pico.board.run_until(lambda: b" times\r\n" in pico.board.console.output[start:], 150e6)
    except TimeoutError:
        return None
    pico.board.run_for(10e6)
    return bytes(pico.board.console.output).decode(errors="replace")


def trials(setting: Setting) -> Iterator[tuple[str, Trial]]:
    """The trials, by name."""

    def run(what: str, done: str, act: Callable[[Pico], str]) -> list[Row]:
        pico = start(setting)
        return [Row(what, done, forked(lambda: act(pico)))]

    chosen = setting.effort.cpu_faults
    for name, what, after, frame in FAULTS:
        if chosen is not None and name not in chosen:
            continue
        act = partial(fault, name=name, after=after, frame=frame)
        flight = f"in flight at {_RATE_HZ} Hz"
        flight += ", frames until the heap is full and" if name in _FILLING else ", then"
        yield what, partial(run, what, f"{flight} 0.4 s more", act)
    yield "deaf", partial(run, "interrupts off", "for 50 ms, by a user's code", deaf)
    for each in RESETS:
        if chosen is not None and each.what not in chosen:
            continue
        act = partial(reset, fault=each)
        done = f"{each.done}, in flight at {_RATE_HZ} Hz; the receiver goes on sending"
        yield each.what, partial(run, each.what, done, act)
