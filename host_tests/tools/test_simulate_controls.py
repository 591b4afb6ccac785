"""Keyboard, joystick, view and options of `ghst simulate`."""

from __future__ import annotations

import io
import json
import os
import re
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner
from recordings import log_text, pack
from rich.console import Console
from terminal import terminal

from ghst_tools.cli import ghst as command
from ghst_tools.errors import GhstError
from ghst_tools.simulate import joystick
from ghst_tools.simulate.faults import Faults
from ghst_tools.simulate.keyboard import Keyboard
from ghst_tools.simulate.keys import split
from ghst_tools.simulate.msp_client import MspClient
from ghst_tools.simulate.output import Lines, Objects
from ghst_tools.simulate.send import Sent
from ghst_tools.simulate.session import Session
from ghst_tools.simulate.sticks import Pattern, at_rest
from ghst_tools.simulate.uplink import Link, StickUplink
from ghst_tools.simulate.view import LiveView

FRAME_S = 14 * 10 / 420_000


@pytest.mark.parametrize(
    ("sent", "keys"),
    [
        ("aW 5", ["a", "W", " ", "5"]),
        ("\x1b[A\x1b[B\x1bOC\x1b[D", ["up", "down", "right", "left"]),
        ("\x1b[1;5Cx", ["right", "x"]),  # with Ctrl
        ("\x1b[3~\x1b[15~q", ["q"]),  # Delete, F5
        ("\x1b", []),
        ("\x1b[", []),
    ],
)
def test_what_terminals_send(sent: str, keys: list[str]) -> None:
    assert split(sent) == keys


def test_keys_move_the_sticks() -> None:
    keyboard = Keyboard()

    def channels(*keys: str) -> list[float]:
        for key in keys:
            keyboard.press(key)
        return [pulse / 4 for pulse in keyboard.pulses(0.0)[:8]]

    assert channels() == [1500, 1500, 1000, 1500, 1000, 1000, 1000, 1000]
    assert channels("right", "up", "up", "w", "a") == [1525, 1550, 1025, 1475] + [1000] * 4
    assert channels("left", "down", "S", "D") == [1500, 1525, 1000, 1500] + [1000] * 4
    # The ends hold.
    assert channels(*["right"] * 30, *["s"] * 3, *["W"] * 50)[:3] == [2000, 1525, 2000]
    assert channels("5", "6", "6", "7", "7", "7")[4:] == [1500, 2000, 1000, 1000]
    assert channels(" ") == [1500, 1500, 2000, 1500, 1500, 2000, 1000, 1000]
    assert channels("x", "z")[2] == 1000
    keyboard.press("l")
    assert keyboard.lost and not keyboard.ended
    keyboard.press("l")
    keyboard.press("Q")
    assert not keyboard.lost and keyboard.ended


def event(value: int, kind: int, number: int) -> bytes:
    """An event of Linux's joystick interface (Documentation/input/joydev/joystick-api.rst)."""
    return struct.pack("=IhBB", 1234, value, kind, number)


@contextmanager
def device(tmp_path: Path) -> Iterator[tuple[str, int]]:
    """A pipe in the place of /dev/input/js0, and its other end."""
    path = tmp_path / "js0"
    os.mkfifo(path)
    descriptor = os.open(path, os.O_RDWR)
    try:
        yield str(path), descriptor
    finally:
        os.close(descriptor)


def test_a_joystick_on_linux(tmp_path: Path) -> None:
    with device(tmp_path) as (path, descriptor):
        made = joystick.open_joystick(path)
        assert made.pulses(0.0) == at_rest()
        # What it is at the beginning: two axes and a button.
        os.write(descriptor, event(0, 0x82, 0) + event(-32767, 0x82, 1) + event(0, 0x81, 0))
        made.poll()
        assert [pulse / 4 for pulse in made.pulses(0.0)[:4]] == [1500, 1000, 1000, 1500]
        os.write(descriptor, event(32767, 2, 0) + event(-16384, 2, 1)[:5])
        made.poll()
        os.write(descriptor, event(-16384, 2, 1)[5:] + event(1, 1, 0))
        made.poll()
        assert [pulse / 4 for pulse in made.pulses(0.0)[:4]] == [2000, 1250, 2000, 1500]
        os.write(descriptor, event(-32768, 2, 0))
        made.poll()
        assert made.pulses(0.0)[0] == 4000


