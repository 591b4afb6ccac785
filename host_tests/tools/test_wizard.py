"""`ghst config wizard` on a terminal: what it asks, and the file that comes of it."""

from __future__ import annotations

import json
import os
import pty
import subprocess
import sys
from pathlib import Path
from select import select

import pytest
from click.testing import CliRunner

from ghst_tools import boards
from ghst_tools.cli import ghst

PATIENCE_S = 60.0
CTRL_C = "\x03"

# The end of each question, and the answer; an empty one is what stands in brackets.
WING = [
    ("Which board?", "rpi_pico"),
    ("name (a text of at most 16 ASCII characters): ", "A name that is too long"),
    ("name (a text of at most 16 ASCII characters): ", "Wing"),
    ("What is it?", "wing"),
    ("a battery whose voltage is measured?", "y"),
    ("battery.divider (1..1000) [11.0]: ", "5.7"),
    ("battery.cells (0..16) [0]: ", "3"),
    ("battery.capacity_mah (0..65535 mAh) [0]: ", ""),
    ("a current sensor?", "n"),
    ("a GPS?", "n"),
    ("a barometer?", "n"),
    ("a magnetometer?", "y"),
    ("magnetometer.rotation_deg (0..359 degrees) [0]: ", "90"),
    ("magnetometer.upside_down [y/N]: ", "y"),
    ("magnetometer.declination_deg (-180..180 degrees) [0]: ", ""),
    ("be armed with a switch?", ""),
    ("arming.channel (1..16 or null) [5]: ", "3"),
    ("arming.channel (1..16 or null) [5]: ", ""),
    ("arming.throttle_channel (1..16) [3]: ", ""),
    # A pin that is the compass's, and then one that can.
    ("GPIO [6]: ", "4"),
    ("GPIO [6]: ", ""),
    ("outputs.6.channel (1..16 or null) [1]: ", "17"),
    ("outputs.6.channel (1..16 or null) [1]: ", ""),
    ("outputs.6.kind (", ""),
    ("outputs.6.reverse [y/N]: ", "y"),
    ("outputs.6.failsafe (", "1500"),
    ("GPIO [7]: ", "6"),
    ("GPIO [7]: ", ""),
    ("outputs.7.channel (1..16 or null) [2]: ", ""),
    ("outputs.7.kind (", "servo_760"),
    ("outputs.7.reverse [y/N]: ", ""),
    ("outputs.7.failsafe (", "hold"),
    ("GPIO [8]: ", ""),
    ("outputs.8.channel (1..16 or null) [3]: ", ""),
    ("One more output?", "y"),
    ("GPIO [9]: ", "14"),
    ("outputs.14.name (", "lights"),
    ("outputs.14.channel (1..16 or null) [4]: ", "9"),
    ("outputs.14.kind (", "switch"),
    ("outputs.14.reverse [y/N]: ", ""),
    ("outputs.14.failsafe (", "off"),
    ("One more output?", ""),
    ("failsafe.time_ms (110..10000 ms) [500]: ", "300"),
    ("Write this to ghst.json?", ""),
    ("Push it to a board on USB now?", ""),
]


def talk(folder: Path, dialogue: list[tuple[str, str]]) -> tuple[int, str]:
    """Answer questions on a terminal; returns the exit status and what was on the screen."""
    ours, theirs = pty.openpty()
    environment = {**os.environ, "GHST_STATE": str(folder / "state")}
    process = subprocess.Popen(
        [sys.executable, "-m", "ghst_tools.cli", "config", "wizard"],
        cwd=folder,
        env=environment,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        start_new_session=True,
        # Ctrl-C means something only on a terminal of one's own.
        preexec_fn=lambda: os.close(os.open(os.ttyname(0), os.O_RDWR)),
    )
    os.close(theirs)
    screen = ""
    try:
        for question, answer in dialogue:
            start = len(screen)
            while not (question in screen[start:] and screen.endswith(": ")):
                assert select([ours], [], [], PATIENCE_S)[0], screen
                screen += os.read(ours, 4096).decode().replace("\r\n", "\n")
            os.write(ours, (answer if answer == CTRL_C else answer + "\n").encode())
        while select([ours], [], [], PATIENCE_S)[0]:
            try:
                screen += os.read(ours, 4096).decode().replace("\r\n", "\n")
            except OSError:
                break  # the other end is closed
    finally:
        os.close(ours)
        status = process.wait(PATIENCE_S)
    return status, screen


