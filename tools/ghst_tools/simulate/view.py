"""The live view, in a terminal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from ghst.protocol import TYPE_MSP_RESPONSE  # type: ignore[import-not-found]
from ghst_tools.simulate import summary
from ghst_tools.simulate.listening import Heard
from ghst_tools.simulate.msp_client import Answer
from ghst_tools.simulate.output import Lines, Output, errors, telemetry
from ghst_tools.simulate.session import Session

_EVERY_S = 0.1
_WIDE = 100
_BAR = 12
_BAR_US = (1000, 2000)
_BLOCKS = " ▁▂▃▄▅▆▇█"
# Flight controllers send from 1000 us on; a receiver gives up before the next frame at 2000 us.
_HISTOGRAM_US = (0, 2500)
_BINS = 50
_NEWEST = 5000


class LiveView(Output):
    """Draws a session ten times a second, and leaves its figures as lines."""

    def __init__(self, console: Console, title: str, help_text: str = "") -> None:
        self._console = console
        self._title = title
        self._help = help_text
        self._shown_s = -_EVERY_S
        self._answers: list[str] = []
        self._live = Live(console=console, auto_refresh=False, transient=True)

    def __enter__(self) -> LiveView:
        self._live.__enter__()
        return self

    def __exit__(self, *details: object) -> None:
        self._live.__exit__(None, None, None)

    def show(self, session: Session, heard: Sequence[Heard], answers: Sequence[Answer]) -> None:
        self._answers += [answer.text() for answer in answers]
        if session.time_s - self._shown_s >= _EVERY_S:
            self._shown_s = session.time_s
            self._live.update(self.draw(session), refresh=True)

    def finish(self, session: Session) -> None:
        self._live.stop()
        for answer in self._answers:
            self._console.print(answer, markup=False)
        Lines(lambda line: self._console.print(line, markup=False)).finish(session)

    def draw(self, session: Session) -> RenderableType:
        """The whole view."""
        parts: list[RenderableType] = [
            _link(session),
            Text(),
            _channels(session, 4 if self._console.width >= _WIDE else 2),
            Text(),
            _telemetry(session),
            *map(Text, self._answers),
            *_slots(session),
            Text(),
            _errors(session),
        ]
        if self._help:
            parts.append(Text(self._help, style="dim"))
        length_s = session.uplink.length_s
        title = f"{self._title}, {session.time_s:.0f} s"
        title += "" if length_s is None else f" of {length_s:.0f} s"
        return Panel(Group(*parts), title=Text(title), title_align="left", border_style="cyan")


def _link(session: Session) -> Text:
    receiver = session.receiver
    told = ("link lost  ", "bold red") if session.lost else ("sending  ", "bold green")
    half, _, latest = session.rhythm.late_us
    name = f"{session.link.name}  " if session.link else ""
    return Text.assemble(
        told,
        f"{name}{session.recent_rate_hz:.1f} frames a second  LQ {receiver.lq:3d} %  "
        f"RSSI {receiver.rssi_dbm:4d} dBm  {session.sent_bursts} sent, late {half:.0f} us, "
        f"at most {latest:.0f}",
    )


def _channels(session: Session, columns: int) -> Table:
    table = Table.grid(padding=(0, 1))
    for _ in range(columns):
        table.add_column(justify="right", style="dim")
        table.add_column(style="cyan")
        table.add_column(justify="right", min_width=7)
    pulses = session.receiver.pulses
    rows = len(pulses) // columns
    for row in range(rows):
        cells: list[str] = []
        for number in range(row, len(pulses), rows):
            pulse = pulses[number]
            cells += [str(number + 1), _bar(pulse / 4), f"{pulse / 4:.2f}" if pulse else "-"]
        table.add_row(*cells)
    return table


def _bar(width_us: float) -> str:
    low, high = _BAR_US
    filled = max(0, min(_BAR, round((width_us - low) / (high - low) * _BAR)))
    return "█" * filled + "·" * (_BAR - filled)


def _telemetry(session: Session) -> Text:
    frames = [
        telemetry(heard)
        for kind, heard in sorted(session.latest.items())
        if kind != TYPE_MSP_RESPONSE
    ]
    if frames:
        return Text("\n".join(frames))
    if session.link and not session.link.downlink:
        return Text(f"no telemetry: {session.link.name} has no downlink", style="dim")
    return Text("no telemetry yet", style="yellow")


def _slots(session: Session) -> list[RenderableType]:
    slots_us = session.listening.slots_us[-_NEWEST:]
    if not slots_us:
        return []
    low, high = _HISTOGRAM_US
    counts, _ = np.histogram(np.clip(slots_us, low, high), _BINS, _HISTOGRAM_US)
    most = int(counts.max())
    # What is there is seen, however little it is.
    heights = [-(-int(count) * (len(_BLOCKS) - 1) // most) for count in counts]
    drawn = "".join(_BLOCKS[height] for height in heights)
    return [
        Text(),
        Text(summary.slot(session, _NEWEST)),
        Text.assemble((f"{low} us ", "dim"), (drawn, "green"), (f" {high} us and more", "dim")),
    ]


def _errors(session: Session) -> Text:
    echo = session.listening.echo
    if echo.present:
        text = f"echo: {echo.intact} intact"
    else:
        text = "echo: none" if echo.present is False else "echo: not known yet"
    found = errors(session)
    text += "".join(f", {count} {what}" for what, count in found.items())
    return Text(text, style="yellow" if any(found.values()) else "")
