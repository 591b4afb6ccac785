"""`role: goggles`: listens for the video settings, tunes a video receiver, moves nothing."""

from __future__ import annotations

from pathlib import Path

import pytest
from rig import NO_SENSORS, SERVOS, Pico

import ghst
from forked import forked
from ghst_tools import boards
from ghst_tools.emulator.rx5808 import Rx5808Module

PINS = {"clock": 10, "data": 11, "select": 12}
CONFIGURATION = {
    "role": "goggles",
    "rx5808": {"clock_pin": 10, "data_pin": 11, "select_pin": 12},
}
CENTRE = ghst.encode.channels(0x30, (2048,) * 4, (128,) * 4)
LINK = ghst.encode.link_data(0x13, (1984,) * 4, rf_mode=6)


@pytest.fixture(scope="module")
def goggles(micropython_image: Path, firmware_files: dict[str, bytes]) -> Pico:
    """A Pico that is the goggles' side; for forked tests."""
    pico = Pico(micropython_image, firmware_files, boards.load("rpi_pico").filesystem_size)
    pico.boot(NO_SENSORS | CONFIGURATION)
    return pico


@pytest.fixture
def module(goggles: Pico) -> Rx5808Module:
    """The video receiver on its pins."""
    return Rx5808Module(goggles.board, **PINS)


@pytest.mark.parametrize("address", [0x83, 0x80])
@forked
def test_the_frequency_is_tuned_to(goggles: Pico, module: Rx5808Module, address: int) -> None:
    setups = [
        ghst.encode.vtx_setup(0, 5800, 25, 0x48, address),
        ghst.encode.vtx_setup(0, 5695, 200, 0x31, address),
    ]
    goggles.fly(lambda index, t: setups[index] if index < 2 else None, 10)
    goggles.board.run_for(60e6)
    # The oscillator runs in steps of 2 MHz: 5799 MHz are nearest.
    assert module.frequency_mhz == 5799.0
    goggles.board.run_for(150e6)
    assert (module.frequency_mhz, module.receives_video, module.errors) == (5695.0, True, [])
    text = goggles.reply_to_enter()
    assert "VTX set-up: 5695 MHz, 200 mW, band and channel 0x31, flags 0x00" in text
    assert "video receiver: 5695 MHz" in text


@forked
def test_others_are_not_listened_to_and_nonsense_is_counted(
    goggles: Pico, module: Rx5808Module
) -> None:
    setups = [
        ghst.encode.vtx_setup(0, 5740, 25, 0x48, 0x83),
        ghst.encode.vtx_setup(0, 5900, 25, 0x48, 0x84),
        ghst.encode.vtx_setup(0, 1200, 25, 0x48, 0x83),
        ghst.encode.vtx_setup(0, 5900, 25, 0x48, 0x83)[:-1] + b"\x00",
    ]
    goggles.fly(lambda index, t: setups[index] if index < len(setups) else None, 20)
    goggles.board.run_for(300e6)
    assert module.frequency_mhz == 5739.0
    assert "VTX set-up: 1200 MHz" in goggles.reply_to_enter()


@forked
def test_nothing_moves_and_nothing_is_sent(goggles: Pico, module: Rx5808Module) -> None:
    frames = [LINK, CENTRE]
    receiver = goggles.fly(lambda index, t: frames[index & 1], 160)
    goggles.board.run_for(300e6)
    assert receiver.downlink == []
    assert goggles.compares == []
    servos = SERVOS.keys() - PINS.values()
    assert {pin: goggles.board.pin(pin).device for pin in servos} == dict.fromkeys(servos)