def test_axes_in_another_order_and_direction(tmp_path: Path) -> None:
    with device(tmp_path) as (path, descriptor):
        made = joystick.open_joystick(path, (3, -1))
        os.write(descriptor, event(32767, 2, 0) + event(-32767, 2, 2) + event(1, 1, 1))
        made.poll()
        # Axis 3, axis 1 reversed, button 1 of which nothing was told, button 2.
        assert [pulse / 4 for pulse in made.pulses(0.0)[:5]] == [1000, 1000, 1000, 2000, 1500]


def test_joysticks_that_are_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(GhstError, match=r"js9: No such file or directory: is the joystick"):
        joystick.open_joystick(str(tmp_path / "js9"))
    with device(tmp_path) as (path, _):
        made = joystick.open_joystick(path)
    with pytest.raises(GhstError, match=r"js0: gone \(unplugged\?\)$"):
        made.poll()
    # Elsewhere than on Linux, without pygame.
    monkeypatch.setattr("sys.platform", "darwin")
    with pytest.raises(GhstError, match=r"needs pygame here: pip install 'micropython-ghst\[joy"):
        joystick.open_joystick("0")


def session(frames: int, answers: int, mode: int = 10) -> tuple[Session, StickUplink]:
    """A session of so many slots at 250 Hz, with telemetry behind every one up to `answers`."""
    link = Link(mode)
    uplink = StickUplink(Pattern("steps", 10.0), link, Faults(), 250, 16, twelve_bit=True)
    made = Session(uplink, link, 420_000, MspClient([]))
    for index in range(frames):
        due_s = index / 250
        frame = uplink.octets(index, due_s)
        end_s = due_s + FRAME_S
        reads = [(end_s, frame)]
        if index < answers:
            reads.append((end_s + 1e-3 + FRAME_S, pack(index)))
        made.add([Sent(index, due_s, due_s + 50e-6, frame)], reads, due_s + 0.003)
    return made, uplink


def test_the_view_shows_sticks_telemetry_slots_and_errors() -> None:
    console = Console(width=110, height=50, file=io.StringIO(), force_terminal=True)
    view = LiveView(console, "ghst simulate port", "keys")

    def shown(made: Session) -> str:
        with console.capture() as capture:
            console.print(view.draw(made))
        return re.sub(r"\x1b\[[0-9;]*m", "", capture.get())

    made, _ = session(1, 0)
    assert "no telemetry yet" in shown(made) and "keys" in shown(made)
    text = shown(session(1, 0, mode=7)[0])
    assert "no telemetry: PureRace has no downlink" in text
    made, uplink = session(20, 5)
    with view:
        view.show(made, [], [])
    text = shown(made)
    assert re.search(r"sending  Race250  \d+\.\d frames a second  LQ 100 %  RSSI  -60 dBm", text)
    assert "20 sent, late 50 us, at most 50 " in text
    assert re.search(r"│ 1 ·{12} 1000\.00 5 █{12} 2000\.00  9 █{9}···", text)
    assert re.search(r"│ 3 ██████······ 1500\.00", text)
    assert "0x23  pack status     slot 1000 us  15.96 V, 5.00 A, 0 mAh, armed" in text
    assert "slot: 1000 us in the median, 1000 to 1000 us, 5 measured" in text
    # Fifty bins of 50 us: all in one of the two around 1000 us.
    bars = re.search(r"0 us (.{50}) 2500 us and more", text)
    assert bars and bars[1].count("█") == 1 and bars[1].index("█") in (19, 20)
    assert "echo: 20 intact, 0 collisions, 0 damaged frames" in text
    uplink.faults.lost_by_hand = True
    assert "link lost" in shown(made)


def test_lines_once_a_second_and_at_the_end() -> None:
    lines: list[str] = []
    output = Lines(lines.append)
    made, _ = session(200, 5)
    output.show(made, [], [])
    assert lines == []  # not a second yet
    made, _ = session(255, 5)
    output.show(made, list(made.latest.values()), [])
    output.show(made, [], [])
    # 255 in 1.019 s.
    assert lines == [
        "   1.0 s  250.2 frames a second  LQ 100 %  RSSI -60 dBm  telemetry 5  echo 255",
        "          0x23  pack status     slot 1000 us  15.96 V, 5.00 A, 0 mAh, armed",
    ]
    lines.clear()
    output.finish(made)
    assert lines == [
        "",
        "sent 255 frames in 255 slots, 250.0 a second, Race250",
        "late by 50 us in the median, 99 % by 50, the latest 50 us",
        "echo: 255 came back as sent",
        "telemetry: pack status 5",
        "slot: 1000 us in the median, 1000 to 1000 us, 5 measured",
    ]


