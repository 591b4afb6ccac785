"""The live view of a run: a table that renews itself in a terminal, plain lines elsewhere."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from ghst_tools.demo.report import Report, Row, Snapshot, View

_LINK_STYLES = {"linked": "bold green", "searching": "bold yellow", "failsafe": "bold red"}
_TRACK = (21, 61)  # narrowest and widest, characters
_OTHER_COLUMNS = 57
_LOWEST_US, _HIGHEST_US = 850, 2190  # a little beyond what a frame can carry
_CONSOLE_LINES = 3
_TALL = 32  # lines of a terminal that has room for everything
_PLAIN_EVERY_S = 0.5


@contextlib.contextmanager
def open_view(console: Console, title: str, measured: str) -> Iterator[View]:
    """A view on `console` for the time of a run; `measured` names the column of the values."""
    if not console.is_terminal:
        yield _PlainView(console)
        return
    view = _LiveView(console, title, measured)
    # The display is renewed by the run itself: a thread of its own would show a torn state.
    with Live(console=console, auto_refresh=False) as live:
        view.live = live
        yield view


class _PlainView:
    """A line for each phase, and one now and then."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._phase = ""
        self._shown_s = 0.0

    def show(self, snapshot: Snapshot) -> None:
        now_s = snapshot.emulated_s
        if snapshot.phase != self._phase:
            self._phase = snapshot.phase
            self._print(f"{_clock(snapshot)}{snapshot.phase}")
        elif now_s is None or now_s - self._shown_s < _PLAIN_EVERY_S:
            return
        self._shown_s = now_s or 0.0
        if snapshot.frames_sent:
            self._print(f"{_clock(snapshot)}  {_link(snapshot)}; {_counters(snapshot)}")
        if snapshot.radio:
            radio = "; ".join(text for _, text in snapshot.radio)
            self._print(f"{_clock(snapshot)}  radio: {radio}")

    def _print(self, line: str) -> None:
        self._console.print(line, highlight=False, soft_wrap=True, markup=False)


