"""A UART with TX and RX tied together, bit by bit."""

import pytest

from ghst_tools.emulator import Board, Wire
from ghst_tools.emulator.uart_pins import UartPins

BAUD = 48e6 * 4 / (7 * 64 + 9)  # what the divisor registers make of 420000
BIT_NS = 1e9 / BAUD
SETUP = """
from machine import UART, Pin, mem32
Pin(21, Pin.IN, Pin.PULL_UP)
u = UART(1, 420000, tx=Pin(20), rx=Pin(21))
"""
RELEASE = "mem32[0x400140a4] = 5\n"


@pytest.fixture
def pins(board: Board) -> UartPins:
    pins = board.uart(1).connect(board.pin(20), board.pin(21))
    board.exec(SETUP)
    return pins


@pytest.fixture
def wire(board: Board, pins: UartPins) -> Wire:
    return Wire(board, 21)


def test_what_is_sent_is_on_the_wire_and_comes_back(board: Board, wire: Wire) -> None:
    driven: list[tuple[float, bool | None]] = []
    wire.pin.watch(lambda t_ns, level: driven.append((t_ns, level)))
    assert wire.pin.device is True
    data = b"GHST\x00\xff\x55"
    board.exec(f"u.write({data!r})")
    board.run_for(1e6)
    sent = wire.decode(BAUD)
    assert bytes(byte.value for byte in sent) == data
    assert all(byte.framing_ok for byte in sent)
    assert sent[-1].t_ns - sent[0].t_ns == pytest.approx(10 * BIT_NS * (len(data) - 1))
    assert board.exec("print(u.read())") == f"{data!r}\n"
    # Released by a change of function that leaves the level as it is.
    before = len(driven)
    board.exec(RELEASE)
    assert [level for _, level in driven[before:]] == [None]
    assert wire.level
    board.exec("u.write(b'nobody hears it')")
    board.run_for(1e6)
    assert len(wire.decode(BAUD)) == len(data)


def test_start_bits_are_looked_at_in_their_middle(board: Board, wire: Wire) -> None:
    board.exec(RELEASE)
    wire.glitch(board.now_ns + 10e3, 0.45 * BIT_NS)
    wire.glitch(board.now_ns + 90e3, 0.55 * BIT_NS)
    wire.send(b"frame", board.now_ns + 200e3)
    board.run_for(1e6)
    assert board.exec("print(u.read())") == "b'\\xffframe'\n"


def test_tx_straight_and_by_a_diode(board: Board, pins: UartPins, wire: Wire) -> None:
    wire.send(b"\x0f", board.now_ns + 300e3)
    wire.send(b"\xf0", board.now_ns + 600e3)
    board.run_for(1e6)
    # TX is high between frames, straight on the wire: the receiver fights it, and wins.
    assert len(wire.contention) == 3
    assert board.exec("print(u.read())") == "b'\\x0f\\xf0'\n"
    pins.diode = True
    board.exec("u.write(b'\\xcc')")
    wire.send(b"\x0f", board.now_ns + 300e3)
    board.run_for(1e6)
    assert len(wire.contention) == 3
    assert wire.pin.device is None
    assert board.exec("print(u.read())") == "b'\\xcc\\x0f'\n"


def test_a_break_is_one_bad_byte(board: Board, wire: Wire) -> None:
    board.exec(RELEASE)
    wire.hold(False, board.now_ns + 10e3, board.now_ns + 500e3)
    wire.send(b"after", board.now_ns + 600e3)
    board.run_for(2e6)
    # MicroPython drops a break.
    assert board.exec("print(u.read())") == "b'after'\n"
