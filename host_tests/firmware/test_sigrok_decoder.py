"""The sigrok decoder on what the emulated wire carries between a receiver and the firmware."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from rig import Pico

import ghst
from ghst_tools import boards
from ghst_tools.emulator import VcdRecorder

COUNT = 12
DAMAGED = 7
SETUP = """
from ghst import telemetry
frame = bytearray(14)
number = 0
def refill():
    global number
    if adapter.control.slot_free:
        telemetry.pack_status(frame, 16000 + number * 10, 0, 0, True)
        number += 1
        adapter.control.send(frame)
"""


@pytest.mark.skipif(shutil.which("sigrok-cli") is None, reason="sigrok-cli is not installed")
def test_frames_telemetry_and_slots_of_the_emulated_wire(pico: Pico, tmp_path: Path) -> None:
    pico.run("adapter.poll(); refill()", setup=SETUP)
    recorder = VcdRecorder(pico.board, {}, pico.wire)

    def frames(index: int, t_ns: float) -> bytes | None:
        raw = (1984 + 100 * index, 1984, 1984 - 100 * index, 1984)
        frame = bytearray(ghst.encode.link_data(0x13, raw, lq=90 + index % 10, rf_mode=10))
        if index == DAMAGED:
            frame[5] ^= 0x10
        return bytes(frame) if index < COUNT else None

    receiver = pico.fly(frames, 250)
    pico.board.run_for((COUNT + 2) * 4e6)
    vcd = tmp_path / "wire.vcd"
    recorder.write(vcd)

    made = ["make", "-s", "-C", str(boards.checkout()), "sigrok"]
    environment = {**os.environ, "XDG_DATA_HOME": str(tmp_path)}
    subprocess.run(made, env=environment, check=True, stdout=subprocess.DEVNULL)

    def decoded(classes: str) -> list[str]:
        decoder = ("-P", "uart:rx=wire:baudrate=420000,ghst", "-A", f"ghst={classes}")
        command = ["sigrok-cli", "-I", "vcd", "-i", str(vcd), *decoder]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        return [line.removeprefix("ghst-1: ") for line in done.stdout.splitlines()]

    heard = [index for index in range(COUNT) if index != DAMAGED]
    wanted_us = [
        pulse / 4
        for index in heard
        for pulse in (6000 + 125 * index, 6000, 6000 - 125 * index, 6000)
    ]
    assert decoded("channel") == [
        f"ch{number % 4 + 1} {us:.2f} us" for number, us in enumerate(wanted_us)
    ]
    sent = [frame.frame for frame in receiver.downlink]
    assert len(sent) == len(heard)
    assert [line for line in decoded("field") if line.endswith(" V")][::2] == [
        f"{ghst.downlink.decode(frame).voltage_mv / 1000:.2f} V" for frame in sent
    ]
    slots_us = [float(line.split()[1]) for line in decoded("slot")]
    measured_us = [frame.after_ns / 1e3 for frame in receiver.downlink if frame.after_ns]
    # Edges are rounded to 100 ns, and to half a sample of each bit.
    assert slots_us == pytest.approx(measured_us, abs=0.3)
    assert min(slots_us) > 999.0 and max(slots_us) < 1001.0
    (error,) = decoded("crc-error")
    assert error.startswith("CRC error: 0x")
    assert decoded("garbage") == []
    assert decoded("downlink") == ["flight controller to receiver"] * len(heard)
    assert decoded("uplink") == ["receiver to flight controller"] * COUNT
