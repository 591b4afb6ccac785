"""What is shown while it runs: lines for people, or objects for programs."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

from ghst.protocol import TYPE_MSP_RESPONSE  # type: ignore[import-not-found]
from ghst_tools.frames import fields, kinds
from ghst_tools.frames.text import says
from ghst_tools.simulate import summary
from ghst_tools.simulate.listening import Heard
from ghst_tools.simulate.msp_client import Answer
from ghst_tools.simulate.session import Session

EVERY_S = 1.0

Print = Callable[[str], None]


class Output(ABC):
    """Is told what came, many times a second, and of the end."""

    @abstractmethod
    def show(self, session: Session, heard: Sequence[Heard], answers: Sequence[Answer]) -> None:
        """Take what came since the last call; often that is nothing."""

    @abstractmethod
    def finish(self, session: Session) -> None:
        """Show the figures of all of it."""


class Lines(Output):
    """A line each second, with the last telemetry of each kind that came in it."""

    def __init__(self, print_: Print) -> None:
        self._print = print_
        self._shown_s = 0.0
        self._kinds: set[int] = set()

    def show(self, session: Session, heard: Sequence[Heard], answers: Sequence[Answer]) -> None:
        for answer in answers:
            self._print(answer.text())
        self._kinds.update(frame.frame[2] for frame in heard)
        if session.time_s - self._shown_s < EVERY_S:
            return
        self._shown_s += EVERY_S * ((session.time_s - self._shown_s) // EVERY_S)
        self._print(progress(session))
        for kind in sorted(self._kinds - {TYPE_MSP_RESPONSE}):
            self._print(f"{'':10}{telemetry(session.latest[kind])}")
        self._kinds.clear()

    def finish(self, session: Session) -> None:
        self._print("")
        for line in summary.lines(session):
            self._print(line)


class Objects(Output):
    """One JSON object a line: `event` is `telemetry`, `msp`, `statistics` or `summary`."""

    def __init__(self, print_: Print) -> None:
        self._print = print_
        self._shown_s = 0.0

    def show(self, session: Session, heard: Sequence[Heard], answers: Sequence[Answer]) -> None:
        for frame in heard:
            self._object("telemetry", frame.time_s, **_fields(frame))
        for answer in answers:
            self._object(
                "msp",
                session.now_s,
                msp_command=answer.command,
                msp_command_name=fields.msp_command_names().get(answer.command),
                msp_error=answer.data is None,
                msp_data=None if answer.data is None else answer.data.hex(),
            )
        if session.time_s - self._shown_s >= EVERY_S:
            self._shown_s += EVERY_S * ((session.time_s - self._shown_s) // EVERY_S)
            self._object("statistics", session.now_s, **summary.statistics(session))

    def finish(self, session: Session) -> None:
        self._object("summary", session.now_s, **summary.statistics(session))

    def _object(self, event: str, time_s: float, **values: Any) -> None:
        self._print(json.dumps({"event": event, "t": round(time_s, 6), **values}))


def telemetry(heard: Heard) -> str:
    """A frame of the flight controller as a line."""
    frame = heard.frame
    title = kinds.title(kinds.name(frame[0], frame[2]))
    slot = "not measured" if heard.slot_us is None else f"{heard.slot_us:.0f} us"
    return f"0x{frame[2]:02x}  {title:<14}  slot {slot}  {says(frame)}"


def progress(session: Session) -> str:
    """How it goes, as a line."""
    receiver, listening = session.receiver, session.listening
    length_s = session.uplink.length_s
    parts = [
        f"{session.time_s:6.1f} s{'' if length_s is None else f' of {length_s:.1f}'}",
        "link lost" if session.lost else f"{session.recent_rate_hz:.1f} frames a second",
        f"LQ {receiver.lq} %",
        f"RSSI {receiver.rssi_dbm} dBm",
        f"telemetry {listening.frames.total()}",
    ]
    if listening.echo.present:
        parts.append(f"echo {listening.echo.intact}")
    elif listening.echo.present is False:
        parts.append("no echo")
    parts += [f"{count} {what}" for what, count in errors(session).items() if count]
    return "  ".join(parts)


def errors(session: Session) -> dict[str, int]:
    """What should not be, with its number."""
    listening = session.listening
    return {
        "collisions": listening.echo.broken,
        "damaged frames": listening.damaged,
        "bytes of garbage": listening.garbage_bytes,
        "slots left out": 0 if session.network else session.rhythm.skipped,
    }


def _fields(heard: Heard) -> dict[str, Any]:
    frame = heard.frame
    return {
        "addr": frame[0],
        "type": frame[2],
        "name": kinds.name(frame[0], frame[2]),
        "slot_us": None if heard.slot_us is None else round(heard.slot_us, 1),
        **fields.read(frame),
    }
