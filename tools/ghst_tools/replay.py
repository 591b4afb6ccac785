"""The command `ghst replay`."""

from __future__ import annotations

import contextlib
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np

from ghst.protocol import BAUD_RATE, RF_MODES  # type: ignore[import-not-found]
from ghst_tools.errors import GhstError
from ghst_tools.frames import columns, kinds
from ghst_tools.frames.formats import FORMATS, Source
from ghst_tools.frames.recording import Recording, load
from ghst_tools.frames.timeline import Seconds
from ghst_tools.serial_port import open_wire, unplugged

Clock = Callable[[], float]
Sleep = Callable[[float], None]


@dataclass(frozen=True)
class Plan:
    """Frames, when each is to be sent from the first one on, and how long all of it takes."""

    frames: list[bytes]
    due_s: Seconds
    duration_s: float

    def lines(self) -> list[str]:
        """What this will send."""
        rate_hz = len(self.frames) / self.duration_s
        found = [f"{len(self.frames)} frames in {self.duration_s:.3f} s, {rate_hz:.1f} a second"]
        counts = Counter((frame[0], frame[2]) for frame in self.frames)
        for (address, kind), count in sorted(counts.items()):
            title = kinds.title(kinds.name(address, kind))
            text = f"{count:9d}  0x{kind:02x}  {title}"
            found.append(text + ("" if address in kinds.ENDS else f", to 0x{address:02x}"))
        return found


def plan(recording: Recording, speed: float, rate_hz: float | None, baud: int) -> Plan:
    """The valid frames of the receiver's side, with their distances divided by `speed`.

    With `rate_hz`, or where the recording has no times, they are evenly spaced; without `rate_hz`
    then at the rate of the RF mode that the recording names. `GhstError` if there is nothing to
    send, no rate to be had, or the wire is too slow.
    """
    pieces = recording.pieces
    chosen = np.flatnonzero(columns.valid(pieces) & ~columns.downlink(pieces))
    if not len(chosen):
        raise GhstError(f"{recording.where}: there is no frame of the receiver in it")
    limits = zip(pieces.starts[chosen].tolist(), pieces.stops[chosen].tolist(), strict=True)
    frames = [pieces.data[start:stop] for start, stop in limits]
    if rate_hz is None and recording.times is not None:
        due_s = recording.times.begins_s[chosen]
        due_s = (due_s - due_s[0]) / speed
    else:
        due_s = np.arange(len(frames)) / ((rate_hz or _mode_rate_hz(recording)) * speed)
    # Round again the first frame comes as far behind the last one as frames are from each other.
    last_s = float(np.median(np.diff(due_s))) if len(frames) > 1 else 1.0
    duration_s = float(due_s[-1]) + last_s
    on_the_wire_s = sum(map(len, frames)) * 10 / baud
    if on_the_wire_s > duration_s:
        raise GhstError(
            f"{recording.where}: {len(frames)} frames take {on_the_wire_s:.3f} s at {baud} baud, "
            f"they do not fit in {duration_s:.3f} s: choose a lower speed"
        )
    return Plan(frames, due_s, duration_s)


def _mode_rate_hz(recording: Recording) -> float:
    modes = columns.link(recording.pieces).rf_mode
    if len(modes) and int(modes[-1]) in RF_MODES:
        return float(RF_MODES[int(modes[-1])][1])
    raise GhstError(
        f"{recording.where}: has no times, and no link data with an RF mode: say how many frames "
        "a second with --rate"
    )


@dataclass
class Sent:
    """How it went."""

    frames: int = 0
    latest_s: float = 0.0
    """By how much the latest frame was too late."""


def send(
    line: Any,
    plan: Plan,
    loop: bool,
    sent: Sent,
    clock: Clock = time.perf_counter,
    sleep: Sleep = time.sleep,
) -> None:
    """Send everything, once or for ever; `sent` is kept up to date."""
    round_s = clock()
    while True:
        for frame, due_s in zip(plan.frames, plan.due_s.tolist(), strict=True):
            wait_s = round_s + due_s - clock()
            if wait_s > 0:
                sleep(wait_s)
            sent.latest_s = max(sent.latest_s, clock() - round_s - due_s)
            line.write(frame)
            sent.frames += 1
        if not loop:
            break
        round_s += plan.duration_s
    line.flush()


@click.command()
@click.argument("file", type=click.Path(path_type=Path, allow_dash=True))
@click.option("--port", help="Serial port to send to; without it nothing is sent.")
@click.option(
    "--speed",
    type=click.FloatRange(min=0, min_open=True),
    default=1.0,
    show_default=True,
    help="How many times as fast as it was recorded.",
)
@click.option("--loop", is_flag=True, help="Begin again at the end, until Ctrl-C.")
@click.option(
    "--rate",
    "rate_hz",
    type=click.FloatRange(min=0, min_open=True),
    help="Frames a second, evenly; default: the times of the recording, or its RF mode.",
)
@click.option("--format", "format_", type=click.Choice(list(FORMATS)), help="As of ghst decode.")
@click.option(
    "--baud", type=click.IntRange(min=1), default=BAUD_RATE, show_default=True, help="Baud rate."
)
def command(
    file: Path,
    port: str | None,
    speed: float,
    loop: bool,
    rate_hz: float | None,
    format_: str | None,
    baud: int,
) -> None:
    """Send the receiver's frames of a recording to a serial port, as they came.

    What listens there obeys: servos move. Take the propellers off.

    A log of `ghst sniff` has times as exact as the adapter gave them: frames that came in one
    burst are sent in one. --rate spaces them evenly. Without --port this only says what it would
    send.
    """
    planned = plan(load(Source(file, format_)), speed, rate_hz, baud)
    for text in planned.lines():
        click.echo(text)
    if port is None:
        click.echo("nothing sent: name a serial port with --port")
        return
    sent = Sent()
    with contextlib.closing(open_wire(port, baud)) as line:
        try:
            with unplugged(port, "the recording was not sent to its end"):
                send(line, planned, loop, sent)
        except KeyboardInterrupt:
            if not loop:
                raise
        finally:
            late_us = sent.latest_s * 1e6
            click.echo(f"sent {sent.frames} frames to {port}, the latest {late_us:.0f} us late")