def check(path: Path) -> str:
    return CliRunner().invoke(ghst, ["config", "check", str(path)]).output


def test_a_wing_step_by_step(tmp_path: Path) -> None:
    status, screen = talk(tmp_path, WING)
    assert status == 0
    for line in (
        '  name is "A name that is too long", must be a text of at most 16 ASCII characters',
        "  arming.channel is the throttle's channel as well",
        "  i2c.sda_pin: GPIO 4 is taken by outputs.4",
        "  outputs.6.channel is 17, must be 1..16 or null",
        "  GPIO 6 is taken by another output",
    ):
        assert f"\n{line}\n" in screen, line
    file = tmp_path / "ghst.json"
    assert check(file) == f"{file}: rpi_pico takes it\n"
    assert json.loads(file.read_text()) == {
        "name": "Wing",
        "battery": {"divider": 5.7, "cells": 3, "current_pin": None},
        "gps": {"enabled": False},
        "barometer": {"enabled": False},
        "magnetometer": {"rotation_deg": 90, "upside_down": True},
        "arming": {"channel": 5},
        "outputs": {
            "6": {"channel": 1, "name": "left elevon", "reverse": True, "failsafe": 1500},
            "7": {
                "channel": 2,
                "name": "right elevon",
                "kind": "servo_760",
                "failsafe": "hold",
            },
            "8": {"channel": 3, "name": "motor", "motor": True},
            **{str(pin): {"kind": "unused"} for pin in range(9, 14)},
            "14": {"channel": 9, "name": "lights", "kind": "switch", "failsafe": "off"},
        },
        "failsafe": {"time_ms": 300},
    }


def test_a_file_that_is_there_is_left_alone(tmp_path: Path) -> None:
    file = tmp_path / "ghst.json"
    file.write_text("mine")
    question = "ghst.json is there: replace it?"
    status, screen = talk(tmp_path, [(question, "")])
    assert status == 1
    assert screen.endswith("ghst: ghst.json is left as it is: say another name\n")
    # Nor is it touched by one who leaves on the way.
    status, screen = talk(tmp_path, [(question, "y"), ("Which board?", ""), ("name (", CTRL_C)])
    assert status != 0
    assert file.read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["ghst.json"]


@pytest.mark.parametrize("name", boards.names())
def test_enter_alone_makes_a_file_for_every_board(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    command = ["config", "wizard", "--board", name]
    result = CliRunner().invoke(ghst, command, input="\n" * 60)
    assert result.exit_code == 0, result.output
    checked = CliRunner().invoke(ghst, ["config", "check", "ghst.json", "--board", name])
    assert checked.output == f"ghst.json: {name} takes it\n"
    assert json.loads(Path("ghst.json").read_text())["arming"] == {"channel": 5}


def test_goggles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    answers = ["Goggles", "goggles", "null", "10", "11", "11", "12", "", "n"]
    command = ["config", "wizard", "--board", "rpi_pico"]
    result = CliRunner().invoke(ghst, command, input="\n".join(answers) + "\n")
    assert result.exit_code == 0, result.output
    assert "rx5808.select_pin: GPIO 11 is taken by rx5808.data_pin\n" in result.output
    assert json.loads(Path("ghst.json").read_text()) == {
        "name": "Goggles",
        "role": "goggles",
        "rx5808": {"clock_pin": 10, "data_pin": 11, "select_pin": 12},
    }
