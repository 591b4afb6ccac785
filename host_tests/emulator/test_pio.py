"""PIO in exact time, and PIO with DMA (RP2040 datasheet, chapters 2.5 and 3)."""

from itertools import pairwise

import pytest

from ghst_tools.emulator import Board, Wire

PIO0 = 0x50200000
FSTAT, FLEVEL, IRQ, INTS0 = PIO0 + 0x04, PIO0 + 0x0C, PIO0 + 0x30, PIO0 + 0x134
SM0_EXECCTRL, SM0_ADDR = PIO0 + 0xCC, PIO0 + 0xD4

SQUARE = """
import rp2
from machine import Pin
@rp2.asm_pio(set_init=rp2.PIO.OUT_LOW)
def square():
    set(pins, 1)
    set(pins, 0) [2]
sm = rp2.StateMachine(0, square, freq={freq}, set_base=Pin(2))
sm.active(1)
"""


def edges_of(board: Board, pin: int) -> list[tuple[float, bool | None]]:
    edges: list[tuple[float, bool | None]] = []
    board.pin(pin).watch(lambda t_ns, level: edges.append((t_ns, level)))
    return edges


@pytest.mark.parametrize("body", ["", "import time\ntime.sleep_ms(2)"])
def test_square_wave_is_exact_while_the_cpu_works_and_while_it_sleeps(board: Board, body: str):
    board.exec(SQUARE.format(freq=12_500_000))
    edges = edges_of(board, 2)
    if body:
        board.exec(body)
    else:
        board.run_for(1e6)
    times = [t_ns for t_ns, _ in edges]
    high_first = edges[0][1] is True
    steps = [round(b - a, 3) for a, b in pairwise(times)]
    expected = [80, 240] if high_first else [240, 80]
    assert steps == [expected[n % 2] for n in range(len(steps))]
    assert len(steps) > 6_000


def test_fractional_divider_keeps_the_average(board: Board):
    board.exec(SQUARE.format(freq=8 * 420_000))
    edges = edges_of(board, 2)
    board.run_for(20e6)
    rises = [t_ns for t_ns, level in edges if level]
    # MicroPython's divider for 3.36 MHz is 37 + 51/256; four PIO cycles make a period.
    period = 4 * (37 + 51 / 256) * 8
    assert (rises[-1] - rises[0]) / (len(rises) - 1) == pytest.approx(period, rel=1e-6)
    assert {round(b - a) % 8 for a, b in pairwise(rises)} == {0}


@pytest.mark.parametrize(("join", "tx", "rx"), [("NONE", 4, 4), ("TX", 8, 0), ("RX", 0, 8)])
def test_joined_fifos_have_eight_entries(board: Board, join: str, tx: int, rx: int):
    out = board.exec(f"""
import rp2
@rp2.asm_pio(fifo_join=rp2.PIO.JOIN_{join})
def idle():
    label("here")
    jmp("here")
sm = rp2.StateMachine(0, idle)
n = 0
while not rp2.PIO(0).irq and False: pass
from machine import mem32
while not mem32[{FSTAT}] & 1 << 16:
    sm.put(n)
    n += 1
m = 0
while not mem32[{FSTAT}] & 1:
    sm.exec("push(noblock)")
    m += 1
print(n, m, sm.tx_fifo(), sm.rx_fifo())
""")
    assert out.split() == [str(tx), str(rx), str(tx), str(rx)]


@pytest.mark.parametrize(("bits", "words"), [(16, 2), (32, 4), (8, 1)])
def test_pull_ifempty_without_autopull_obeys_its_condition(board: Board, bits: int, words: int):
    """Four outs of `bits` each need as many words as the OSR runs empty."""
    out = board.exec(f"""
import rp2, time
@rp2.asm_pio(out_shiftdir=rp2.PIO.SHIFT_RIGHT, pull_thresh=32)
def outs():
    set(y, 3)
    label("next")
    pull(ifempty)
    out(x, {bits})
    jmp(y_dec, "next")
    label("done")
    jmp("done")
sm = rp2.StateMachine(0, outs)
for n in range(4): sm.put(n)
sm.active(1)
time.sleep_ms(1)
print(4 - sm.tx_fifo())
""")
    assert int(out) == words


def test_push_iffull_without_autopush_obeys_its_condition(board: Board):
    out = board.exec("""
import rp2, time
@rp2.asm_pio(in_shiftdir=rp2.PIO.SHIFT_LEFT, push_thresh=16)
def ins():
    set(y, 3)
    label("next")
    in_(y, 8)
    push(iffull, noblock)
    jmp(y_dec, "next")
    label("done")
    jmp("done")
sm = rp2.StateMachine(0, ins)
sm.active(1)
time.sleep_ms(1)
print([hex(sm.get()) for _ in range(sm.rx_fifo())])
""")
    assert out.strip() == "['0x302', '0x100']"


