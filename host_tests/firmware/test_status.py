"""The status as JSON, and what a host may do to the board that says it: stop, close, unplug."""

from __future__ import annotations

import itertools
import json
import re
from typing import Any

import pytest
from rig import NO_SENSORS, Pico

import ghst
from ghst_tools import boards
from ghst_tools.demo.aircraft import Aircraft, Devices

CHANNELS = ghst.encode.channels(0x30, (2048, 0, 4095, 1024), (0, 128, 255, 64))
LINK = ghst.encode.link_data(
    0x33, (2048, 0, 4095, 1024), lq=97, rssi_dbm=-71, rf_mode=10, tx_power_dbm=-8
)
OUTPUTS: dict[str, Any] = {
    "7": {"reverse": True, "failsafe": "hold"},
    "8": {"minimum_us": 1100, "maximum_us": 1900, "failsafe": 1500},
    "9": {"motor": True},
    "10": {"channel": 6, "kind": "switch"},
    "14": {"channel": 5, "kind": "oneshot125", "frequency_hz": 400},
}
# Times every round's step of the console, and makes the main loop stumble on request.
USER = b"""
import time
def setup(application):
    step = application.steps.pop()
    longest_us = spent_us = 0
    def timed(now_ms):
        nonlocal longest_us, spent_us
        began_us = time.ticks_us()
        step(now_ms)
        took_us = time.ticks_diff(time.ticks_us(), began_us)
        longest_us = max(longest_us, took_us)
        spent_us += took_us
    def tell(arguments):
        nonlocal longest_us, spent_us
        print("longest", longest_us, "spent", spent_us)
        longest_us = spent_us = 0
    application.steps.append(timed)
    application.console.add("longest", tell, "")
    application.console.add("fail", lambda arguments: 1 // 0, "")
"""
CONFIGURATION = NO_SENSORS | {
    "outputs": OUTPUTS,
    "arming": {"channel": 8},
    "battery": {"divider": 11.0, "current_mv_per_a": 40},
}
on_a_desk = pytest.mark.boot(CONFIGURATION, files={"/user.py": USER})
plain = pytest.mark.boot()


def frames(index: int, t_ns: float) -> bytes:
    return LINK if index % 4 == 1 else CHANNELS


def lines(text: bytes) -> list[dict[str, Any]]:
    """The lines of JSON; everything else is there whole, or an error."""
    found = []
    for line in text.decode().replace("\r", "").split("\n"):
        if "{" in line or "}" in line:
            found.append(json.loads(line))
            assert line.startswith('{"ghst":"status"') or found[-1]["ghst"] in ("ok", "error")
    return found


def said(pico: Pico, line: bytes, wait_ns: float) -> bytes:
    start = len(pico.board.console.output)
    pico.board.console.write(line + b"\r")
    pico.board.run_for(wait_ns)
    return bytes(pico.board.console.output[start:])


def stop_reading_in_a_line(pico: Pico) -> int:
    """Have the host read the first piece of a line and no more; returns where the line begins."""
    console = pico.board.console
    start = len(console.output)
    pico.board.run_until(lambda: b'{"ghst"' in console.output[start:])
    start += console.output[start:].index(b'{"ghst"')
    console.reading = False
    pico.board.run_for(100e6)
    assert 0 < len(console.output) - start < 600
    assert not console.output.endswith(b"\n")
    return start


