"""The servo pins: how exact the pulses are, and when the first ones come."""

from __future__ import annotations

from ghst_tools.bench.figures import Effort, Table
from ghst_tools.bench.rig import Rig, control_frames
from ghst_tools.demo.judge import STEP_NS, Demand, Judge

_RATE_HZ = 250
_PERIOD_NS = 20e6
_BOOT_LIMIT_NS = 3e9
_HELLO = "micropython-ghst "

# Types whose values stay within the limits of 800..2200 us, which are no error of the output.
_TYPES = (0x30, 0x31, 0x32, 0x33)


def pulses(rig: Rig, effort: Effort) -> tuple[Table, ...]:
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
    table = Table(
        "Pulse width at the pin",
        f"Width of each pulse at the {len(rig.servos)} servo pins against the width that the "
        f"frames demand (in quarter microseconds), random values at {_RATE_HZ} Hz. The PWM counts "
        f"in steps of {STEP_NS / 1e3} us; wrong are pulses that are not the step nearest to the "
        "demanded width.",
        ("pulses", "wrong", "error, min us", "error, max us"),
        (
            (
                f"{len(errors_us)}",
                f"{len(judge.wrong)}",
                f"{min(errors_us):+.4f}",
                f"{max(errors_us):+.4f}",
            ),
        ),
    )
    return (table,)


def boot(rig: Rig) -> tuple[Table, ...]:
    """From power-on to the hello, and to the first pulses where the link is up all the time."""
    running = rig.power_on()
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
    rows = (
        ("hello on the USB console", hello_ns()),
        ("first pulse on a servo pin", min(rises)),
        ("pulses on all servo pins", max(rises)),
    )
    table = Table(
        "Power-on to pulses",
        "Milliseconds of emulated time from power-on to these, with main.py as it is and a "
        f"receiver that sends at {_RATE_HZ} Hz all the time.",
        ("until", "ms"),
        tuple((name, f"{(t_ns or 0.0) / 1e6:.1f}") for name, t_ns in rows),
    )
    return (table,)
