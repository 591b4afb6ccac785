"""The board: boot, REPL, file system, USB, resets, clocks."""

from pathlib import Path

import pytest
from littlefs import LittleFS

from ghst_tools.emulator import Board, DeviceError, Wire
from ghst_tools.errors import GhstError

TIMERAWL = 0x40054028
WATCHDOG = 0x40058000
ENABLE = 1 << 30


def filesystem(files: dict[str, str], blocks: int) -> bytes:
    image = LittleFS(block_size=4096, block_count=blocks, disk_version=0x00020000)
    for name, text in files.items():
        with image.open(name, "w") as file:
            file.write(text)
    return bytes(image.context.buffer)


def booted(image: Path, main: str) -> Board:
    """A board on which `main` runs; what it prints before the host opens the port is lost."""
    blocks = Board(image).filesystem.blocks
    wait = "import time\ntime.sleep_ms(100)\n"
    board = Board(image, filesystem({"main.py": wait + main}, blocks))
    board.boot(until=b"running")
    return board


def test_the_image_declares_the_file_system_that_micropython_uses(board: Board):
    count, size = board.exec(
        "import rp2\nf = rp2.Flash()\nprint(f.ioctl(4, 0), f.ioctl(5, 0))"
    ).split()
    assert (board.filesystem.blocks, board.filesystem.size) == (int(count), int(count) * int(size))
    board.exec("rp2.Flash().writeblocks(3, b'GHST' * 1024)")
    assert board.flash_filesystem()[3 * 4096 : 4 * 4096] == b"GHST" * 1024


def test_file_system_is_mounted_main_runs_and_writes_are_kept(micropython_image: Path):
    board = booted(micropython_image, "with open('log', 'a') as f: f.write('x')\nprint('running')")
    board.run_until(lambda: board.console.output.endswith(b">>> "))
    for boots in range(1, 4):
        assert board.exec("print(open('log').read())").strip() == "x" * boots
        board.power_cycle()
        board.boot()
    stored = LittleFS(block_size=4096, block_count=board.filesystem.blocks, mount=False)
    stored.context.buffer[:] = board.flash_filesystem()
    stored.mount()
    with stored.open("log") as file:
        assert file.read() == "xxxx"


def test_an_image_that_is_too_large_is_refused(micropython_image: Path):
    with pytest.raises(GhstError, match=r"1441793 bytes.*only 1441792"):
        Board(micropython_image, bytes(1441792 + 1))


def test_exec_returns_the_output_and_raises_the_devices_exceptions(board: Board):
    assert board.exec("for i in range(3): print(i * i)") == "0\n1\n4\n"
    with pytest.raises(DeviceError, match=r'File "<stdin>", line 1(.|\n)*ZeroDivisionError'):
        board.exec("1 / 0")
    long = "x = '" + "abcdefgh" * 200 + "'\nprint(len(x))"
    assert board.exec(long) == "1600\n"


def test_a_timeout_tells_what_the_console_showed_last(board: Board):
    board.start("print('so far')\nwhile True: pass")
    with pytest.raises(TimeoutError, match="so far"):
        board.run_until(lambda: False, 20e6)


def test_ctrl_c_reaches_a_busy_program_and_ctrl_d_restarts_it(micropython_image: Path):
    board = booted(micropython_image, "print('running')\nwhile True: pass")
    board.console.output.clear()
    board.console.write(b"\x03")
    board.run_until(lambda: board.console.output.endswith(b">>> "), 100e6)
    assert b"KeyboardInterrupt" in board.console.output
    board.console.write(b"\x04")
    board.run_until(lambda: b"soft reboot\r\nrunning" in board.console.output, 500e6)


def test_an_idle_board_keeps_time(board: Board):
    before = board.read32(TIMERAWL)
    cycles = board.cycles
    board.run_for(3e9)
    assert board.read32(TIMERAWL) - before == 3_000_000
    assert board.cycles - cycles < 0.02 * 3 * 125e6


def test_a_host_that_does_not_read_holds_the_device_up(board: Board):
    board.console.reading = False
    printed = len(board.console.output)
    board.start("for i in range(400): print('0123456789abcdef')\nprint('end')")
    board.run_for(300e6)
    assert len(board.console.output) == printed
    board.console.reading = True
    assert board.result(60e9) == "0123456789abcdef\n" * 400 + "end\n"