def test_irq_flags_4_to_7_do_not_reach_the_cpu(board: Board):
    out = board.exec(f"""
import rp2
from machine import mem32
@rp2.asm_pio()
def flags():
    irq(2)
    irq(5)
    label("done")
    jmp("done")
rp2.PIO(0).irq(lambda p: None, trigger=0xF00)
sm = rp2.StateMachine(0, flags)
print(hex(mem32[{IRQ}]))
rp2.PIO(0).irq(None)
sm.active(1)
print(hex(mem32[{IRQ}]), hex(mem32[{PIO0 + 0x128}]>>8 & 0xF))
mem32[{IRQ}] = 0x20
print(hex(mem32[{IRQ}]), hex(mem32[{SM0_ADDR}] - (mem32[{SM0_EXECCTRL}] >> 7 & 31)))
""")
    assert out.split() == ["0x0", "0x24", "0x4", "0x4", "0x2"]


def test_a_jump_forced_into_a_stalled_machine_is_obeyed(board: Board):
    """`sm.exec("jmp(...)")` while the program waits: it goes on from there, and waits again."""
    wire = Wire(board, 2)
    board.exec("""
import rp2, time
from machine import Pin
@rp2.asm_pio()
def waits():
    label("first")
    wait(0, pin, 0)
    set(x, 1)
    label("end")
    jmp("end")
sm = rp2.StateMachine(0, waits, in_base=Pin(2))
sm.active(1)
""")
    offset = board.read32(SM0_EXECCTRL) >> 7 & 31
    assert board.read32(SM0_ADDR) - offset == 0
    board.write32(PIO0 + 0xD8, offset)  # jmp first
    board.run_for(1_000)
    assert board.read32(SM0_ADDR) - offset == 0
    wire.hold(False, board.now_ns + 100, board.now_ns + 400)
    board.run_for(1_000)
    assert board.read32(SM0_ADDR) - offset == 2


def test_restart_and_disable_bits(board: Board):
    board.exec(SQUARE.format(freq=12_500_000))
    assert board.read32(PIO0) & 0xF == 1
    board.write32(PIO0, 0)
    edges = edges_of(board, 2)
    board.run_for(100_000)
    assert edges == []
    board.write32(PIO0, 1 | 1 << 4 | 1 << 8)
    board.run_for(100_000)
    assert len(edges) in (624, 625, 626)


RING = """
import rp2, array, uctypes
from machine import Pin, mem32
@rp2.asm_pio(in_shiftdir=rp2.PIO.SHIFT_RIGHT)
def uart_rx():
    wait(0, pin, 0)
    set(x, 7) [10]
    label("bit")
    in_(pins, 1)
    jmp(x_dec, "bit") [6]
    wait(1, pin, 0)
    push(noblock)
sm = rp2.StateMachine(0, uart_rx, freq=8 * 420000, in_base=Pin(2, Pin.IN, Pin.PULL_UP))
raw = bytearray(128)
base = (uctypes.addressof(raw) + 63) & ~63
dma = rp2.DMA()
dma.config(read=0x50200020 + 3, write=base, count=1000, trigger=True,
    ctrl=dma.pack_ctrl(size=0, inc_read=False, inc_write=True, ring_size=6, ring_sel=True,
                       treq_sel=4, irq_quiet=True))
sm.active(1)
print(base, 0x50000000 + 0x40 * dma.channel)
"""


def test_dma_puts_received_bytes_into_a_ring_at_once(board: Board):
    wire = Wire(board, 2)
    base, channel = map(int, board.exec(RING).split())
    data = bytes(range(7, 107))
    end = wire.send(data)
    for number in range(len(data)):
        # The program pushes 77 of its 80 cycles behind the start bit's edge, 0.9 us before the
        # end of the byte; noticing the edge takes it up to one cycle, 0.3 us.
        byte_end = end - (len(data) - number - 1) * 10e9 / 420_000
        board.run_for(byte_end - board.now_ns - 1_000)
        assert board.read32(channel + 0x8) == 1000 - number, number
        board.run_for(500)
        assert board.read32(channel + 0x8) == 1000 - number - 1, number
        assert board.read32(channel + 0x4) == base + (number + 1) % 64
    ring = bytes(board.mcu.sram[base - 0x20000000 : base - 0x20000000 + 64])
    expected = bytearray(64)
    for number, value in enumerate(data):
        expected[number % 64] = value
    assert ring == bytes(expected)
