"""What the firmware is to keep to, and whether it does."""

from __future__ import annotations

from ghst_tools.bench.figures import Findings, Spread, Table

LATENCY_US, AIM_US = 35.0, 25.0
SHARE_PERCENT = 2.0
SLOT_US = (990.0, 1010.0)
PULSE_US = 0.5
# Bytes kept with nothing connected, for each form: what the tests hold, and the aim.
KEPT = {".mpy": (40 * 1024, 40_000), "frozen": (16 * 1024, 16_000)}


def goals(findings: Findings) -> tuple[Table, ...]:
    """The goals, each with the figure that was reached."""
    p99 = max(Spread.of(found).p99 for found in findings.latencies_us.values())
    slots = [us for found in findings.slots_us.values() for us in found]
    error = max(abs(us) for us in findings.pulse_errors_us)
    rows = [
        (
            f"last stop bit to registers, p99 <= {LATENCY_US:g} us under every load",
            f"{p99:.2f} us",
            p99 <= LATENCY_US,
        ),
        (f"the same, aim: <= {AIM_US:g} us", f"{p99:.2f} us", p99 <= AIM_US),
        ("frames lost under any load: 0", f"{findings.lost}", findings.lost == 0),
        (
            f"frame interrupt <= {SHARE_PERCENT:g} % of the CPU at 500 Hz, control frames alone",
            f"{findings.share_percent:.2f} %",
            findings.share_percent <= SHARE_PERCENT,
        ),
        (
            "the same with telemetry, whose echo raises it too, behind each of them",
            f"{findings.talking_percent:.2f} %",
            findings.talking_percent <= SHARE_PERCENT,
        ),
        (
            "telemetry 1000 +- 10 us behind the frame under every load",
            f"{min(slots):.2f}..{max(slots):.2f} us",
            SLOT_US[0] <= min(slots) and max(slots) <= SLOT_US[1],
        ),
        ("heap taken by frames: 0 bytes", f"{findings.heap_bytes}", findings.heap_bytes == 0),
        (
            f"pulses within {PULSE_US:g} us of what the frame demands",
            f"{error:.3f} us",
            error <= PULSE_US,
        ),
    ]
    for form, kept in findings.kept.items():
        limit, aim = KEPT[form]
        reached = f"{kept} bytes"
        rows += [
            (f"RAM, {form}, nothing connected <= {limit} bytes", reached, kept <= limit),
            (f"the same, aim: <= {aim} bytes", reached, kept <= aim),
        ]
    table = Table(
        "Goals",
        "What the firmware is to keep to on the emulated chip, and the worst of what was "
        "measured; how is told below.",
        ("goal", "reached", ""),
        tuple((goal, reached, "met" if met else "missed") for goal, reached, met in rows),
    )
    return (table,)
