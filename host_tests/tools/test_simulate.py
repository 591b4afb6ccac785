"""`ghst simulate` on a pseudo-terminal, with a flight controller made of the library behind it."""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
import termios
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from select import select
from typing import Any

import pytest
from click.testing import CliRunner
from recordings import log_text, uplink
from served_board import ServedBoard
from terminal import PATIENCE_S, Terminal, terminal

import ghst
from ghst_tools.cli import ghst as command
from ghst_tools.simulate.faults import Faults, Loss, Ramp
from ghst_tools.simulate.sticks import Pattern
from ghst_tools.simulate.uplink import Link, StickUplink
from ghst_tools.tool_docs.flight_controller import FlightController

COMMAND = [sys.executable, "-m", "ghst_tools.cli", "simulate"]
TELEMETRY = [
    {
        "name": "pack_status",
        "voltage_mv": 16210,
        "current_ma": 12340,
        "consumed_mah": 560,
        "armed": True,
    },
    {"name": "gps_primary", "lat_e7": 473002299, "lon_e7": 85008856, "alt_m": 422},
    {"name": "gps_secondary", "speed_cm_s": 1234, "course_decideg": 2705, "home_dist_m": 120},
    {"name": "mag_baro", "heading_decideg": 478, "alt_m": 9, "vario_cm_s": -50},
]


class Partner(threading.Thread):
    """A flight controller at the other end: one wire if `echo`; damages every `damage`-th echo."""

    def __init__(self, wire: Terminal, echo: bool = True, damage: int = 0) -> None:
        super().__init__(daemon=True)
        self.flight_controller = FlightController()
        self.bursts: list[bytes] = []
        self.damaged = 0
        self._wire = wire
        self._echo = echo
        self._damage = damage
        self._stopping = threading.Event()

    def run(self) -> None:
        while not self._stopping.is_set():
            if not select([self._wire.descriptor], [], [], 0.05)[0]:
                continue
            # Written at once, and so read at once.
            burst = os.read(self._wire.descriptor, 4096)
            self.bursts.append(burst)
            back = bytearray(burst)
            if self._damage and len(self.bursts) % self._damage == 0:
                back[5] ^= 0x10
                self.damaged += 1
            if self._echo:
                self._wire.send(bytes(back))
            if answer := self.flight_controller.hear(burst):
                self._wire.send(answer)

    def stop(self) -> None:
        self._stopping.set()
        self.join()


@contextmanager
def partner(echo: bool = True, damage: int = 0) -> Iterator[tuple[Terminal, Partner]]:
    with terminal() as wire:
        made = Partner(wire, echo, damage)
        made.start()
        try:
            yield wire, made
        finally:
            made.stop()


def simulate(wire: Terminal, *args: str) -> tuple[list[dict[str, Any]], str, int]:
    """The objects that it prints, what it complains about, its exit status."""
    done = subprocess.run(
        [*COMMAND, "--port", wire.port, "--json", *args], capture_output=True, text=True
    )
    return [json.loads(line) for line in done.stdout.splitlines()], done.stderr, done.returncode


def said(objects: list[dict[str, Any]], event: str) -> list[dict[str, Any]]:
    return [entry for entry in objects if entry["event"] == event]


