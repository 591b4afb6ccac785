"""`ghst replay`: what is sent, and when."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from paced_port import PacedPort
from recordings import FRAME_S, log_text, pack, uplink
from terminal import terminal

from ghst_tools import replay
from ghst_tools.cli import ghst
from ghst_tools.errors import GhstError
from ghst_tools.frames.formats import Source
from ghst_tools.frames.recording import load

COMMAND = [sys.executable, "-m", "ghst_tools.cli", "replay"]


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "flight.log"
    path.write_text(log_text(8))
    return path


def plan(path: Path, speed: float = 1.0, rate_hz: float | None = None) -> replay.Plan:
    return replay.plan(load(Source(path)), speed, rate_hz, 420000)


class Time(PacedPort):
    """Ctrl-C comes with the twentieth frame."""

    def write(self, data: bytes) -> None:
        super().write(data)
        if len(self.written) == 20:
            raise KeyboardInterrupt

    def flush(self) -> None:
        pass


def test_without_a_port_it_says_what_it_would_send(log: Path) -> None:
    result = CliRunner().invoke(ghst, ["replay", str(log)])
    assert (result.exit_code, result.stdout) == (
        0,
        "8 frames in 0.032 s, 250.0 a second\n"
        "        2  0x10  channels 5-8\n"
        "        3  0x11  channels 9-12\n"
        "        3  0x13  link data\n"
        "nothing sent: name a serial port with --port\n",
    )


@pytest.mark.parametrize(("speed", "step_s"), [(1.0, 0.004), (0.5, 0.008), (4.0, 0.001)])
def test_frames_are_sent_when_they_came(log: Path, speed: float, step_s: float) -> None:
    time = Time()
    sent = replay.Sent()
    replay.send(time, plan(log, speed), False, sent, time.clock, time.sleep)
    assert [data for _, data in time.written] == uplink(8)
    begins = [begin_s for begin_s, _ in time.written]
    assert begins == pytest.approx([step_s * index for index in range(8)], abs=2e-6)
    assert sent.frames == 8
    assert sent.latest_s < 1e-9


def test_a_loop_keeps_the_rhythm(log: Path) -> None:
    time = Time()
    with pytest.raises(KeyboardInterrupt):
        replay.send(time, plan(log), True, replay.Sent(), time.clock, time.sleep)
    begins = [begin_s for begin_s, _ in time.written]
    assert np.diff(begins) == pytest.approx([0.004] * 19, abs=2e-6)
    assert [data for _, data in time.written] == (uplink(8) * 3)[:20]


def test_without_times_the_rf_mode_gives_the_rate(tmp_path: Path) -> None:
    path = tmp_path / "raw"
    path.write_bytes(b"\x00" + b"".join(uplink(6)) + pack(1))
    # Race250.
    assert np.diff(plan(path).due_s) == pytest.approx([0.004] * 5)
    assert np.diff(plan(path, 2.0, 50.0).due_s) == pytest.approx([0.01] * 5)
    path.write_bytes(uplink(1)[0])
    with pytest.raises(GhstError, match=r"raw: has no times, and no link data with an RF mode: "):
        plan(path)


def test_a_wire_is_not_endlessly_fast(log: Path) -> None:
    assert plan(log, 0.999 * 0.004 / FRAME_S).duration_s > 8 * FRAME_S
    with pytest.raises(
        GhstError, match=r"8 frames take 0\.003 s at 420000 baud, they do not fit in 0\.002 s: "
    ):
        plan(log, 14.0)


def test_telemetry_alone_is_nothing_to_send(tmp_path: Path) -> None:
    path = tmp_path / "raw"
    path.write_bytes(pack(1))
    with pytest.raises(GhstError, match=r"there is no frame of the receiver in it$"):
        plan(path)
    path.write_bytes(b"\x01\x02")
    with pytest.raises(GhstError, match=r"raw: no valid frame in it, read as raw: see what "):
        plan(path)


def test_a_port_receives_them(log: Path) -> None:
    with terminal() as wire:
        running = subprocess.Popen(
            [*COMMAND, str(log), "--port", wire.port, "--speed", "0.5"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert wire.receive(8 * 14) == b"".join(uplink(8))
        out, err = running.communicate()
        assert wire.silent()
        assert (running.returncode, err) == (0, "")
        assert out.splitlines()[0] == "8 frames in 0.064 s, 125.0 a second"
        assert out.splitlines()[-1].startswith(f"sent 8 frames to {wire.port}, the latest ")


def test_a_loop_ends_with_ctrl_c_and_a_port_that_vanishes(log: Path) -> None:
    with terminal() as wire:
        running = subprocess.Popen(
            [*COMMAND, str(log), "--port", wire.port, "--loop"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        wire.receive(20 * 14)
        running.send_signal(signal.SIGINT)
        assert running.communicate()[1] == ""
        assert running.returncode == 0
    with terminal() as wire:
        running = subprocess.Popen(
            [*COMMAND, str(log), "--port", wire.port, "--loop"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        wire.receive(14)
        wire.unplug()
        err = running.communicate()[1]
        assert running.returncode == 1
        assert err == (
            f"ghst: {wire.port}: gone (unplugged?): the recording was not sent to its end\n"
        )