@on_a_desk
def test_one_line_has_everything(pico: Pico) -> None:
    pico.board.adc(0).set_volts(16.8 / 11)
    pico.board.adc(1).set_volts(10 * 0.040)
    receiver = pico.fly(frames, 250)
    said(pico, b"fail", 700e6)
    text = said(pico, b"status", 400e6)
    receiver.stop()
    (line,) = lines(text)
    battery = line.pop("battery")
    assert battery == {
        "voltage_mv": pytest.approx(16800, abs=20),
        "current_ma": pytest.approx(10000, abs=50),
        "consumed_mah": battery["consumed_mah"],
        "cell_count": None,
        "low": False,
        "critical": False,
        "faults": 0,
    }
    assert line.pop("channels_us") == [
        *(1500.0, 988.0, 2011.75, 1244.0),
        *(988.0, 1500.0, 2008.0, 1244.0),
        *[None] * 8,
    ]
    # What the meters at the pins see, too: GP7 turned, GP8 shorter, GP9 not armed.
    assert line.pop("outputs_us") == {
        "6": 1500.0,
        "7": 2011.88,
        "8": 1899.69,
        "9": 988.13,
        "10": 0.0,
        "11": 1500.0,
        "12": 2008.13,
        "13": 1244.06,
        "14": 123.5,
    }
    counters = {name: line.pop(name) for name in ("time_ms", "frames", "telemetry_frames")}
    assert 0 < counters["telemetry_frames"] < counters["frames"] <= len(receiver.sent)
    assert 0 < line.pop("main_loop_cycle_time_us") < 200_000
    assert line == {
        "ghst": "status",
        "link": "linked",
        "lq": 97,
        "rssi_dbm": -71,
        "rf_mode": 10,
        "telemetry_requested": False,
        "tx_power_dbm": -8,
        "crc_errors": 0,
        "length_errors": 0,
        "skipped_bytes": 0,
        "unknown_frames": 0,
        "foreign_frames": 0,
        "msp_frames": 0,
        "msp_lost": 0,
        "failsafes": 0,
        "collisions": 0,
        "armed": False,
        "telemetry_expired": 0,
        "msp_answered": 0,
        "msp_errors": 0,
        "main_loop_stuck": 0,
        "main_loop_faults": 1,
        "weak_frames": 0,
    }
    pico.board.run_for(600e6)
    (line,) = lines(said(pico, b"status", 400e6))
    assert (line["link"], line["failsafes"], line["channels_us"]) == ("failsafe", 1, [None] * 16)
    pulses = line["outputs_us"]
    assert [pulses[pin] for pin in ("6", "7", "8", "9", "14")] == [0.0, 2011.88, 1500.0, 988.13, 0]


def steps(pico: Pico, wait_ns: float, what: bytes = b"longest") -> int:
    """The longest of the console's steps in us since it was asked last, or all that were spent."""
    found = re.search(what + rb" (\d+)", said(pico, b"longest", wait_ns))
    assert found
    return int(found[1])


@on_a_desk
def test_no_step_takes_long(pico: Pico) -> None:
    pico.fly(frames, 250)
    said(pico, b"status 200", 400e6)
    steps(pico, 190e6)
    pico.board.run_for(800e6)
    assert steps(pico, 190e6) < 5000


@plain
def test_the_stream_costs_less_than_two_hundredths_of_the_cpu(pico: Pico) -> None:
    board = pico.board
    pico.fly(frames, 250)
    board.run_for(200e6)
    cycles = board.cycles
    board.run_for(1.2e9)
    without = board.cycles - cycles
    said(pico, b"status 200", 500e6)
    cycles, start = board.cycles, len(board.console.output)
    board.run_for(1.2e9)
    with_it = board.cycles - cycles
    # Whole lines: the first and the last may have been under way.
    _, _, text = bytes(board.console.output[start:]).partition(b"\n")
    found = lines(text.rpartition(b"\n")[0])
    apart_ms = [b["time_ms"] - a["time_ms"] for a, b in itertools.pairwise(found)]
    assert apart_ms == pytest.approx([200] * len(apart_ms), abs=5)
    assert len(apart_ms) >= 3
    assert (with_it - without) / (1.2 * 125e6) < 0.02
    assert said(pico, b"status off", 300e6).endswith(b'{"ghst": "ok"}\r\n')
    assert b"ghst" not in said(pico, b"", 500e6).replace(b"micropython-ghst", b"")


@pytest.mark.boot({}, files={"/user.py": USER})
def test_the_stream_costs_less_than_that_with_all_sensors(pico: Pico) -> None:
    """By the time in the console's steps: the sensors' own work varies by more than they take."""
    board = pico.board
    Devices(board, Aircraft(), json.loads(boards.load("rpi_pico").definition)["defaults"])
    pico.fly(frames, 250)
    board.run_for(1.5e9)
    steps(pico, 100e6)
    board.run_for(0.9e9)
    without_us = steps(pico, 100e6, b"spent")
    text = said(pico, b"status 200", 500e6)
    (first, *_) = lines(text.rpartition(b"\n")[0])
    assert {"battery", "gps", "barometer", "magnetometer"} <= set(first)
    steps(pico, 100e6)
    board.run_for(0.9e9)
    with_us = steps(pico, 100e6, b"spent")
    # Each second: while a line is under way nobody looks for what is typed, which costs as much.
    assert without_us > 10_000
    assert with_us < without_us + 20_000


