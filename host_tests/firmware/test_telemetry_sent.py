"""What the whole firmware sends: sensors, MSP, and what it tells of video settings."""

from __future__ import annotations

import json
import random
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from rig import NO_SENSORS, Pico

import ghst
from forked import forked
from ghst_tools import boards
from ghst_tools import filesystem as littlefs
from ghst_tools.emulator import GhostReceiver
from ghst_tools.emulator.gps import NmeaGps
from ghst_tools.emulator.gps_messages import Place

LINK = ghst.encode.link_data(0x13, (1984,) * 4, rf_mode=6)
RACE_HZ = 160
PIO1_CTRL = 0x50300000
STICKS = ghst.encode.channels(0x30, (48, 4048, 1048, 3048), (3, 253, 64, 192))
USER = b"""
def setup(application):
    def answer(request, reply):
        reply.u16(request.u16(0) + 1)
    application.responder.command(0x3000, answer)
    def on_vtx(kind, application):
        if kind == 0x20:
            print("set-up", application.receiver.vtx_freq_mhz)
        elif kind == 0x14:
            print("control", application.receiver.vtx_control.hex())
        else:
            print("MSP", application.state.vtx_band, application.state.vtx_channel)
    application.on_vtx = on_vtx
"""


def power_on(image: Path, files: dict[str, bytes], changes: dict[str, Any]) -> Pico:
    """A Pico with the firmware running, sensors and all as `changes` say."""
    pico = Pico(image, files, boards.load("rpi_pico").filesystem_size)
    pico.boot(NO_SENSORS | changes, files={"/user.py": USER})
    return pico


@pytest.fixture(scope="module")
def equipped(micropython_image: Path, firmware_files: dict[str, bytes]) -> Pico:
    """A Pico with a battery and places for an absent GPS and barometer; for forked tests."""
    sensors = {"battery": {"divider": 11.0, "current_mv_per_a": 40}, "gps": {}, "barometer": {}}
    pico = power_on(micropython_image, firmware_files, sensors)
    pico.board.adc(0).set_volts(16.8 / 11)
    pico.board.adc(1).set_volts(10 * 0.040)
    pico.board.run_for(600e6)  # the smoothed values are there
    return pico


@pytest.fixture(scope="module")
def bare(micropython_image: Path, firmware_files: dict[str, bytes]) -> Pico:
    """A Pico without sensors; for forked tests."""
    return power_on(micropython_image, firmware_files, {})


def kinds(receiver: GhostReceiver) -> Counter[int]:
    """How many frames of each type came."""
    return Counter(frame.frame[2] for frame in receiver.downlink)


def check_slots(pico: Pico, receiver: GhostReceiver) -> None:
    """All frames on time, none colliding, none of the uplink lost."""
    assert all(990e3 <= (frame.after_ns or 0) <= 1010e3 for frame in receiver.downlink)
    assert pico.wire.contention == []
    assert receiver.noise == []
    control = [frame for _, frame in receiver.sent if frame[2] != 0x21]
    assert f"frames {len(control)}, CRC errors 0, bytes skipped 0" in pico.reply_to_enter()


@forked
def test_the_battery_ten_times_a_second_and_nothing_that_is_absent(equipped: Pico) -> None:
    receiver = equipped.fly(lambda index, t: LINK, RACE_HZ)
    equipped.board.run_for(1.01e9)
    receiver.stop()
    equipped.board.run_for(10e6)
    # The first is due at once, and one is made up for: the battery was there before the link.
    assert set(kinds(receiver)) == {0x23}
    assert kinds(receiver)[0x23] in (11, 12)
    packs = [ghst.downlink.decode(frame.frame) for frame in receiver.downlink]
    assert [pack for pack in packs if abs(pack.voltage_mv - 16800) > 20] == []
    assert [pack for pack in packs if abs(pack.current_ma - 10000) > 50] == []
    # The first was filled in while the main loop learnt of the link.
    assert [pack.armed for pack in packs[1:]] == [True] * (len(packs) - 1)
    check_slots(equipped, receiver)