def recorded(path: Path) -> bytes:
    """The bytes in a log."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    return b"".join(bytes.fromhex(line.split()[1]) for line in lines)


def test_what_is_on_the_wire_is_what_the_options_say() -> None:
    """Slots that a busy computer left out are missing; all others are there to the bit."""
    options = "--mode race --12-bit --pattern random --period 1 --channels 16 --seed 5 --power -8"
    faults = "--lose 0.4:0.2 --drop 5 --bad-crc 5 --noise 5 --lq 100:50:0.5 --rssi -70"
    with partner() as (wire, other):
        objects, err, status = simulate(wire, *f"{options} {faults} --duration 1".split())
    assert (err, status) == ("", 0)
    summary = objects[-1]
    assert summary["event"] == "summary" and summary["slots"] + summary["slots_skipped"] <= 160
    made = StickUplink(
        Pattern("random", 1.0, 5),
        Link(6, Ramp(100, 50, 0.5), Ramp(-70, -70, 0), -8),
        Faults((Loss(0.4, 0.2),), 5, 5, 5, 5),
        channels=16,
        twelve_bit=True,
        duration_s=1.0,
    )
    sent = b"".join(other.bursts)
    place = 0
    for number in range(160):
        burst = made.octets(number, number / 160)
        if burst and sent.startswith(burst, place):
            place += len(burst)
    assert place == len(sent) == summary["sent_bytes"] > 500
    # An echo is an echo, with a wrong CRC, too.
    assert (summary["echo"], summary["echo_broken"]) == (True, 0)
    assert summary["echo_intact"] == summary["sent_bursts"]


def test_telemetry_answers_and_video_settings_on_one_wire(tmp_path: Path) -> None:
    path = tmp_path / "flight.log"
    orders = "--msp api-version --msp 160 --vtx 5800:25:0x48 --vtx-to goggles"
    with partner() as (wire, other):
        objects, err, status = simulate(
            wire, *f"--mode race {orders} --duration 1.6 --log {path}".split()
        )
    assert (err, status) == (f"log: {path}\n", 0)
    (summary,) = said(objects, "summary")
    receiver = other.flight_controller.receiver
    assert receiver.msp_frames >= 2 and receiver.vtx_setups == 1
    assert (receiver.vtx_freq_mhz, receiver.vtx_power_mw) == (5800, 25)
    assert receiver.vtx_band_channel == 0x48
    assert (receiver.rf_mode, receiver.lq, receiver.rssi_dbm) == (6, 100, -60)
    assert (summary["echo_intact"], summary["echo_broken"]) == (summary["sent_bursts"], 0)
    assert summary["telemetry_damaged"] == summary["garbage_bytes"] == 0
    telemetry = said(objects, "telemetry")
    assert sum(summary["telemetry"].values()) == len(telemetry)
    for fields in TELEMETRY:
        same = [entry for entry in telemetry if entry["name"] == fields["name"]]
        assert len(same) >= 3
        assert all(entry | fields == entry for entry in same)
    assert [(entry["msp_command_name"], entry["msp_data"]) for entry in said(objects, "msp")] == [
        ("api_version", "00012c"),
        ("uid", "00" * 12),
    ]
    sent = b"".join(other.bursts)
    assert len(recorded(path)) == len(sent) + 14 * len(telemetry)
    decoded = CliRunner().invoke(command, ["decode", str(path)])
    assert decoded.exit_code == 0 and "down  0x23  pack status" in decoded.stdout
    assert (
        "up    0x20  VTX setup               CRC ok   to 0x83: 5800 MHz, 25 mW" in decoded.stdout
    )


def test_collisions_are_counted() -> None:
    with partner(damage=10) as (wire, other):
        objects, _, status = simulate(wire, *["--mode", "race250", "--duration", "0.5"])
    (summary,) = said(objects, "summary")
    assert status == 0 and other.damaged >= 2
    assert summary["echo_broken"] == other.damaged
    assert summary["echo_intact"] == summary["sent_bursts"] - other.damaged


def test_separate_wires_and_no_downlink(tmp_path: Path) -> None:
    path = tmp_path / "flight.log"
    args = f"--mode race500 --duration 1 --log {path}".split()
    with partner(echo=False) as (wire, other):
        done = subprocess.run(
            [*COMMAND, "--port", wire.port, *args], capture_output=True, text=True
        )
    assert done.returncode == 0 and done.stderr == ""
    lines = done.stdout.splitlines()
    assert lines[-3:] == [
        "echo: none (separate wires, or the adapter's RX is not on the wire)",
        "telemetry: none (Race500 has no downlink)",
        f"log: {path}",
    ]
    assert other.flight_controller.receiver.rf_mode == 11
    sent = sum(map(len, other.bursts)) // 14
    assert re.match(rf"sent {sent} frames in {sent} slots, [\d.]+ a second, Race500$", lines[-5])
    # The log has what was sent, in its order.
    assert recorded(path) == b"".join(other.bursts)


def test_the_telemetry_bit_asks_for_what_the_mode_has_not() -> None:
    with partner(echo=False) as (wire, _):
        objects, _, status = simulate(
            wire, *["--mode", "solid150", "--request-telemetry", "--duration", "0.6"]
        )
    (summary,) = said(objects, "summary")
    assert status == 0 and summary["echo"] is False
    assert sum(summary["telemetry"].values()) >= 5


def test_a_recording_is_sent_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "flight.log"
    path.write_text(log_text(8))
    with partner() as (wire, other):
        objects, _, status = simulate(wire, "--capture", str(path), "--rate", "20")
    assert status == 0 and other.bursts == uplink(8)
    assert said(objects, "summary")[0]["echo_intact"] == 8


def test_the_wire_of_an_emulated_board_waits_for_its_echo(micropython_image: Path) -> None:
    board = ServedBoard(micropython_image, wire=True)
    options = "--mode race --duration 2 --drop 20 --json"
    done = subprocess.run(
        [*COMMAND, "--port", board.wire_address, *options.split()], capture_output=True, text=True
    )
    assert board.stop() == 0
    assert (done.returncode, done.stderr) == (0, "")
    summary = json.loads(done.stdout.splitlines()[-1])
    # Each came back before the next one left: a slow board loses none.
    assert summary["echo_intact"] == summary["sent_bursts"] >= 3
    assert summary["echo_broken"] == summary["garbage_bytes"] == 0
    assert summary["slots"] + summary["slots_skipped"] <= 320


def test_a_question_without_an_answer_is_an_error() -> None:
    with terminal() as wire:
        objects, err, status = simulate(wire, *["--duration", "0.4", "--msp", "api_version"])
        assert (err, status) == ("ghst: no answer to MSP 1 api_version\n", 1)
        assert said(objects, "summary")[0]["echo"] in (None, False)


def start(wire: Terminal, *args: str) -> subprocess.Popen[str]:
    """Run it without end; it has sent when this returns."""
    running = subprocess.Popen(
        [*COMMAND, "--port", wire.port, *args],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    wire.receive(14 * 3)
    return running


@pytest.mark.parametrize(
    ("args", "status", "err"),
    [((), 0, ""), (("--duration", "60"), 130, "ghst: stopped\n")],
)
def test_ctrl_c(args: tuple[str, ...], status: int, err: str) -> None:
    with terminal() as wire:
        running = start(wire, *args)
        running.send_signal(signal.SIGINT)
        out, told = running.communicate()
        assert (running.returncode, told) == (status, err)
        assert re.search(r"^sent \d+ frames in \d+ slots, ", out, re.MULTILINE)


def test_an_adapter_that_is_unplugged() -> None:
    with terminal() as wire:
        running = start(wire, "--mode", "race250")
        wire.unplug()
        out, err = running.communicate()
        assert running.returncode == 1
        assert re.fullmatch(rf"ghst: {wire.port}: gone \(unplugged\?\): sent for \d+\.\d s\n", err)
        assert re.search(r"^sent \d+ frames in \d+ slots, ", out, re.MULTILINE)


class Shell:
    """A command in a terminal of its own, with a keyboard."""

    def __init__(self, *args: str) -> None:
        self.master, slave = pty.openpty()
        termios.tcsetwinsize(slave, (50, 120))
        self.slave = slave
        self.before = termios.tcgetattr(slave)
        self.shown = b""
        self.process = subprocess.Popen(
            args,
            stdin=slave,
            stdout=slave,
            stderr=slave,
            start_new_session=True,
            env={**os.environ, "TERM": "xterm-256color"},
        )

    def look(self) -> None:
        """Take what is shown."""
        if select([self.master], [], [], 0.02)[0]:
            self.shown += os.read(self.master, 65536)

    def until(self, text: bytes) -> None:
        """Wait for this on the screen."""
        while text not in self.shown:
            assert select([self.master], [], [], PATIENCE_S)[0], self.shown[-2000:]
            self.shown += os.read(self.master, 65536)

    def end(self) -> int:
        """Wait for the end; whatever is shown until then is read."""
        while self.process.poll() is None:
            self.look()
        while select([self.master], [], [], 0)[0]:
            self.shown += os.read(self.master, 65536)
        return self.process.returncode

    @property
    def restored(self) -> bool:
        """Whether the terminal is as it was, and its cursor can be seen."""
        seen = self.shown.rfind(b"\x1b[?25h") >= self.shown.rfind(b"\x1b[?25l")
        return seen and termios.tcgetattr(self.slave) == self.before

    def close(self) -> None:
        os.close(self.master)
        os.close(self.slave)


def channels(bursts: list[bytes]) -> list[float]:
    receiver = ghst.Receiver()
    receiver.feed(b"".join(bursts[-3:]))
    return [pulse / 4 for pulse in receiver.pulses[:5]]


def test_keys_in_a_real_terminal() -> None:
    with partner() as (wire, other):
        shell = Shell(*COMMAND, "--port", wire.port, "--keyboard", "--mode", "race", "--12-bit")
        try:
            shell.until(b"arrows: channels 1, 2")
            os.write(shell.master, b"\x1b[C\x1b[C\x1b[Aww")
            wanted = [1550, 1525, 1050, 1500, 1000]
            while channels(other.bursts) != wanted:
                assert shell.process.poll() is None
                shell.look()
            os.write(shell.master, b"l")
            shell.until(b"link lost")
            os.write(shell.master, b"lq")
            assert shell.end() == 0
            assert shell.restored
            assert b"came back as sent" in shell.shown
        finally:
            shell.close()


@pytest.mark.parametrize("end", ["unplugged", signal.SIGTERM, signal.SIGINT])
def test_the_terminal_is_restored_whatever_happens(end: str | signal.Signals) -> None:
    with terminal() as wire:
        shell = Shell(*COMMAND, "--port", wire.port, "--keyboard")
        try:
            shell.until(b"arrows: channels 1, 2")
            assert not shell.restored
            if isinstance(end, str):
                wire.unplug()
            else:
                shell.process.send_signal(end)
            assert shell.end() == (1 if end == "unplugged" else 0)
            assert shell.restored
            assert b"sent " in shell.shown
        finally:
            shell.close()