def test_a_program_goes_on_when_the_host_closes_the_port(board: Board):
    board.start("n = 0\nwhile n < 100:\n    print('0123456789' * 5)\n    n += 1")
    board.run_for(20e6)
    board.console.close()
    board.run_for(1e6)
    printed = len(board.console.output)
    board.run_for(500e6)
    assert len(board.console.output) == printed
    assert not board.console.connected
    board.console.open()
    board.run_for(1e6)
    assert board.console.connected
    assert board.exec("print(n)") == "100\n"


def test_the_watchdog_resets_a_hung_program_and_says_so(board: Board):
    board.start("import machine\nw = machine.WDT(timeout=100)\nprint('fed')\nwhile True: pass")
    board.run_until(lambda: "fed" in board.printed)
    fed = board.now_ns
    board.run_until(lambda: bool(board.resets))
    ((t_ns, cause),) = board.resets
    assert cause == "timer"
    # The timeout began somewhat before "fed" had come over USB.
    assert 100e6 - 1e6 < t_ns - fed < 100e6
    board.boot()
    assert (
        board.exec("import machine; print(machine.reset_cause() == machine.WDT_RESET)") == "True\n"
    )
    board.run_for(1e9)
    assert len(board.resets) == 1  # disabled after the reset


def test_the_watchdog_pauses_while_disabled_and_goes_on_where_it_was(board: Board):
    board.exec("import machine; w = machine.WDT(timeout=1000)")
    board.write32(WATCHDOG + 0x3000, ENABLE)
    left = board.read32(WATCHDOG) & 0xFFFFFF
    assert not board.read32(WATCHDOG) & ENABLE
    board.run_for(5e9)
    assert board.resets == []
    assert board.read32(WATCHDOG) & 0xFFFFFF == left
    board.write32(WATCHDOG + 0x2000, ENABLE)
    start = board.now_ns
    board.run_until(lambda: bool(board.resets), 2e9)
    assert board.resets[0][0] - start == pytest.approx(left * 500, abs=500)  # erratum RP2040-E1


def test_scratch_registers_survive_a_reset_but_not_a_power_cycle(board: Board):
    board.exec("import machine; machine.mem32[0x4005800C] = 0x12345678")
    board.start("machine.reset()")
    board.run_until(lambda: bool(board.resets))
    assert board.resets[0][1] == "forced"
    board.boot()
    assert board.exec("import machine; print(hex(machine.mem32[0x4005800C]))") == "0x12345678\n"
    board.power_cycle()
    board.boot()
    out = board.exec("import machine; print(machine.mem32[0x4005800C], machine.reset_cause())")
    assert out.split() == ["0", "1"]  # PWRON_RESET


def test_a_reset_releases_the_pins(board: Board):
    board.exec("from machine import Pin; p = Pin(6, Pin.OUT, value=1)")
    levels: list[bool | None] = []
    board.pin(6).watch(lambda t_ns, level: levels.append(level))
    board.start("import machine; machine.reset()")
    board.run_until(lambda: bool(board.resets))
    assert levels == [None]
    assert board.pin(6).level is False  # pulled down at reset


def test_an_output_reads_back_and_a_driven_input_interrupts(board: Board):
    out = board.exec("""
from machine import Pin
p = Pin(6, Pin.OUT, value=1)
a = p.value()
p.value(0)
print(a, p.value())
seen = []
q = Pin(7, Pin.IN, Pin.PULL_UP)
q.irq(lambda pin: seen.append(pin.value()), Pin.IRQ_FALLING | Pin.IRQ_RISING)
""")
    assert out.split() == ["1", "0"]
    board.pin(7).drive(False)
    board.run_for(1e6)
    board.pin(7).drive(None)
    board.run_for(1e6)
    assert board.exec("print(seen)") == "[0, 1]\n"


def test_adc_reads_volts_and_functions_of_time(board: Board):
    board.adc(0).set_volts(1.65)
    board.adc(1).set_volts(lambda t_ns: 3.3 if t_ns > board_time + 0.5e9 else 0.0)
    board_time = board.now_ns
    board.exec("from machine import ADC; a = ADC(26); b = ADC(27)")
    # read_u16 stretches 12 bits: 2048 -> 2048 << 4 | 2048 >> 8
    assert board.exec("print(a.read_u16(), b.read_u16())").split() == ["32776", "0"]
    board.run_for(1e9)
    assert board.exec("print(b.read_u16())").split() == ["65535"]