def test_objects_for_programs() -> None:
    lines: list[str] = []
    output = Objects(lines.append)
    made, _ = session(2, 1)
    output.show(made, list(made.latest.values()), [])
    output.finish(made)
    telemetry, summary = map(json.loads, lines)
    assert telemetry == {
        "event": "telemetry",
        "t": pytest.approx(FRAME_S + 1e-3, abs=1e-6),
        "addr": 0x89,
        "type": 0x23,
        "name": "pack_status",
        "slot_us": 1000.0,
        "voltage_mv": 16000,
        "current_ma": 5000,
        "consumed_mah": 0,
        "armed": True,
        "rx_voltage_mv": 0,
    }
    assert summary["event"] == "summary" and summary["sent_bursts"] == 2
    assert summary["telemetry"] == {"pack_status": 1} and summary["slot_median_us"] == 1000.0


@pytest.mark.parametrize(
    ("args", "told"),
    [
        ("--pattern sweep --keyboard", "--pattern and --keyboard: choose one"),
        ("--capture x --file y", "--file and --capture: choose one"),
        ("--capture x --mode race", "--mode: a recording has its own"),
        ("--capture x --12-bit", "--12-bit: a recording has its own"),
        ("--loop", "--loop: only with --file or --capture"),
        ("--axes 1,2", "--axes: only with --joystick"),
        ("--joystick 0 --axes 0", "'0' is not a list of axes"),
        ("--lq 101", "'101' is not 0 to 100, or FROM:TO:SECONDS"),
        ("--rssi -60:-300:5", "'-60:-300:5' is not -255 to 0"),
        ("--lose 5", "'5' is not START:SECONDS"),
        ("--set 17=1500", "'17=1500' is not CHANNEL=US"),
        ("--set 1=3000", "'1=3000' is not CHANNEL=US"),
        ("--msp no_such", "'no_such' is not an MSP command"),
        ("--vtx 5800", "'5800' is not MHZ:MW[:BAND_CHANNEL]"),
        ("--vtx 99999:25", "'99999:25' is not MHZ:MW[:BAND_CHANNEL]"),
        ("--rate 501", "501.0 is not in the range 0<x<=500"),
        ("--drop 101", "101.0 is not in the range 0<=x<=100"),
        ("--mode fast", "'fast' is not one of 'normal', 'race'"),
    ],
)
def test_options_that_cannot_be(args: str, told: str) -> None:
    result = CliRunner().invoke(command, ["simulate", "--port", "/dev/null", *args.split()])
    assert result.exit_code == 2
    assert told in " ".join(result.stderr.split()), result.stderr


def test_a_keyboard_needs_a_terminal() -> None:
    with terminal() as wire:
        result = CliRunner().invoke(command, ["simulate", "--port", wire.port, "--keyboard"])
    assert (result.exit_code, result.stderr) == (
        1,
        "ghst: --keyboard: the standard input is no terminal: run it in one\n",
    )


def test_a_wire_that_is_too_slow() -> None:
    args = ["simulate", "--port", "x", "--baud", "9600", "--mode", "race"]
    result = CliRunner().invoke(command, args)
    assert (result.exit_code, result.stderr) == (
        1,
        "ghst: 160 frames a second do not fit in 9600 baud: at most 69 do\n",
    )


def test_files_that_are_not_there(tmp_path: Path) -> None:
    for option in ("--file", "--capture"):
        missing = str(tmp_path / "none")
        result = CliRunner().invoke(command, ["simulate", "--port", "x", option, missing])
        assert (result.exit_code, result.stderr) == (
            1,
            f"ghst: {missing}: No such file or directory\n",
        )
    path = tmp_path / "flight.log"
    path.write_text(log_text(2))
    result = CliRunner().invoke(command, ["simulate", "--port", "/dev/no", "--capture", str(path)])
    assert (result.exit_code, result.stderr) == (1, "ghst: /dev/no: there is no such port\n")
