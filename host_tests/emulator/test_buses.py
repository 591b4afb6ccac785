"""UART and I2C with peers in Python."""

import pytest

from ghst_tools.emulator import Board

# 48 MHz / (16 * 26.046875): what the divisor registers make of 115200
BAUD = 48e6 * 4 / (26 * 64 + 3)


def test_uart_sends_in_time_and_reports_when_it_is_done(board: Board):
    out = board.exec("""
from machine import UART, Pin
import time
u = UART(0, 115200, tx=Pin(0), rx=Pin(1))
t = time.ticks_us()
n = u.write(bytes(range(100)))
early = u.txdone()
u.flush()
print(n, early, u.txdone(), time.ticks_diff(time.ticks_us(), t))
""")
    n, early, done, took_us = out.split()
    peer = board.uart(0)
    assert (n, early, done) == ("100", "False", "True")
    assert peer.received == bytes(range(100))
    # 10 bits a byte, one after the other without a gap
    assert peer.times[-1] - peer.times[0] == pytest.approx(99 * 10e9 / BAUD)
    assert 0 < int(took_us) - 1000 * 1e6 / BAUD < 1_000


def test_uart_receives_more_than_its_fifo(board: Board):
    board.exec("from machine import UART, Pin\nu = UART(0, 115200, tx=Pin(0), rx=Pin(1))")
    data = bytes(range(200))
    end = board.uart(0).send(data, 115_200)
    board.run_for(end - board.now_ns + 1e6)
    assert board.exec("print(list(u.read()) == list(range(200)), u.any())") == "True 0\n"


def test_uart_receive_timeout_comes_32_bits_after_the_last_byte(board: Board):
    board.exec("""
from machine import UART, Pin
u = UART(0, 420000, tx=Pin(0), rx=Pin(1))
p = Pin(6, Pin.OUT, value=0)
u.irq(lambda u: p.value(1), UART.IRQ_RXIDLE)
""")
    idle: list[float] = []
    board.pin(6).watch(lambda t_ns, level: idle.append(t_ns))
    end = board.uart(0).send(b"GHST!", 420_000)
    board.run_for(1e6)
    # 76 us behind the middle of the stop bit, and the time it takes to get to the handler
    assert 0 < idle[0] - (end + 31.5e9 / 420_000) < 60_000


def test_uart_at_the_wrong_rate_or_pin_gets_no_good_bytes(board: Board):
    board.exec("from machine import UART, Pin\nu = UART(0, 115200, tx=Pin(0), rx=Pin(1))")
    board.uart(0).send(b"hello", 57_600)
    board.run_for(5e6)
    assert "hello" not in board.exec("print(u.read())")
    board.exec("Pin(1, Pin.IN)")
    board.uart(0).send(b"hello", 115_200)
    board.run_for(5e6)
    assert board.exec("print(u.read())") == "None\n"


class Memory:
    """A register file with an auto-incrementing pointer, as most sensors have."""

    def __init__(self) -> None:
        self.registers = bytearray(range(256))
        self.log: list[str] = []
        self._pointer: int | None = 0

    def start(self, read: bool) -> bool:
        self.log.append("r" if read else "w")
        if not read:
            self._pointer = None
        return True

    def write(self, value: int) -> bool:
        if self._pointer is None:
            self._pointer = value
        elif self._pointer < 0x80:
            self.registers[self._pointer] = value
            self._pointer += 1
        else:
            return False  # read only
        return True

    def read(self) -> int:
        assert self._pointer is not None
        value = self.registers[self._pointer]
        self._pointer += 1
        return value

    def stop(self) -> None:
        self.log.append("p")


@pytest.fixture
def memory(board: Board) -> Memory:
    memory = Memory()
    board.i2c(0).attach(0x76, memory)
    board.i2c(0).connect(board.pin(4), board.pin(5))
    board.exec("from machine import I2C, SoftI2C, Pin\nimport time")
    return memory


@pytest.mark.parametrize("bus", ["I2C(0, ", "SoftI2C("])
def test_i2c_reads_writes_and_scans(board: Board, memory: Memory, bus: str):
    board.exec(f"i = {bus}sda=Pin(4), scl=Pin(5), freq=400000)")
    assert board.exec("print(i.scan())") == "[118]\n"
    assert board.exec("print(list(i.readfrom_mem(0x76, 0xF0, 4)))") == "[240, 241, 242, 243]\n"
    board.exec("i.writeto_mem(0x76, 0x10, b'GHST')")
    assert memory.registers[0x10:0x14] == b"GHST"
    assert memory.log[-2:] == ["w", "p"]
    assert board.exec("print(i.readfrom_mem(0x76, 0x10, 4))") == "b'GHST'\n"


def test_i2c_takes_nine_clocks_a_byte(board: Board, memory: Memory):
    took = int(
        board.exec("""
i = I2C(0, sda=Pin(4), scl=Pin(5), freq=100000)
t = time.ticks_us()
i.readfrom_into(0x76, bytearray(50))
print(time.ticks_diff(time.ticks_us(), t))
""")
    )
    assert 51 * 90 < took < 51 * 90 + 500


def test_i2c_errors_are_the_ones_of_the_chip(board: Board, memory: Memory):
    board.exec("""
i = I2C(0, sda=Pin(4), scl=Pin(5), freq=400000, timeout=5000)
def attempt(f, *a):
    try:
        return f(*a)
    except OSError as e:
        return e.errno
""")
    assert board.exec("print(attempt(i.readfrom, 0x20, 1), attempt(i.writeto, 0x20, b'a'))") == (
        "5 5\n"
    )
    board.i2c(0).stuck = True
    assert board.exec("print(attempt(i.readfrom, 0x76, 1))") == "110\n"
    board.i2c(0).stuck = False
    assert board.exec("print(attempt(i.readfrom_mem, 0x76, 5, 1))") == "b'\\x05'\n"
    assert board.exec("print(attempt(i.writeto, 0x76, b'\\x80\\x01\\x02'))") == "1\n"
    board.i2c(0).detach(0x76)
    assert board.exec("print(i.scan())") == "[]\n"
