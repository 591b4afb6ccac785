"""The monitor's full-screen view."""

from __future__ import annotations

import time
from pathlib import Path
from typing import ClassVar

from textual.app import App, ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.widgets import Footer, Input, RichLog, Static

from ghst_tools.errors import GhstError
from ghst_tools.monitor import panels
from ghst_tools.monitor.csv_log import CsvLog, new_path
from ghst_tools.monitor.feed import Feed
from ghst_tools.monitor.state import State

_EVERY_S = 0.1
_SILENT_AFTER_S = 1.0


class Monitor(App[None]):
    """Shows what a `Feed` brings; `error` is what ended it, or None."""

    ENABLE_COMMAND_PALETTE = False
    TITLE = "ghst monitor"
    CSS = """
    #link { dock: top; height: 2; background: $boost; }
    #values { height: 18; }
    #values > VerticalScroll { border: round $primary; padding: 0 1; height: 100%; }
    #channels { width: 48; min-width: 44; }
    #outputs { width: 19; }
    #counters { width: 1fr; }
    #sensors { height: auto; max-height: 8; border: round $primary; padding: 0 1; }
    #text { height: 1fr; min-height: 3; border: round $primary; }
    #command { display: none; }
    #said { height: 1; color: $text-muted; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        ("p", "pause", "Pause"),
        ("l", "log", "Log to CSV"),
        ("c", "command", "Command"),
        ("enter", "state", "State of the board"),
        ("q", "quit", "Quit"),
    ]

    def __init__(self, feed: Feed, log: CsvLog | None = None, folder: Path | None = None) -> None:
        """`log`: what to write to from the beginning; `folder`: for logs that a key begins."""
        super().__init__()
        self._feed = feed
        self.log_file = log
        self._folder = folder or Path()
        self.state = State()
        self.paused = False
        self.error: GhstError | None = None
        self._heard_s = time.monotonic()

    def compose(self) -> ComposeResult:
        """The parts of the screen."""
        yield Static(id="link")
        with Horizontal(id="values"):
            for name in ("channels", "outputs", "counters"):
                with VerticalScroll(id=name, can_focus=False):
                    yield Static(id=f"{name}-values")
        yield Static(id="sensors")
        yield RichLog(id="text", wrap=True)
        yield Input(id="command", placeholder="command for the board, such as help; Esc: none")
        yield Static(id="said")
        yield Footer()

    def on_mount(self) -> None:
        """Begin to look for what has come."""
        titles = {"channels": "channels, us", "outputs": "outputs, us", "counters": "counters"}
        for name, title in (titles | {"sensors": "sensors", "text": "board"}).items():
            self.query_one(f"#{name}").border_title = title
        text = self.query_one("#text", RichLog)
        text.can_focus = False
        self.set_interval(_EVERY_S, self._update)
        self._update()

    def _update(self) -> None:
        changed = False
        while (item := self._feed.take()) is not None:
            if isinstance(item, GhstError):
                self._end(item)
                return
            if isinstance(item, str):
                self.query_one("#text", RichLog).write(item)
            elif item["ghst"] == "status":
                changed = self._take(item) or changed
            elif item["ghst"] == "error":
                self.query_one("#text", RichLog).write(f"error: {item.get('text', '')}")
            else:
                self.query_one("#text", RichLog).write(str(item))
        if changed and not self.paused:
            self._draw()
        self._tell()

    def _take(self, status: dict[str, object]) -> bool:
        self._heard_s = time.monotonic()
        self.state.add(status)
        if self.log_file:
            try:
                self.log_file.add(status)
            except GhstError as error:
                self._end(error)
        return True

    def _draw(self) -> None:
        self.query_one("#link", Static).update(panels.link(self.state))
        self.query_one("#channels-values", Static).update(panels.channels(self.state))
        self.query_one("#outputs-values", Static).update(panels.outputs(self.state))
        self.query_one("#counters-values", Static).update(panels.counters(self.state))
        self.query_one("#sensors", Static).update(panels.sensors(self.state))

    def _tell(self) -> None:
        silent_s = time.monotonic() - self._heard_s
        parts = [self._feed.port]
        if self.paused:
            parts.append("PAUSED")
        if self.log_file:
            parts.append(f"log {self.log_file.path}, {self.log_file.lines} lines")
        if silent_s > _SILENT_AFTER_S:
            parts.append(f"nothing from the board for {silent_s:.0f} s")
        self.query_one("#said", Static).update(" " + ", ".join(parts))

    def _end(self, error: GhstError) -> None:
        self.error = error
        self.exit()

    def action_pause(self) -> None:
        """Hold the values on the screen; a log goes on."""
        self.paused = not self.paused
        if not self.paused and self.state.status:
            self._draw()
        self._tell()

    def action_log(self) -> None:
        """Begin a new file, or end the one that is written."""
        if self.log_file:
            self.log_file.close()
            self.query_one("#text", RichLog).write(f"log {self.log_file.path} ended")
            self.log_file = None
        else:
            try:
                self.log_file = CsvLog(new_path(self._folder))
            except GhstError as error:
                self.query_one("#text", RichLog).write(str(error))
        self._tell()

    def action_command(self) -> None:
        """Ask for a command."""
        field = self.query_one("#command", Input)
        field.display = True
        field.focus()

    def action_state(self) -> None:
        """Have the board say everything for people."""
        self._send("")

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Send the command."""
        self._hide()
        if event.value.strip():
            self.query_one("#text", RichLog).write(f"> {event.value.strip()}")
            self._send(event.value.strip())

    def key_escape(self) -> None:
        """Send none."""
        self._hide()

    def _hide(self) -> None:
        field = self.query_one("#command", Input)
        field.value = ""
        field.display = False
        self.set_focus(None)

    def _send(self, line: str) -> None:
        if not line.isascii():
            self.query_one("#text", RichLog).write("the board takes ASCII only")
            return
        try:
            self._feed.send(line)
        except GhstError as error:
            self._end(error)
