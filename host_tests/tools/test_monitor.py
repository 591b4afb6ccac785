"""`ghst monitor`: on a recorded board, on the emulated one, and in a real terminal."""

from __future__ import annotations

import asyncio
import csv
import json
import os
import re
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from served_board import ServedBoard
from terminal import Terminal, terminal
from textual.widgets import Input, RichLog, Static

from ghst_tools import boards, device_files, filesystem
from ghst_tools.errors import GhstError
from ghst_tools.monitor.csv_log import CsvLog, new_path
from ghst_tools.monitor.feed import Feed
from ghst_tools.monitor.screen import Monitor
from ghst_tools.monitor.state import State
from ghst_tools.tool_docs import run as tool_docs
from ghst_tools.tool_docs.ports import adapters

ROOT = boards.checkout()
RECORDED = [json.loads(line) for line in (ROOT / tool_docs.STATUS).read_text().splitlines()]
PATIENCE_S = 600.0
SIZE = (112, 38)


@pytest.fixture
def recorded(tmp_path: Path) -> Iterator[str]:
    """The port of a board that says what a real run has said."""
    with adapters(tmp_path, ROOT / tool_docs.RECORDING, ROOT / tool_docs.STATUS):
        yield str(tmp_path / "ttyACM0")


def monitor(*arguments: str, timeout_s: float = PATIENCE_S) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "ghst_tools.cli", "monitor", *arguments],
        capture_output=True,
        text=True,
        timeout=timeout_s,
    )


def shown(screen: Monitor, name: str) -> str:
    """What a part of the screen has in it."""
    if name == "text":
        return "\n".join(line.text for line in screen.query_one("#text", RichLog).lines)
    return str(screen.query_one(f"#{name}", Static).render())


def picture_words(svg: str) -> str:
    """The text in a picture of the screen."""
    return re.sub(r"<[^>]*>", " ", svg).replace("&#160;", " ")


def test_rates_are_of_the_last_second() -> None:
    state = State()
    assert state.frame_rate_hz is None
    for index, line in enumerate(RECORDED):
        state.add(line)
        assert state.lines == index + 1
    assert state.frame_rate_hz == pytest.approx(250, rel=0.02)
    assert (state.rf_mode, state.downlink) == ("Race250", True)
    # The clock and the counter go on at 0.
    first = RECORDED[0] | {"time_ms": 0x3FFFFFFF, "frames": 0x3FFFFFF0}
    state = State()
    state.add(first)
    state.add(first | {"time_ms": 199, "frames": 0x3FFFFFF0 + 15})
    assert state.frame_rate_hz == 75.0
    state.add(first | {"time_ms": 399, "frames": 5})
    assert state.frame_rate_hz is None
    state.add(first | {"time_ms": 599, "frames": 5, "rf_mode": 11})
    assert (state.frame_rate_hz, state.rf_mode, state.downlink) == (0.0, "Race500", False)
    state.add(first | {"rf_mode": 31})
    assert (state.rf_mode, state.downlink) == ("RF mode 31", None)