@plain
def test_what_is_no_interval(pico: Pico) -> None:
    error = {
        "ghst": "error",
        "text": "status takes an interval of 50 to 60000 ms, or off, or nothing",
    }
    for arguments in (b"49", b"60001", b"-100", b"1e2", b"on"):
        assert lines(said(pico, b"status " + arguments, 150e6)) == [error]
    assert lines(said(pico, b"status off", 150e6)) == [{"ghst": "ok"}]


@plain
def test_a_host_that_stops_in_the_middle_of_a_line(pico: Pico) -> None:
    console = pico.board.console
    receiver = pico.fly(frames, 250)
    said(pico, b"status 100", 300e6)
    start = stop_reading_in_a_line(pico)
    # The link is lost: the Reporter has something to say, too.
    receiver.stop()
    pico.board.run_for(3e9)
    console.reading = True
    pico.board.run_for(200e6)
    found = lines(bytes(console.output[start:]))
    # The line from then, and no other: nobody has read for more than two seconds.
    assert [line["failsafes"] for line in found] == [0]
    assert b"\nlink: failsafe" in console.output[start:]
    (line,) = lines(said(pico, b"status", 300e6))
    assert (line["main_loop_stuck"], line["main_loop_faults"], line["failsafes"]) == (0, 0, 1)


@plain
def test_a_pause_shorter_than_two_seconds_ends_nothing(pico: Pico) -> None:
    console = pico.board.console
    said(pico, b"status 100", 300e6)
    start = stop_reading_in_a_line(pico)
    pico.board.run_for(1.5e9)
    console.reading = True
    pico.board.run_for(1e9)
    found = lines(bytes(console.output[start:]).rpartition(b"\n")[0])
    assert len(found) >= 9
    assert max(line["main_loop_cycle_time_us"] for line in found) < 20_000


@plain
def test_a_port_that_is_closed_in_the_middle_of_a_line(pico: Pico) -> None:
    console = pico.board.console
    said(pico, b"status 100", 300e6)
    # A closed port is not read any more.
    start = stop_reading_in_a_line(pico)
    console.close()
    pico.board.run_for(3e9)
    console.open()
    console.reading = True
    pico.board.run_for(300e6)
    assert len(lines(bytes(console.output[start:]))) == 1
    (line,) = lines(said(pico, b"status", 300e6))
    assert (line["main_loop_stuck"], line["main_loop_faults"]) == (0, 0)


@pytest.mark.parametrize("reporting", [False, True])
@plain
def test_usb_unplugged_while_the_port_is_open(pico: Pico, reporting: bool) -> None:
    """MicroPython's print never ends then, once 256 bytes wait (micropython issue 16713)."""
    console = pico.board.console
    receiver = pico.fly(frames, 250)
    pico.board.run_for(100e6)
    if not reporting:
        said(pico, b"status 50", 200e6)
    console.unplug()
    for _ in range(6):
        receiver.stop()
        pico.board.run_for(700e6)
        receiver = pico.fly(frames, 250)
        pico.board.run_for(100e6)
    start = len(console.output)
    console.plug_in()
    pico.board.run_until(lambda: console.connected)
    pico.board.run_for(200e6)
    # What is left of a line is no line; its rest may come before the next one only.
    said(pico, b"status", 300e6)
    text = bytes(console.output[start:])
    (line,) = lines(text[text.index(b'{"ghst":"status"') :])
    assert (line["main_loop_stuck"], line["main_loop_faults"], line["failsafes"]) == (0, 0, 6)
    assert not pico.board.resets


@plain
def test_a_port_that_nobody_ever_opened(pico: Pico) -> None:
    console = pico.board.console
    # The stream was begun by somebody; for the board this is a new host.
    said(pico, b"status 60000", 300e6)
    console.unplug()
    pico.board.run_for(10e6)
    console.plug_in(opens=False)
    console.reading = False
    pico.board.run_for(200e6)
    assert console.enumerated and not console.connected
    for _ in range(6):
        receiver = pico.fly(frames, 250)
        pico.board.run_for(100e6)
        receiver.stop()
        pico.board.run_for(700e6)
    start = len(console.output)
    console.open()
    console.reading = True
    pico.board.run_for(100e6)
    # What was said first while nobody listened, and how it stands now.
    text = console.output[start:].decode()
    assert re.findall("^link: [a-z]+", text, re.MULTILINE) == ["link: linked", "link: failsafe"]
    assert text.count("\n") == 2
    (line,) = lines(said(pico, b"status", 300e6))
    assert (line["main_loop_stuck"], line["main_loop_faults"], line["failsafes"]) == (0, 0, 6)