def test_adc_reads_the_level_of_a_pin_that_nobody_gives_a_voltage(board: Board):
    out = board.exec("""
from machine import ADC, mem32
a, t = ADC(26), ADC(ADC.CORE_TEMP)
pad = 0x4001C004 + 4 * 26
for pulls in (0x84, 0x88):
    mem32[pad] = pulls
    print(a.read_u16())
print(round(27 - (t.read_u16() * 3.3 / 65535 - 0.706) / 0.001721))
""")
    assert out.split() == ["0", "65535", "27"]


def test_the_timer_can_be_moved_across_its_wrap(board: Board):
    board.exec("import time\nt = time.ticks_us()\nm = time.ticks_ms()\nn = time.time_ns()")
    before = board.read32(TIMERAWL)
    board.advance_timer(2**32 - before - 1_000)
    assert board.read32(TIMERAWL) == 2**32 - 1_000
    board.run_for(2_000_000)
    assert board.read32(TIMERAWL) == 1_000
    assert board.read32(TIMERAWL - 4) == 1  # TIMERAWH
    assert board.exec("time.sleep_ms(50); print('awake')") == "awake\n"


def test_skipped_alarms_fire_at_once_and_later_ones_earlier(board: Board):
    board.exec("""
import machine, time
log = []
a = machine.Timer(period=100, mode=machine.Timer.ONE_SHOT, callback=lambda t: log.append(1))
b = machine.Timer(period=1000, mode=machine.Timer.ONE_SHOT, callback=lambda t: log.append(2))
""")
    board.advance_timer(500_000)
    board.run_for(1e6)
    assert board.exec("print(log)") == "[1]\n"
    board.run_for(400e6)
    assert board.exec("print(log)") == "[1]\n"
    board.run_for(150e6)
    assert board.exec("print(log)") == "[1, 2]\n"


def test_alarms_fire_on_the_microsecond(board: Board):
    board.write32(0x4005403C, 0)  # not the SDK's interrupt: only the raw flag is looked at
    target = (board.read32(TIMERAWL) + 10) & 0xFFFFFFFF
    board.write32(0x4005401C, target)  # ALARM3
    while not board.read32(0x40054034) & 1 << 3:
        assert board.read32(TIMERAWL) < target
        board.run_for(8)
    assert board.read32(TIMERAWL) == target


def test_viper_reads_the_timer_and_systick_counts_cycles(board: Board):
    out = board.exec("""
import time
from machine import mem32
mem32[0xE000E014] = 0xFFFFFF
mem32[0xE000E018] = 0
mem32[0xE000E010] = 5
@micropython.viper
def spin(n: int) -> int:
    tick = ptr32(0xE000E018)
    a = tick[0]
    while n:
        n -= 1
    b = tick[0]
    return (a - b) & 0xFFFFFF
@micropython.viper
def us() -> int:
    return ptr32(0x40054028)[0]
t = time.ticks_us()
d = us() - t
print(spin(100), spin(200), 0 <= d < 200)
""")
    short, long, close = out.split()
    assert close == "True"
    assert (int(long) - int(short)) % 100 == 0  # whole cycles a turn
    assert 5 <= (int(long) - int(short)) // 100 <= 20


def script(image: Path) -> tuple[object, ...]:
    board = Board(image)
    board.boot()
    wire = Wire(board, 2)
    board.start("""
from machine import Pin
import time
p = Pin(2, Pin.IN)
n = 0
def count(pin):
    global n
    n += 1
p.irq(count, Pin.IRQ_FALLING, hard=True)
q = Pin(6, Pin.OUT)
for i in range(50):
    q.toggle()
    time.sleep_us(137)
print(n)
""")
    edges: list[tuple[float, bool | None]] = []
    board.pin(6).watch(lambda t_ns, level: edges.append((t_ns, level)))
    for number in range(10):
        wire.send(bytes([number, 0x55]), gap_ns=12_345.6)
        board.run_for(1.5e6)
    return board.result(), board.cycles, board.now_ns, edges, wire.edges


def test_two_runs_are_identical(micropython_image: Path):
    first, second = script(micropython_image), script(micropython_image)
    assert first == second
    assert len(first[3]) == 51  # type: ignore[arg-type]