def test_a_log_replaces_no_file(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    log = CsvLog(path)
    for line in RECORDED[:3]:
        log.add(line)
    log.close()
    rows = list(csv.DictReader(path.open()))
    assert len(rows) == 3
    assert rows[2]["channel_16_us"] == str(RECORDED[2]["channels_us"][15])
    assert rows[2]["output_13_us"] == str(RECORDED[2]["outputs_us"]["13"])
    assert rows[2]["gps.satellites"] == str(RECORDED[2]["gps"]["satellites"])
    assert rows[2]["time_ms"] == str(RECORDED[2]["time_ms"])
    before = path.read_bytes()
    with pytest.raises(GhstError, match=r"log.csv: is there already: say another name$"):
        CsvLog(path)
    assert path.read_bytes() == before
    with pytest.raises(GhstError, match=r"log.csv: there is no folder .*none: make it first$"):
        CsvLog(tmp_path / "none" / "log.csv")
    names = set()
    for _ in range(3):
        names.add(new_path(tmp_path))
        new_path(tmp_path).touch()
    assert len(names) == 3


def test_json_is_a_line_for_each_state(recorded: str, tmp_path: Path) -> None:
    path = tmp_path / "states.csv"
    done = monitor("--port", recorded, "--json", "--seconds", "1", "--log", str(path))
    assert (done.returncode, done.stderr) == (0, "")
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert lines == RECORDED[: len(lines)] and len(lines) >= 2
    assert len(path.read_text().splitlines()) == 1 + len(lines)
    done = monitor("--port", recorded, "--json", "--seconds", "1", "--log", str(path))
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == f"ghst: {path}: is there already: say another name\n"


def test_the_screen_and_its_keys(recorded: str, tmp_path: Path) -> None:
    async def use() -> None:
        with Feed(recorded, 200) as feed:
            screen = Monitor(feed, folder=tmp_path)
            async with screen.run_test(size=SIZE) as pilot:
                while screen.state.lines < 2:
                    await pilot.pause(0.05)
                link = shown(screen, "link")
                assert " LINKED " in link and "Race250" in link and "0 failsafes" in link
                status = screen.state.status
                words = picture_words(screen.export_screenshot())
                for word in ("CH16", "GP13", "telemetry sent", "battery", "3D fix, 14 satellites"):
                    assert word in words
                await pilot.press("p")
                assert "PAUSED" in shown(screen, "said")
                await pilot.press("l")
                while not (screen.log_file and screen.log_file.lines):
                    await pilot.pause(0.05)
                await pilot.press("p")
                assert screen.state.status != status
                await pilot.press("l")
                assert screen.log_file is None
                # A command, and one that is thought better of.
                await pilot.press("c", *"fly", "enter")
                await pilot.press("c", *"no", "escape", "enter")
                while "link: linked" not in shown(screen, "text"):
                    await pilot.pause(0.05)
                assert "> fly\nno command 'fly': type help\n" in shown(screen, "text")
                assert not screen.query_one("#command", Input).display
                await pilot.press("q")
            assert screen.error is None

    asyncio.run(use())
    (log,) = tmp_path.glob("ghst-monitor-*.csv")
    assert len(log.read_text().splitlines()) >= 2


def test_a_board_that_is_unplugged_ends_the_screen() -> None:
    async def use(line: Terminal) -> Monitor:
        with Feed(line.port, 200) as feed:
            screen = Monitor(feed)
            async with screen.run_test(size=SIZE) as pilot:
                await pilot.pause()
                line.unplug()
                while screen.is_running and screen.error is None:
                    await pilot.pause(0.05)
            return screen

    with terminal() as line:
        line.send(json.dumps(RECORDED[0]).encode() + b"\r\n")
        # What has come before it is asked is no answer.
        screen = _answered(line, lambda: asyncio.run(use(line)))
    assert str(screen.error) == (
        f"{line.port}: gone (unplugged?): connect it again, or press its reset button"
    )


def _answered(line: Terminal, use: Callable[[], Monitor]) -> Monitor:
    """`use()`, with the board's end of `line` answering the first command."""

    def answer() -> None:
        received = b""
        while b"\r" not in received:
            received += line.receive(1)
        line.send(json.dumps(RECORDED[0]).encode() + b"\r\n")

    thread = threading.Thread(target=answer)
    thread.start()
    try:
        return use()
    finally:
        thread.join()


def test_what_goes_wrong_is_one_line(recorded: str, tmp_path: Path) -> None:
    for port, error in (
        ("/dev/ttyNONE", "there is no such port"),
        (str(tmp_path), "cannot be opened"),
    ):
        done = monitor("--port", port, "--json")
        assert (done.returncode, done.stdout) == (1, "")
        assert done.stderr.startswith(f"ghst: {port}: ") and done.stderr.count("\n") == 1
        assert error in done.stderr or "Is a directory" in done.stderr
    done = monitor("--port", recorded)
    assert done.stderr == "ghst: the view needs a terminal: use --json for scripts\n"
    with Feed(recorded, 200):
        done = monitor("--port", recorded, "--json")
        assert done.stderr.startswith(f"ghst: {recorded}: busy: close the program that has it ")


@pytest.fixture(scope="module")
def served(micropython_image: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The console of the emulated board with this tree's firmware, without sensors."""
    definition = boards.load("rpi_pico")
    sensors = ("battery", "gps", "barometer", "magnetometer")
    configuration = {name: {"enabled": False} for name in sensors}
    files = device_files.collect(definition)
    files["/ghst.json"] = json.dumps(configuration).encode()
    image = tmp_path_factory.mktemp("board") / "filesystem.img"
    image.write_bytes(filesystem.build(files, definition.filesystem_size))
    board = ServedBoard(micropython_image, image)
    yield board.address
    assert board.stop() == 0


def test_the_emulated_board_on_the_screen(served: str) -> None:
    async def use() -> None:
        with Feed(served, 200) as feed:
            screen = Monitor(feed)
            async with screen.run_test(size=SIZE) as pilot:
                end_s = time.monotonic() + PATIENCE_S
                await pilot.press("enter")
                while time.monotonic() < end_s and (
                    screen.state.lines < 4 or "main loop: stood" not in shown(screen, "text")
                ):
                    await pilot.pause(0.1)
                assert "SEARCHING" in shown(screen, "link")
                assert screen.state.status["channels_us"] == [None] * 16
                assert list(screen.state.status["outputs_us"]) == [str(n) for n in range(6, 14)]
                assert "micropython-ghst " in shown(screen, "text")
                assert "main loop: stood still 0 times" in shown(screen, "text")

    asyncio.run(use())


def test_watching_disturbs_nothing(served: str) -> None:
    """Twice in a row: the board has neither stopped nor started anew, nor lost its stream."""
    first = monitor("--port", served, "--json", "--seconds", "2")
    second = monitor("--port", served, "--json", "--seconds", "2")
    states = [json.loads(line) for line in (first.stdout + second.stdout).splitlines()]
    assert len(states) >= 2 and (first.returncode, second.returncode) == (0, 0)
    times_ms = [state["time_ms"] for state in states]
    assert times_ms == sorted(times_ms)
    assert {state["main_loop_stuck"] for state in states} == {0}


class Tmux:
    """A terminal of 112 by 38 with a shell in it."""

    def __init__(self, folder: Path) -> None:
        self._command = ["tmux", "-S", str(folder / "tmux"), "-f", os.devnull]
        # pytest's own terminal is another one.
        sizes = ("COLUMNS", "LINES")
        self._environment = {key: os.environ[key] for key in os.environ if key not in sizes}
        width, height = map(str, SIZE)
        self._do("new-session", "-d", "-x", width, "-y", height, "env PS1='$ ' sh")

    def _do(self, *arguments: str) -> str:
        done = subprocess.run(
            [*self._command, *arguments], capture_output=True, text=True, env=self._environment
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    def type(self, *keys: str) -> None:
        self._do("send-keys", *keys)

    def until(self, text: str) -> str:
        """The screen, as soon as it has `text`."""
        end_s = time.monotonic() + PATIENCE_S
        while True:
            screen = self._do("capture-pane", "-p")
            if text in screen:
                return screen
            assert time.monotonic() < end_s, screen
            time.sleep(0.1)

    def state(self, name: str) -> str:
        return self._do("display-message", "-p", f"#{{{name}}}").strip()

    def close(self) -> None:
        self._do("kill-server")


@pytest.mark.skipif(shutil.which("tmux") is None, reason="tmux is not installed")
def test_a_real_terminal(recorded: str, tmp_path: Path) -> None:
    tmux = Tmux(tmp_path)
    try:
        program = f"{sys.executable} -m ghst_tools.cli monitor --port {recorded}"
        tmux.until("$")
        tmux.type("echo before", "Enter")
        tmux.until("before\nbefore\n$")
        tmux.type(f"{program}; echo ended $?", "Enter")
        tmux.until("3D fix")
        screen = tmux.until("q Quit")
        assert tmux.state("alternate_on") == "1"
        lines = screen.splitlines()
        assert lines[0].startswith(" LINKED   LQ ") and "Race250" in lines[0]
        for number in range(1, 17):
            assert any(f"CH{number} " in line and " us" not in line for line in lines)
        for text in ("channels, us", "GP13", "telemetry sent", "battery", "q Quit", recorded):
            assert text in screen
        tmux.type("p")
        tmux.until("PAUSED")
        tmux.type("q")
        screen = tmux.until("ended 0")
        # The terminal is as it was: the lines from before, no mouse, a cursor.
        assert screen.startswith("$ echo before\nbefore\n") and "CH1" not in screen, screen
        assert tmux.state("alternate_on") == "0" and tmux.state("cursor_flag") == "1"
        assert tmux.state("mouse_any_flag") == "0"
    finally:
        tmux.close()


def test_the_picture_in_the_documentation() -> None:
    text = (ROOT / tool_docs.MONITOR_PICTURE).read_text(encoding="utf-8")
    for word in ("LINKED", "Race250", "CH16", "GP13", "3D fix", "ghst monitor"):
        assert word in picture_words(text)
    assert "http" not in text.replace("http://www.w3.org", "")