@forked
def test_satellites_without_a_fix_and_nothing_of_a_silent_gps(equipped: Pico) -> None:
    board = equipped.board
    place = Place(47.3, 8.5, 412.0, 12.0, 90.0, satellites=5, fix=0)
    gps = NmeaGps(board.uart(0), board.clock, lambda t_ns: place, period_ms=400)
    gps.start()
    board.run_for(1.5e9)

    def heard(run_ns: float) -> tuple[set[int], list[ghst.downlink.GpsSecondary]]:
        receiver = equipped.fly(lambda index, t: LINK, RACE_HZ)
        board.run_for(run_ns)
        receiver.stop()
        board.run_for(10e6)
        # The first may have waited for its slot since the last flight.
        frames = [ghst.downlink.decode(frame.frame) for frame in receiver.downlink[2:]]
        motions = [frame for frame in frames if isinstance(frame, ghst.downlink.GpsSecondary)]
        return {frame.frame[2] for frame in receiver.downlink[2:]} - {0x23}, motions

    def flags(motions: list[ghst.downlink.GpsSecondary]) -> set[tuple[object, ...]]:
        return {(motion.satellites, motion.fix, motion.home_fix) for motion in motions}

    types, motions = heard(500e6)
    assert types == {0x26}
    assert flags(motions) == {(5, False, False)}
    assert len(motions) >= 2
    place = place._replace(fix=3, satellites=9)
    board.run_for(2.6e9)
    types, motions = heard(300e6)
    assert types == {0x25, 0x26}
    assert flags(motions) == {(9, True, True)}
    place = place._replace(fix=0, satellites=4)
    board.run_for(0.8e9)
    types, motions = heard(300e6)
    assert types == {0x26}
    # Home is known, but neither how far it is nor where.
    assert flags(motions) == {(4, False, False)}
    assert {(motion.home_dist_m, motion.home_dir_decideg) for motion in motions} == {(0, 0)}
    gps.stop()
    board.run_for(2.5e9)
    assert heard(300e6) == (set(), [])


@forked
def test_home_is_unknown_after_a_restart_by_the_watchdog(equipped: Pico) -> None:
    """Which it may have done in the air: home would be where the model is."""
    board = equipped.board
    place = Place(47.3, 8.5, 412.0, 12.0, 90.0, satellites=9)
    NmeaGps(board.uart(0), board.clock, lambda t_ns: place, period_ms=400).start()
    board.write32(PIO1_CTRL, 0)  # the tick stops, which feeds the watchdog
    board.run_until(lambda: bool(board.resets), 1.2e9)
    board.run_for(4.5e9)
    receiver = equipped.fly(lambda index, t: LINK, RACE_HZ)
    board.run_for(400e6)
    frames = [ghst.downlink.decode(frame.frame) for frame in receiver.downlink]
    motions = [frame for frame in frames if isinstance(frame, ghst.downlink.GpsSecondary)]
    assert len(motions) >= 2
    assert {(motion.satellites, motion.fix, motion.home_fix) for motion in motions} == {
        (9, True, False)
    }
    assert [motion.home_dist_m for motion in motions] == [0] * len(motions)


@forked
def test_without_a_source_nothing_is_sent(bare: Pico) -> None:
    receiver = bare.fly(lambda index, t: LINK, RACE_HZ)
    bare.board.run_for(300e6)
    assert receiver.downlink == []


def ask(pico: Pico, *payloads: bytes) -> list[bytes]:
    """Send MSP frames between control frames; return the chunks that come back."""
    # Far enough from one another for what the first one has loaded.
    frames = {5 + 20 * at: ghst.encode.msp(0x21, it) for at, it in enumerate(payloads)}
    receiver = pico.fly(lambda index, t: frames.get(index, LINK), RACE_HZ)
    pico.board.run_for(250e6)
    receiver.stop()
    pico.board.run_for(10e6)
    return [frame.frame[3:9] for frame in receiver.downlink if frame.frame[2] == 0x28]


@forked
def test_a_question_is_answered(bare: Pico) -> None:
    chunks = ask(bare, bytes((0x30, 0, 1)) + bytes(7))
    assert chunks == [bytes((0x30, 3, 1, 0, 1, 44)), bytes((0x21, 0, 0, 0, 0, 0))]


