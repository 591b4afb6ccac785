"""What the firmware's two interrupts cost: cycles of each, and the share of the CPU."""

from __future__ import annotations

from ghst_tools.bench.figures import Effort, Findings, Table
from ghst_tools.bench.interrupts import frame_cycles, tick_cycles
from ghst_tools.bench.rig import CLOCK_HZ, CONTROL_TYPES, Rig, control_frames
from ghst_tools.bench.talking import Talking

_ROUNDS = 2  # the ring of 256 bytes wraps once in 18 frames
_RATES_HZ = (55, 160, 250, 500)
_TALKING_RATES_HZ = (250, 500)
# A control frame and its echo are 28 bytes: within as many rounds both lie once across the end of
# the ring of 256 bytes.
_ECHOES = 64
_SHOWN_HZ = 500


def cycles(rig: Rig) -> tuple[Table, ...]:
    """What the two interrupts cost."""
    running = rig.asleep
    found: dict[str, list[int]] = {}
    frames = control_frames()
    for _ in range(_ROUNDS * len(CONTROL_TYPES)):
        frame = next(frames)
        found.setdefault(f"frame 0x{frame[2]:02x}", []).append(frame_cycles(running, frame))
    talking = Talking(rig)
    both = [talking.interrupts() for _ in range(_ECHOES)]
    found["frame 0x13, telemetry handed over"] = [handed for handed, _ in both]
    found["our echo"] = [echo for _, echo in both]
    found["tick, every 10 ms"] = [tick_cycles(running)]
    table = Table(
        "CPU cycles of the whole interrupts",
        "From the first instruction of the exception to its return, with MicroPython's own part. "
        f"{_ROUNDS} frames of each type with random values. Once in 18 frames a frame lies across "
        "the end of the receive ring and takes longer; it is one of those here. Telemetry: "
        f"{_ECHOES} times, on a board that counts in its main program; what it sends comes back "
        "on the same wire and raises the same interrupt.",
        ("interrupt", "cycles, least", "cycles, most", "us at 125 MHz, most"),
        tuple(
            (name, f"{min(seen)}", f"{max(seen)}", f"{max(seen) * 1e6 / CLOCK_HZ:.2f}")
            for name, seen in found.items()
        ),
    )
    return (table,)


def share(rig: Rig, effort: Effort, findings: Findings) -> tuple[Table, ...]:
    """The share of the CPU that frames take from the main program."""
    talking = Talking(rig)
    without = talking.rounds(effort.share_s)
    rows = [("none", "0", f"{without}", "")]
    for talk, rates in ((False, _RATES_HZ), (True, _TALKING_RATES_HZ)):
        for rate_hz in rates:
            left, frames = talking.rounds_in_flight(effort.share_s, rate_hz, talk)
            percent = 100 * (1 - left / without)
            if rate_hz == _SHOWN_HZ and talk:
                findings.talking_percent = percent
            elif rate_hz == _SHOWN_HZ:
                findings.share_percent = percent
            name = f"{rate_hz}, telemetry behind each" if talk else f"{rate_hz}"
            rows.append((name, f"{len(frames)}", f"{left}", f"{percent:.2f} %"))
    table = Table(
        "Share of the CPU",
        "What control frames take from a main program: how often it gets round a loop of machine "
        f"code in {effort.share_s:g} s, against the same without frames (the tick and USB run in "
        "either case). Telemetry behind each: one frame lies ready all the time, and the word "
        "that has it sent is written from outside, so that the main program does nothing for it; "
        "none was missing.",
        ("control frames per second", "control frames", "rounds", "taken by the interrupts"),
        tuple(rows),
    )
    return (table,)
