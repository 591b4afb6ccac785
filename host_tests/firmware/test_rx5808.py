"""The video receiver on the emulated chip's pins, and how strict the emulated module is."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from ghst_tools import boards, filesystem
from ghst_tools.emulator import Board
from ghst_tools.emulator.rx5808 import POWER_DOWN, Rx5808Module

CLOCK, DATA, SELECT = 14, 15, 22


@pytest.fixture(scope="module")
def wired_board(
    micropython_image: Path, firmware_files: dict[str, bytes]
) -> tuple[Board, Rx5808Module]:
    """A board at the prompt, with a module on its pins since power-on."""
    files = {path: content for path, content in firmware_files.items() if path != "/main.py"}
    size = boards.load("rpi_pico").filesystem_size
    board = Board(micropython_image, filesystem.build(files, size))
    module = Rx5808Module(board, clock=CLOCK, data=DATA, select=SELECT)
    board.boot()
    board.exec(
        "import time\n"
        "from machine import Pin\n"
        "from firmware.rx5808 import Rx5808\n"
        f"clock, data = Pin({CLOCK}, Pin.OUT), Pin({DATA}, Pin.OUT)\n"
        f"select = Pin({SELECT}, Pin.OUT, value=1)\n"
        "def send(bits):\n"
        "    select(0)\n"
        "    for bit in bits:\n"
        "        data(bit)\n"
        "        clock(1)\n"
        "        clock(0)\n"
        "    select(1)\n"
        "def bits_of(address, write, value):\n"
        "    word = address | write << 4 | value << 5\n"
        "    return [word >> place & 1 for place in range(25)]\n"
    )
    return board, module


@pytest.fixture
def board(wired_board: tuple[Board, Rx5808Module]) -> Iterator[Board]:
    """The board; afterwards its pins are idle again."""
    yield wired_board[0]
    wired_board[0].exec("clock(0)\nselect(1)\ndata(0)")


@pytest.fixture
def module(wired_board: tuple[Board, Rx5808Module]) -> Rx5808Module:
    """The module as after power-on."""
    module = wired_board[1]
    module.power(True)
    module.writes.clear()
    module.errors.clear()
    return module


def test_frequencies_arrive(board: Board, module: Rx5808Module) -> None:
    frequencies = (5300, 5301, 5658, 5740, 5865, 5917, 5999, 6000)
    printed = board.exec(
        "receiver = Rx5808(clock, data, select)\n"
        f"for mhz in {frequencies}:\n"
        "    begun_us = time.ticks_us()\n"
        "    receiver.set_frequency(mhz)\n"
        "    print(time.ticks_diff(time.ticks_us(), begun_us))\n"
        "    time.sleep_ms(1)\n"
    )
    assert module.errors == []
    tuned = [write.value for write in module.writes if write.address == 1]
    mhz = [2 * (32 * (value >> 7) + (value & 127)) + 479 for value in tuned]
    assert mhz == [5299, 5301, 5657, 5739, 5865, 5917, 5999, 5999]
    assert module.frequency_mhz == 5999.0
    assert module.receives_video
    assert [write.address for write in module.writes] == [0x0, 0xA, 0x1] * len(frequencies)
    assert all(200 < int(word) < 1500 for word in printed.split()), printed


def test_a_module_that_gets_its_power_late_or_lost_it_is_tuned(
    board: Board, module: Rx5808Module
) -> None:
    module.power(False)
    board.exec("receiver = Rx5808(clock, data, select)\nreceiver.set_frequency(5695)")
    assert (module.writes, module.errors) == ([], [])
    module.power(True)
    assert module.frequency_mhz == 5865.0
    board.exec("receiver.set_frequency(5695)")
    assert (module.frequency_mhz, module.errors) == (5695.0, [])
    module.power(True)
    board.exec("receiver.set_frequency(5695)")
    assert (module.frequency_mhz, module.errors) == (5695.0, [])


def test_a_module_that_somebody_has_powered_down_is_woken(
    board: Board, module: Rx5808Module
) -> None:
    board.exec("send(bits_of(0xA, 1, 0xFFFFF))\nsend(bits_of(0x0, 1, 16))")
    assert module.errors == []
    assert not module.receives_video
    board.exec("receiver = Rx5808(clock, data, select)\nreceiver.set_frequency(5805)")
    assert (module.frequency_mhz, module.receives_video) == (5805.0, True)


def test_a_reset_of_the_board_in_a_word_is_made_good(board: Board, module: Rx5808Module) -> None:
    # What is on the pins after a reset in the middle: low, then as the new receiver sets them.
    board.exec("send([1] * 11)\nmodule = Rx5808(clock, data, select)\nmodule.set_frequency(5733)")
    assert [error.partition(": ")[2] for error in module.errors] == ["11 bits instead of 25"]
    assert module.frequency_mhz == 5733.0


@pytest.mark.parametrize(
    ("code", "error"),
    [
        ("send(bits_of(1, 1, 0x2A05)[:-1])", "24 bits instead of 25"),
        ("send(bits_of(1, 1, 0x2A05) + [0])", "26 bits instead of 25"),
        ("send(bits_of(1, 0, 0x2A05))", "register 0x1 is read, and nobody listens"),
        (
            "send(list(reversed(bits_of(1, 1, 0x2A05))))",
            "register 0x0 is read, and nobody listens",
        ),
        ("send(bits_of(0xC, 1, 5))", "register 0xc is reserved"),
        ("clock(1)\nclock(0)", "the clock rises while select is high"),
        ("select(0)\nclock(1)\ndata(1)\nclock(0)", "data changes while the clock is high"),
        ("select(0)\nclock(1)\nselect(1)", "select changes while the clock is high"),
    ],
)
def test_the_module_is_strict(board: Board, module: Rx5808Module, code: str, error: str) -> None:
    board.exec(code)
    assert error in [text.partition(": ")[2] for text in module.errors]
    assert module.writes == []
    assert module.frequency_mhz == 5865.0


def test_the_module_wants_levels_of_100_ns(board: Board, module: Rx5808Module) -> None:
    # By the chip's own registers, one instruction apart.
    board.exec(
        "import micropython\n"
        "@micropython.viper\n"
        "def fast():\n"
        "    pins = ptr32(0xd0000000)\n"
        f"    pins[6] = {1 << SELECT}\n"
        f"    pins[5] = {1 << CLOCK}\n"
        f"    pins[6] = {1 << CLOCK}\n"
        f"    pins[5] = {1 << CLOCK}\n"
        f"    pins[6] = {1 << CLOCK}\n"
        "fast()"
    )
    assert any("ns after the last change" in error for error in module.errors)


def test_pins_become_outputs_without_a_word(board: Board, module: Rx5808Module) -> None:
    board.exec(f"for number in ({CLOCK}, {DATA}, {SELECT}): Pin(number, Pin.IN)")
    board.exec(f"module = Rx5808(Pin({CLOCK}), Pin({DATA}), Pin({SELECT}))")
    assert [board.pin(number).device for number in (CLOCK, DATA, SELECT)] == [False, False, True]
    assert (module.writes, module.errors) == ([], [])


def test_a_reset_register_and_power_down(board: Board, module: Rx5808Module) -> None:
    board.exec("send(bits_of(0x1, 1, 0x281D))")
    assert module.frequency_mhz == 5657.0
    board.exec("send(bits_of(0xF, 1, 0))")
    assert module.frequency_mhz == 5865.0
    assert module.registers[POWER_DOWN] == 0x10DF3