class _LiveView:
    """The table."""

    def __init__(self, console: Console, title: str, measured: str) -> None:
        ascii_only = console.options.ascii_only
        self._console = console
        self._title = title
        self._measured = measured
        self._marks = ("-", "|", "*") if ascii_only else ("─", "│", "●")
        self._spinner = Spinner("line" if ascii_only else "dots", style="cyan")
        self._started = time.monotonic()
        self.live: Live | None = None

    def show(self, snapshot: Snapshot) -> None:
        if self.live is not None:
            self.live.update(self._draw(snapshot), refresh=True)

    def _draw(self, snapshot: Snapshot) -> RenderableType:
        self._spinner.update(text=Text(snapshot.phase, style="bold"))
        progress = Table.grid(padding=(0, 1), expand=True)
        progress.add_column(ratio=1)
        progress.add_column(justify="right")
        wall = f"{time.monotonic() - self._started:.0f} s"
        clock = f"{snapshot.emulated_s:.2f} s emulated in {wall}" if snapshot.emulated_s else wall
        done = ProgressBar(total=1.0, completed=snapshot.progress, complete_style="cyan")
        progress.add_row(done, clock)
        parts: list[RenderableType] = [self._spinner, progress, Text(), self._table(snapshot)]
        tall = self._console.height >= _TALL or not snapshot.radio
        if tall:
            note = "off by: the last pulse against the value in force when it rose"
            parts.append(Text(note, style="dim"))
        parts += [Text(), self._status(snapshot)]
        if snapshot.radio:
            parts += [Text(), self._radio(snapshot, tall)]
        if snapshot.console and tall:
            said = "\n".join(snapshot.console[-_CONSOLE_LINES:])
            parts += [Text(), Text(said, style="dim", no_wrap=True, overflow="ellipsis")]
        return Panel(Group(*parts), title=self._title, title_align="left", border_style="cyan")

    def _table(self, snapshot: Snapshot) -> Table:
        table = Table(box=None, padding=(0, 1), expand=False, header_style="dim")
        if snapshot.rows[0].output:
            table.add_column("pin")
        table.add_column("ch", justify="right")
        table.add_column("sent, us", justify="right", min_width=8)
        table.add_column(f"{self._measured}, us", justify="right")
        table.add_column("off by, us", justify="right")
        width = max(_TRACK[0], min(_TRACK[1], self._console.width - _OTHER_COLUMNS))
        table.add_column(Text(f"{_LOWEST_US}{_HIGHEST_US:>{width - 3}}"))
        for row in snapshot.rows:
            pin = [row.output] if row.output else []
            table.add_row(*pin, str(row.channel), *self._values(row), self._track(row, width))
        return table

    def _values(self, row: Row) -> tuple[Text, Text, Text]:
        sent = Text(f"{row.sent_us:.2f}" if row.sent_us else "none")
        if row.measured_us is None:
            return sent, Text("no pulses", style="yellow"), Text()
        return sent, Text(f"{row.measured_us:.3f}", style="bold"), Text(f"{row.error_us:+.3f}")

    def _track(self, row: Row, width: int) -> Text:
        line, sent, measured = self._marks
        track = Text(line * width, style="dim")
        for us, mark, style in ((row.sent_us, sent, "cyan"), (row.measured_us, measured, "green")):
            if us:
                at = round((us - _LOWEST_US) / (_HIGHEST_US - _LOWEST_US) * (width - 1))
                at = max(0, min(width - 1, at))
                track = Text.assemble(track[:at], (mark, f"not dim bold {style}"), track[at + 1 :])
        return track

    def _radio(self, snapshot: Snapshot, framed: bool) -> RenderableType:
        lines = Table.grid(padding=(0, 2))
        lines.add_column(style="dim", no_wrap=True)
        lines.add_column(no_wrap=True)
        for label, text in snapshot.radio:
            lines.add_row(label, Text(text, style="bold"))
        if not framed:
            return lines
        return Panel(
            lines, title="on the pilot's radio", title_align="left", style="green", expand=False
        )

    def _status(self, snapshot: Snapshot) -> Text:
        link_style = _LINK_STYLES.get(snapshot.link, "")
        return Text.assemble(
            "link ",
            (f"{snapshot.link:<9}", link_style),
            f"  LQ {snapshot.lq:3d} %   RSSI {snapshot.rssi_dbm:4d} dBm\n",
            f"frames sent {snapshot.frames_sent}, decoded {snapshot.frames_decoded}, "
            f"CRC errors {snapshot.crc_errors}   pulses ",
            (f"right {snapshot.right}", "green"),
            ", ",
            (f"wrong {snapshot.wrong}", "bold red" if snapshot.wrong else "green"),
        )


def summarise(console: Console, report: Report) -> None:
    """Print the figures and the verdict."""
    console.print()
    if console.is_terminal:
        table = Table.grid(padding=(0, 2))
        table.add_column(style="dim", no_wrap=True)
        table.add_column()
        for label, text in report.lines:
            table.add_row(label, Text(text))
        console.print(table)
    else:
        for label, text in report.lines:
            console.print(Text(f"{label}: {text}"), soft_wrap=True)
    console.print()
    shown = report.failures[:10]
    for line in shown:
        console.print(Text(f"NOT RIGHT: {line}", style="bold red"), soft_wrap=True)
    if more := len(report.failures) - len(shown):
        console.print(Text(f"... and {more} more", style="bold red"))
    if not shown:
        console.print(Text("everything right", style="bold green"))


def _clock(snapshot: Snapshot) -> str:
    return "" if snapshot.emulated_s is None else f"{snapshot.emulated_s:6.3f} s  "


def _link(snapshot: Snapshot) -> str:
    return f"link {snapshot.link}, LQ {snapshot.lq} %, RSSI {snapshot.rssi_dbm} dBm"


def _counters(snapshot: Snapshot) -> str:
    return (
        f"frames sent {snapshot.frames_sent}, decoded {snapshot.frames_decoded}, CRC errors "
        f"{snapshot.crc_errors}; right {snapshot.right}, wrong {snapshot.wrong}"
    )