@forked
def test_an_unknown_command_is_an_error(bare: Pico) -> None:
    assert ask(bare, bytes((0x30, 0, 199)) + bytes(7)) == [bytes((0xB0, 0, 199, 0, 0, 0))]


@forked
def test_the_application_adds_its_own_command(bare: Pico) -> None:
    # Version 2: flags, command 0x3000, size 2, number 41.
    chunks = ask(bare, bytes((0x50, 0, 0x00, 0x30, 2, 0, 41, 0)) + bytes(2))
    assert chunks == [bytes((0x50, 0, 0x00, 0x30, 2, 0)), bytes((0x41, 42, 0, 0, 0, 0))]


@forked
def test_the_answer_goes_before_everything_else(equipped: Pico) -> None:
    pico = equipped
    question = ghst.encode.msp(0x21, bytes((0x30, 0, 4)) + bytes(7))
    receiver = pico.fly(lambda index, t: question if index == 30 else LINK, RACE_HZ)
    pico.board.run_for(600e6)
    receiver.stop()
    pico.board.run_for(10e6)
    types = [frame.frame[2] for frame in receiver.downlink]
    first = types.index(0x28)
    count = types.count(0x28)
    assert count > 10
    # One frame may have been waiting for its slot already.
    assert types[first : first + count] == [0x28] * count
    check_slots(pico, receiver)


@forked
def test_broken_requests_disturb_nothing(equipped: Pico) -> None:
    numbers = random.Random(3)
    frames = [LINK, STICKS]

    def next_frame(index: int, t_ns: float) -> bytes:
        if index % 3:
            return bytes(frames[index & 1])
        return bytes(ghst.encode.msp(0x21 + index % 2, numbers.randbytes(10)))

    receiver = equipped.fly(next_frame, 500)
    equipped.board.run_for(600e6)
    receiver.stop()
    equipped.board.run_for(10e6)
    control = [frame for end, frame in receiver.sent if frame[2] in (0x13, 0x30)]
    text = equipped.reply_to_enter()
    assert f"frames {len(control)}, CRC errors 0, bytes skipped 0" in text
    assert "0 faults, the last" not in text
    latest = [delay for delay in equipped.latencies_us(receiver) if delay is not None]
    assert max(latest) <= 35


@forked
def test_video_settings_are_events(bare: Pico) -> None:
    setup = ghst.encode.vtx_setup(0, 5800, 25, 0x48, 0x83)
    control = bytes.fromhex("820c14c0077c58017c000000001c")
    frames = [LINK, setup, LINK, control, LINK]
    receiver = bare.fly(lambda index, t: frames[index] if index < 5 else LINK, 55)
    bare.board.run_for(200e6)
    receiver.stop()
    output = bytes(bare.board.console.output)
    assert output.count(b"set-up 5800\r\n") == 1
    assert output.count(b"control 00000000\r\n") == 1
    text = bare.reply_to_enter()
    assert "VTX set-up: 5800 MHz, 25 mW, band and channel 0x48, flags 0x00" in text
    assert "VTX control: 00000000" in text


@forked
def test_msp_video_settings_are_kept_and_saved_when_the_link_is_down(bare: Pico) -> None:
    # SET_VTX_CONFIG: band 5, channel 3; then EEPROM_WRITE.
    chunks = ask(
        bare,
        bytes((0x30, 4, 89, 0x22, 0, 1, 0)) + bytes(3),
        bytes((0x30, 0, 250)) + bytes(7),
    )
    assert chunks[0][:3] == bytes((0x30, 0, 89))
    assert b"MSP 5 3\r\n" in bare.board.console.output
    assert saved(bare) == NO_SENSORS
    bare.board.run_for(900e6)
    written = saved(bare)
    assert written is not None
    assert (written["vtx"]["vtx_band"], written["vtx"]["vtx_channel"]) == (5, 3)


def saved(pico: Pico) -> dict[str, Any] | None:
    """The settings file in the board's flash."""
    files = littlefs.read(pico.board.flash_filesystem())
    return json.loads(files["/ghst.json"]) if "/ghst.json" in files else None
