"""The figures of a session, as lines and as an object."""

from __future__ import annotations

from typing import Any

import numpy as np

from ghst_tools.frames import kinds
from ghst_tools.simulate.session import Session


def statistics(session: Session) -> dict[str, Any]:
    """All figures, with their units in their names."""
    listening, faults, rhythm = session.listening, session.uplink.faults, session.rhythm
    half, most, latest = rhythm.late_us
    slots_us = listening.slots_us
    return {
        "slots": rhythm.slots,
        "slots_skipped": rhythm.skipped,
        "slots_lost": faults.counts["lost"],
        "slots_dropped": faults.counts["dropped"],
        "sent_bursts": session.sent_bursts,
        "sent_bytes": session.sent_bytes,
        "sent_bad_crc": faults.counts["bad_crc"],
        "sent_noise_bytes": faults.counts["noise_bytes"],
        "rate_hz": round(rhythm.rate_hz, 2),
        "late_median_us": round(half),
        "late_99_percent_us": round(most),
        "late_max_us": round(latest),
        "echo": listening.echo.present,
        "echo_intact": listening.echo.intact,
        "echo_broken": listening.echo.broken,
        "telemetry": dict(sorted(listening.frames.items())),
        "telemetry_damaged": listening.damaged,
        "other_frames": listening.others,
        "garbage_bytes": listening.garbage_bytes,
        "slot_median_us": round(float(np.median(slots_us)), 1) if slots_us else None,
        "slot_min_us": round(min(slots_us), 1) if slots_us else None,
        "slot_max_us": round(max(slots_us), 1) if slots_us else None,
        "slots_measured": len(slots_us),
        "slots_not_measured": listening.slots_unknown,
    }


def lines(session: Session) -> list[str]:
    """What to print at the end."""
    return [_sent(session), _late(session), *_spoilt(session), _echo(session), *_heard(session)]


def _sent(session: Session) -> str:
    rhythm = session.rhythm
    text = (
        f"sent {session.sent_bursts} frames in {rhythm.slots} slots, {rhythm.rate_hz:.1f} a second"
    )
    if session.link:
        text += f", {session.link.name}"
    return text


def _late(session: Session) -> str:
    half, most, latest = session.rhythm.late_us
    text = f"late by {half:.0f} us in the median, 99 % by {most:.0f}, the latest {latest:.0f} us"
    if session.rhythm.skipped:
        why = "waiting for the echo" if session.network else "the computer was busy"
        text += f"; {session.rhythm.skipped} slots left out, {why}"
    return text


def _spoilt(session: Session) -> list[str]:
    counts = session.uplink.faults.counts
    told = {
        "lost": "slots without link",
        "dropped": "dropped",
        "bad_crc": "with a wrong CRC",
        "noise_bytes": "bytes of noise",
    }
    found = [f"{counts[name]} {text}" for name, text in told.items() if counts[name]]
    return [f"spoilt on purpose: {', '.join(found)}"] if found else []


def _echo(session: Session) -> str:
    echo = session.listening.echo
    if echo.present is None:
        return "echo: not known, too little was sent"
    if not echo.present:
        return "echo: none (separate wires, or the adapter's RX is not on the wire)"
    text = f"echo: {echo.intact} came back as sent"
    if echo.broken:
        text += f", {echo.broken} broken: something else drove the wire (collision)"
    return text


def _heard(session: Session) -> list[str]:
    listening = session.listening
    counts = [f"{kinds.title(name)} {count}" for name, count in sorted(listening.frames.items())]
    text = f"telemetry: {', '.join(counts) or 'none'}"
    link = session.link
    if link and not link.downlink:
        text += f" ({link.name} has no downlink"
        text += ": a flight controller must be silent)" if counts else ")"
    found = [text]
    wrong = {
        "damaged frames": listening.damaged,
        "frames to somebody else": listening.others,
        "bytes of garbage": listening.garbage_bytes,
    }
    if any(wrong.values()):
        what = ", ".join(f"{count} {name}" for name, count in wrong.items() if count)
        found.append(f"not understood: {what}")
    if listening.slots_us or listening.slots_unknown:
        found.append(slot(session))
    return found


def slot(session: Session, newest: int | None = None) -> str:
    """The telemetry slot in one line, of all frames or the `newest` that were measured."""
    listening = session.listening
    slots_us = listening.slots_us[-newest:] if newest else listening.slots_us
    parts = []
    if slots_us:
        parts.append(
            f"{np.median(slots_us):.0f} us in the median, {min(slots_us):.0f} to "
            f"{max(slots_us):.0f} us, {len(listening.slots_us)} measured"
        )
        if not listening.echo.present:
            parts.append("from writing on, with the adapter's delays in it")
    if listening.slots_unknown:
        why = "not over a network" if session.network else "read together with the echo"
        parts.append(f"{listening.slots_unknown} not measured: {why}")
    return f"slot: {', '.join(parts)}"
