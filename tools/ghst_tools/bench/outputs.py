"""The servo pins: how exact the pulses are, and when the first ones come."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from ghst_tools.bench.figures import Effort, Findings, Table
from ghst_tools.bench.rig import Rig, Running, control_frames
from ghst_tools.demo.judge import STEP_NS, Demand, Judge
from ghst_tools.emulator.meters import Pulse

_RATE_HZ = 250
_PERIOD_NS = 20e6
_BOOT_LIMIT_NS = 3e9
_HELLO = "micropython-ghst "

# Types whose values stay within the limits of 800..2200 us, which are no error of the output.
_TYPES = (0x30, 0x31, 0x32, 0x33)


def pulses(rig: Rig, effort: Effort, findings: Findings) -> tuple[Table, ...]:
    """Widths at the pins against the widths in the frames."""
    running = rig.fly("adapter.poll(); time.sleep_ms(20)")
    board = running.board
    receiver = running.receiver(control_frames(_TYPES), _RATE_HZ)
    receiver.start(board.now_ns)
    board.run_for(effort.pulse_s * 1e9)
    receiver.stop()
    # The pulse that shows the last frame.
    board.run_for(2 * _PERIOD_NS)
    demand = Demand(rig.servos, {})
    for sent in receiver.sent:
        demand.frame(*sent)
    judge = Judge(demand)
    for pin, seen in running.meter.pulses.items():
        for pulse in seen:
            judge.pulse(pin, pulse)
    verdicts = judge.verdicts.values()
    errors_us = [error / 1e3 for verdict in verdicts for _, error in verdict.errors]
    findings.pulse_errors_us = errors_us
    findings.wrong_pulses = len(judge.wrong)
    jitter = [_jitter_us(running.meter.pulses[pin]) for pin in rig.servos]
    table = Table(
        "Pulse width at the pin",
        f"Width of each pulse at the {len(rig.servos)} servo pins against the width that the "
        f"frames demand (in quarter microseconds), random values at {_RATE_HZ} Hz. The PWM counts "
        f"in steps of {STEP_NS / 1e3} us; wrong are pulses that are not the step nearest to the "
        "demanded width. Jitter: how far the time from one rise to the next is off 20 ms at most.",
        ("pulses", "wrong", "error, min us", "error, max us", "jitter, us"),
        (
            (
                f"{len(errors_us)}",
                f"{len(judge.wrong)}",
                f"{min(errors_us):+.4f}",
                f"{max(errors_us):+.4f}",
                f"{max(jitter):.4f}",
            ),
        ),
    )
    return (table,)


def _jitter_us(seen: Sequence[Pulse]) -> float:
    """How far the period is off 20 ms at most."""
    return max(abs(b.rise_ns - a.rise_ns - _PERIOD_NS) for a, b in pairwise(seen)) / 1e3


def boot(rig: Rig, effort: Effort) -> tuple[Table, ...]:
    """From power-on to the hello, and to the first pulses where the link is up all the time."""
    found = {".mpy, ms": _boot_ns(rig.power_on(), rig)}
    if effort.frozen:
        found["frozen, ms"] = _boot_ns(rig.frozen.power_on(), rig)
    table = Table(
        "Power-on to pulses",
        "Milliseconds of emulated time from power-on to these, with main.py as it is and a "
        f"receiver that sends at {_RATE_HZ} Hz all the time: with the firmware as .mpy files in "
        "the file system, and frozen into the image (`make firmware`).",
        ("until", *found),
        tuple(
            (name, *(f"{times[index] / 1e6:.1f}" for times in found.values()))
            for index, name in enumerate(_UNTIL)
        ),
    )
    return (table,)


_UNTIL = ("hello on the USB console", "first pulse on a servo pin", "pulses on all servo pins")


def _boot_ns(running: Running, rig: Rig) -> tuple[float, float, float]:
    """When each of `_UNTIL` came, in nanoseconds."""
    receiver = running.receiver(control_frames(_TYPES), _RATE_HZ)
    receiver.start()

    def hello_ns() -> float | None:
        lines = running.console.lines
        return next((t_ns for t_ns, line in lines if line.startswith(_HELLO)), None)

    def first_pulses() -> list[float]:
        return [seen[0].rise_ns for seen in running.meter.pulses.values() if seen]

    running.board.run_until(
        lambda: hello_ns() is not None and len(first_pulses()) == len(rig.servos),
        _BOOT_LIMIT_NS,
        poll_ns=1e6,
    )
    rises = first_pulses()
    return hello_ns() or 0.0, min(rises), max(rises)
