"""The live view of the wire, in a terminal."""

from __future__ import annotations

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from ghst.protocol import FRAME_LENGTH, RF_MODES  # type: ignore[import-not-found]
from ghst_tools.frames import kinds
from ghst_tools.sniff.state import State

_EVERY_S = 0.1
_SILENT_AFTER_S = 0.5  # when flight controllers give a link up
_OTHER_LINES = 20


class LiveView:
    """Draws a `State` ten times a second."""

    def __init__(self, console: Console, title: str) -> None:
        self._console = console
        self._title = title
        self._shown_s = -_EVERY_S
        self._heard_s: float | None = None
        self._frames = 0
        self._live = Live(console=console, auto_refresh=False, transient=True)

    def __enter__(self) -> LiveView:
        self._live.__enter__()
        return self

    def __exit__(self, *details: object) -> None:
        self._live.__exit__(None, None, None)

    def show(self, state: State) -> None:
        """Draw, if it is time to."""
        if state.receiver.frames != self._frames:
            self._frames = state.receiver.frames
            self._heard_s = state.time_s
        if state.time_s - self._shown_s >= _EVERY_S:
            self._shown_s = state.time_s
            self._live.update(self.draw(state), refresh=True)

    def draw(self, state: State) -> RenderableType:
        """The whole view."""
        room = max(0, self._console.height - _OTHER_LINES - len(state.stream.summary.frames))
        lines = Text("\n".join(list(state.last_lines)[-room:] if room else []), style="dim")
        lines.no_wrap, lines.overflow = True, "ellipsis"
        parts: list[RenderableType] = [self._link(state), Text(), _channels(state), Text()]
        parts += [_frames(state), Text(), _errors(state), _timing(state), Text(), lines]
        title = f"{self._title}, {state.time_s:.0f} s"
        return Panel(
            Group(*parts),
            title=Text(title),
            title_align="left",
            border_style="cyan",
        )

    def _link(self, state: State) -> Text:
        receiver = state.receiver
        silent = self._heard_s is None or state.time_s - self._heard_s > _SILENT_AFTER_S
        told = (
            ("no control frames  ", "bold red") if silent else ("control frames  ", "bold green")
        )
        if not receiver.rf_mode:
            return Text.assemble(told, "no link data yet")
        mode = RF_MODES.get(receiver.rf_mode)
        name = mode[0] if mode else f"RF mode {receiver.rf_mode}"
        return Text.assemble(
            told,
            f"LQ {receiver.lq:3d} %  RSSI {receiver.rssi_dbm:4d} dBm  {name}  "
            f"{receiver.tx_power_dbm:+d} dBm",
        )


def _channels(state: State) -> Table:
    table = Table.grid(padding=(0, 1))
    for _ in range(8):
        table.add_column(justify="right", style="dim")
        table.add_column(justify="right", min_width=7)
    for first in (0, 8):
        cells: list[str] = []
        for number, pulse in enumerate(state.receiver.pulses[first : first + 8], first + 1):
            cells += [str(number), f"{pulse / 4:.2f}" if pulse else "-"]
        table.add_row(*cells)
    return table


def _frames(state: State) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim")
    table.add_column("")
    table.add_column("type")
    table.add_column("frame")
    table.add_column("count", justify="right")
    table.add_column("per second", justify="right")
    rates_hz = state.rates_hz()
    for (address, kind, whole), count in sorted(state.stream.summary.frames.items()):
        title = kinds.title(kinds.name(address, kind))
        title += "" if address in kinds.ENDS else f", to 0x{address:02x}"
        title += "" if whole else f", length not {FRAME_LENGTH}"
        rate = f"{rates_hz.get((address, kind), 0.0):.1f}"
        table.add_row(kinds.direction(address), f"0x{kind:02x}", title, str(count), rate)
    return table


def _errors(state: State) -> Text:
    summary = state.stream.summary
    wrong = summary.damaged or summary.garbage_bytes
    return Text(summary.leftovers(), style="yellow" if wrong else "")


def _timing(state: State) -> Text:
    return Text("\n".join(state.stream.timing.lines()), style="")
