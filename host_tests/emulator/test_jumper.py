"""Jumpers between pins, and shorts."""

from ghst_tools.emulator import Board, Jumper

PINS = """
from machine import Pin
a = Pin(2, Pin.IN, Pin.PULL_UP)
b = Pin(3, Pin.IN, Pin.PULL_DOWN)
"""


def levels(board: Board, code: str = "") -> str:
    return board.exec(f"{code}\nprint(a.value(), b.value())").strip()


def test_both_pins_have_the_level_that_either_makes(board: Board):
    board.exec(PINS)
    assert levels(board) == "1 0"
    jumper = Jumper(board, 2, 3)
    assert levels(board) == "1 1"
    assert levels(board, "b.init(Pin.OUT, value=0)") == "0 0"
    assert levels(board, "b.value(1)") == "1 1"
    # Where both drive the one that pulls low wins, and both are told to be driven so.
    assert levels(board, "a.init(Pin.OUT, value=0)") == "0 0"
    assert (board.pin(2).device, board.pin(3).device) == (False, False)
    board.exec("a.init(Pin.IN, Pin.PULL_UP)")
    board.pin(2).drive(False)
    assert levels(board, "b.init(Pin.IN, Pin.PULL_UP)") == "0 0"
    jumper.remove()
    assert levels(board) == "0 1"
    assert (board.pin(2).device, board.pin(3).device) == (None, None)


def test_edges_come_at_once_and_watchers_of_both_pins_hear_of_them(board: Board):
    Jumper(board, 2, 3)
    board.exec(PINS + "b.init(Pin.OUT, value=0)")
    driven: list[tuple[float, bool | None]] = []
    seen: list[tuple[float, bool | None]] = []
    board.pin(2).watch(lambda t_ns, level: driven.append((t_ns, level)))
    board.pin(2).watch_level(lambda t_ns, level, cause: seen.append((t_ns, level)))
    board.exec("b.value(1); b.value(0)")
    assert [level for _, level in seen] == [True, False]
    assert driven == seen


def test_a_state_machine_hears_the_other_pin(board: Board):
    Jumper(board, 2, 3)
    out = board.exec("""
from machine import Pin
import rp2
@rp2.asm_pio()
def count():
    wait(0, pin, 0)
    wait(1, pin, 0)
    mov(isr, invert(null))
    push(noblock)
b = Pin(3, Pin.OUT, value=1)
m = rp2.StateMachine(0, count, freq=125_000_000, in_base=Pin(2, Pin.IN))
m.active(1)
for _ in range(3):
    b.value(0)
    b.value(1)
print(m.rx_fifo())
""")
    assert out == "3\n"


def test_a_short_wins_over_everything(board: Board):
    board.exec(PINS + "a.init(Pin.OUT, value=0)")
    board.pin(2).short(True)
    assert levels(board) == "1 0"
    board.pin(2).drive(False)
    assert levels(board) == "1 0"
    board.pin(2).short(False)
    assert levels(board, "a.value(1)") == "0 0"
    board.pin(2).short(None)
    board.pin(2).drive(None)
    assert levels(board) == "1 0"


def test_jumpers_outlast_a_reset_of_the_chip(board: Board):
    Jumper(board, 2, 3)
    board.exec(PINS + "b.init(Pin.OUT, value=1)")
    board.start("import machine; machine.reset()")
    board.run_until(lambda: bool(board.resets))
    # Pulled down, both, as a reset leaves them.
    assert (board.pin(2).level, board.pin(3).level) == (False, False)
    board.boot()
    assert levels(board, PINS) == "1 1"
