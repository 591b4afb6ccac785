"""Battery voltage and current on the emulated chip: its ADC, its watchdog, frames meanwhile."""

import random
from collections.abc import Iterator
from pathlib import Path

import pytest
from rig import NO_SENSORS, SERVOS, Pico

import ghst
from ghst_tools import boards, filesystem
from ghst_tools.emulator import Board

SCRATCH = 0x4005800C
CENTRE = ghst.encode.channels(0x30, (2048,) * 4, (128,) * 4)


def read_u16(volts: float) -> int:
    """What `machine.ADC.read_u16` makes of a voltage at the pin: 12 bits, stretched to 16."""
    code = min(max(int(volts / 3.3 * 4096), 0), 4095)
    return code << 4 | code >> 8


def in_units(volts: float, full_scale: int) -> int:
    """`volts` at the pin, as a fraction of `full_scale` rounded half up."""
    return (2 * read_u16(volts) * full_scale + 65536) // (2 * 65536)


@pytest.fixture(scope="module")
def module_board(micropython_image: Path, firmware_files: dict[str, bytes]) -> Board:
    """A board at the prompt with the firmware in its flash."""
    files = {path: content for path, content in firmware_files.items() if path != "/main.py"}
    size = boards.load("rpi_pico").filesystem_size
    board = Board(micropython_image, filesystem.build(files, size))
    board.boot()
    board.exec(
        "import machine, micropython, time\n"
        "from firmware.scratch import Scratch\n"
        "from firmware.sensors.battery import Battery\n"
        "voltage, current = machine.ADC(26), machine.ADC(27)\n"
        "def run(battery, values, pause_ms=10):\n"
        "    while values:\n"
        "        values -= battery.update(time.ticks_ms())\n"
        "        time.sleep_ms(pause_ms)\n"
    )
    return board


@pytest.fixture
def board(module_board: Board) -> Iterator[Board]:
    """The same board with nothing on its inputs and in its scratch registers."""
    for channel in (0, 1):
        module_board.adc(channel).set_volts(0.0)
        module_board.adc(channel).offset_volts = 0.0
        module_board.adc(channel).noise_volts = None
    for number in range(4):
        module_board.write32(SCRATCH + 4 * number, 0)
    yield module_board


def values(board: Board, options: str = "", count: int = 2) -> list[int]:
    """Voltage, current and faults of a new battery after its first `count` values."""
    printed = board.exec(
        f"battery = Battery(voltage, current, {options})\nrun(battery, {count})\n"
        "print(battery.voltage_mv, battery.current_ma, battery.faults)"
    )
    return [int(word) for word in printed.split()]


@pytest.mark.parametrize("volts", [0.0, 0.0004, 0.1, 1.0, 1.5272, 2.345, 3.2985, 3.2993])
def test_a_constant_voltage_is_exact(board: Board, volts: float) -> None:
    board.adc(0).set_volts(volts)
    board.adc(1).set_volts(3.3 - volts)
    # The ADC's own errors are allowed for: up to 6 mV below its range is the end.
    faults = (volts > 3.293) + (volts < 0.007)
    assert values(board) == [in_units(volts, 36300), in_units(3.3 - volts, 82500), faults]


@pytest.mark.parametrize("volts", [-1.0, 5.0])
def test_a_voltage_outside_the_range_reads_as_its_end(board: Board, volts: float) -> None:
    board.adc(0).set_volts(volts)
    board.adc(1).set_volts(volts)
    assert values(board) == ([0, 0, 0] if volts < 0 else [36299, 82499, 2])


def test_a_sensor_for_both_directions(board: Board) -> None:
    for volts in (0.11, 0.5, 1.65, 2.9):
        board.adc(1).set_volts(volts)
        found = values(board, "current_mv_per_a=66, current_offset_mv=1650")[1]
        assert found == in_units(volts, 50000) - 25000
        # One step of the ADC is 0.8 mV, 12 mA here.
        assert found == pytest.approx((volts * 1000 - 1650) / 0.066, abs=13)


def test_a_sensor_for_both_directions_without_its_supply(board: Board) -> None:
    """At 0 V a real ADC reads some mV: it has an offset, and noise."""
    noise = random.Random(5)
    board.adc(1).offset_volts = 0.017
    board.adc(1).noise_volts = lambda: noise.gauss(0, 0.004)
    board.adc(1).set_volts(2.45)
    board.exec(
        "battery = Battery(None, current, current_offset_mv=1650)\n"
        "battery.consumed_mah = 1234\n"
        "run(battery, 100, 20)\n"
    )
    held, faults = board.exec("print(battery.consumed_mah, battery.faults)").split()
    assert (int(held), faults) == (pytest.approx(1245, abs=2), "0")
    for volts in (0.0, 0.05):
        board.adc(1).set_volts(volts)
        board.exec("run(battery, 100, 20)")
        printed = board.exec("print(battery.current_ma, battery.consumed_mah, battery.faults)")
        faults = int(faults) + 100
        assert printed.split() == ["None", held, str(faults)]
    board.adc(1).set_volts(2.45)
    board.exec("run(battery, 20, 20)")
    assert int(board.exec("print(battery.current_ma)")) == pytest.approx(20_400, abs=100)


def test_noise_is_averaged(board: Board) -> None:
    noise = random.Random(1)
    board.adc(0).set_volts(lambda t_ns: 1.5 + noise.gauss(0, 0.010))
    board.adc(1).set_volts(lambda t_ns: 0.8 + noise.gauss(0, 0.010))
    printed = board.exec(
        "battery = Battery(voltage, current)\n"
        "for _ in range(24):\n"
        "    run(battery, 2)\n"
        "    print(battery.voltage_mv, battery.current_ma)\n"
    )
    pairs = [[int(word) for word in line.split()] for line in printed.splitlines()]
    # 10 mV at the pin are 110 mV or 250 mA; 32 samples and smoothing over four leave a 15th.
    for found, mean, spread in ((0, 16500, 110), (1, 20000, 250)):
        settled = [pair[found] for pair in pairs[8:]]
        assert all(abs(value - mean) < spread / 2 for value in settled), settled
        assert sum(settled) / len(settled) == pytest.approx(mean, abs=spread / 10)


def test_a_slope_is_followed_with_80_ms_of_delay(board: Board) -> None:
    start_ns = board.now_ns
    # 11 V a second at the battery.
    board.adc(0).set_volts(lambda t_ns: 0.5 + (t_ns - start_ns) / 1e9)
    board.exec("battery = Battery(voltage)\nrun(battery, 40, 20)\nlast_mv = battery.voltage_mv")
    now_v = 0.5 + (board.now_ns - start_ns) / 1e9
    found_v = int(board.exec("print(last_mv)")) / 11000
    assert 0.05 < now_v - found_v < 0.15


def test_no_call_is_long(board: Board) -> None:
    board.adc(0).set_volts(1.5)
    board.adc(1).set_volts(0.8)
    printed = board.exec(
        "battery = Battery(voltage, current, cells=3, store=Scratch())\n"
        "longest_us = 0\n"
        "@micropython.native\n"
        "def measure():\n"
        "    global longest_us\n"
        "    for _ in range(40):\n"
        "        time.sleep_ms(10)\n"
        "        begun_us = time.ticks_us()\n"
        "        battery.update(time.ticks_ms())\n"
        "        longest_us = max(longest_us, time.ticks_diff(time.ticks_us(), begun_us))\n"
        "micropython.heap_lock()\n"
        "measure()\n"
        "micropython.heap_unlock()\n"
        "print(longest_us)"
    )
    assert 300 < int(printed) < 800


def test_charge_is_the_integral_over_time(board: Board) -> None:
    board.adc(1).set_volts(3.2)
    printed = board.exec(
        "battery = Battery(None, current)\n"
        "begun_ms = now_ms = time.ticks_ms()\n"
        "while battery.consumed_mah < 50:\n"
        "    now_ms = time.ticks_ms()\n"
        "    battery.update(now_ms)\n"
        "    time.sleep_ms(20)\n"
        "print(time.ticks_diff(now_ms, begun_ms))\n"
    )
    # 50 mAh = 180e6 mA ms; a value comes every 20 ms.
    full_ms = 180e6 / in_units(3.2, 82500)
    assert full_ms <= int(printed) <= full_ms + 21


def test_charge_of_a_current_that_changes(board: Board) -> None:
    noise = random.Random(2)
    start_ns = board.now_ns

    def volts(t_ns: float) -> float:
        # Bursts of throttle, 0.3 s each.
        burst = int((t_ns - start_ns) / 0.3e9) % 2
        return (2.4 if burst else 0.8) + noise.uniform(-0.05, 0.05)

    board.adc(1).set_volts(volts)
    printed = board.exec(
        "battery = Battery(voltage, current)\n"
        "begun_ms = time.ticks_ms()\n"
        "while time.ticks_diff(time.ticks_ms(), begun_ms) < 3000:\n"
        "    battery.update(time.ticks_ms())\n"
        "    time.sleep_ms(20)\n"
        "print(battery.consumed_mah)"
    )
    # 40 A for three seconds.
    assert int(printed) == pytest.approx(40000 * 3 / 3600, abs=2)


def test_scratch_keeps_a_number(board: Board) -> None:
    assert board.exec("scratch = Scratch()\nprint(scratch.load())") == "None\n"
    for number in (0, 1, 12345678, (1 << 30) - 1):
        assert board.exec(f"scratch.save({number})\nprint(scratch.load())") == f"{number}\n"
    # Saving takes no memory, and nobody but us has written there.
    board.exec("micropython.heap_lock()\nscratch.save((1 << 30) - 1)\nmicropython.heap_unlock()")
    check = (1 << 30) - 1 ^ 0x2B3C95A6
    found = [board.read32(SCRATCH + 4 * number) for number in range(4)]
    assert found == [(1 << 30) - 1, check] * 2


def test_scratch_survives_a_reset_in_the_middle_of_saving(board: Board) -> None:
    board.exec("scratch = Scratch()\nscratch.save(1000)")
    before = [board.read32(SCRATCH + 4 * number) for number in range(4)]
    board.exec("scratch.save(1001)")
    after = [board.read32(SCRATCH + 4 * number) for number in range(4)]
    for written in range(5):
        for number, value in enumerate(after[:written] + before[written:]):
            board.write32(SCRATCH + 4 * number, value)
        found = int(board.exec("print(scratch.load())"))
        assert found == (1000 if written < 2 else 1001)


def test_scratch_does_not_take_noise_for_a_number(board: Board) -> None:
    noise = random.Random(3)
    for _ in range(5):
        for number in range(4):
            board.write32(SCRATCH + 4 * number, noise.getrandbits(32))
        assert board.exec("print(Scratch().load())") == "None\n"


FLY_AND_HANG = """
import machine, time
from firmware.scratch import Scratch
from firmware.sensors.battery import Battery
battery = Battery(machine.ADC(26), machine.ADC(27), store=Scratch())
print("begins with", battery.cell_count, battery.consumed_mah)
watchdog = machine.WDT(timeout=1000)
for _ in range(110):
    watchdog.feed()
    battery.update(time.ticks_ms())
    time.sleep_ms(20)
print("hangs with", battery.cell_count, battery.consumed_mah)
while True:
    battery.update(time.ticks_ms())
    time.sleep_ms(20)
"""


def begins_with(board: Board) -> str:
    """Run a board with FLY_AND_HANG until it says what it has loaded."""
    start = len(board.console.output)
    board.boot(until=b"begins with")
    board.run_for(2e6)
    return bytes(board.console.output[start:]).partition(b"begins with ")[2].decode().strip()


def test_charge_survives_the_watchdog_but_no_loss_of_power(
    micropython_image: Path, firmware_files: dict[str, bytes]
) -> None:
    files = firmware_files | {"/main.py": FLY_AND_HANG.encode()}
    size = boards.load("rpi_pico").filesystem_size
    board = Board(micropython_image, filesystem.build(files, size))
    board.adc(0).set_volts(16.0 / 11)
    board.adc(1).set_volts(3.2)
    assert begins_with(board) == "None 0"
    board.run_until(lambda: bool(board.resets), 5e9)
    assert board.resets[0][1] == "timer"
    hung = bytes(board.console.output).partition(b"hangs with ")[2].split()
    assert hung[0] == b"4"
    # It went on measuring until the reset: 22 mAh a second.
    mah = int(begins_with(board).removeprefix("4 "))
    assert int(hung[1]) + 20 <= mah <= int(hung[1]) + 24
    board.power_cycle()
    assert begins_with(board) == "None 0"


@pytest.mark.parametrize(("pause_s", "mah"), [(0.3, 1500), (3.3, 0)])
def test_what_was_stored_holds_unless_no_battery_is_seen_for_three_seconds(
    micropython_image: Path, firmware_files: dict[str, bytes], pause_s: float, mah: int
) -> None:
    size = boards.load("rpi_pico").filesystem_size
    pico = Pico(micropython_image, firmware_files, size)
    pico.boot(NO_SENSORS | {"battery": {}})
    board = pico.board
    stored = 4 << 20 | 1500
    for number in range(4):
        board.write32(SCRATCH + 4 * number, stored ^ (0x2B3C95A6 if number & 1 else 0))
    board.run_for(pause_s * 1e9)
    board.adc(0).set_volts(16.7 / 11)
    board.run_for(400e6)
    assert f"16.70 V, 0.0 A, {mah} mAh" in pico.reply_to_enter()


# Its own loop inside the rig's, after what is made once; the longest call is printed.
LOOP = """
    import machine
    from firmware.scratch import Scratch
    from firmware.sensors.battery import Battery
    battery = Battery(machine.ADC(26), machine.ADC(27), store=Scratch())
    longest_us = rounds = new = 0
    while True:
        adapter.poll()
        now_us = time.ticks_us()
        new += battery.update(time.ticks_ms())
        longest_us = max(longest_us, time.ticks_diff(time.ticks_us(), now_us))
        rounds += 1
        if rounds == 50:
            print("new", new, "longest", longest_us, "end")
        time.sleep_ms(2)
"""


@pytest.mark.run(LOOP)
def test_no_frame_is_lost_while_the_inputs_go_mad_and_the_adc_dies(pico: Pico) -> None:
    noise = random.Random(4)
    for channel in (0, 1):
        pico.board.adc(channel).set_volts(lambda t_ns: noise.choice((-9.0, 0.0, 1.7, 3.3, 12.0)))
    receiver = pico.fly(lambda index, t: CENTRE if index < 150 else None, 500)
    pico.board.run_until(lambda: b"end" in pico.board.console.output, 1e9)
    words = bytes(pico.board.console.output).split()
    assert int(words[words.index(b"new") + 1]) >= 8
    # Two or three frame interrupts of 35 us may fall into a call.
    assert 300 < int(words[words.index(b"longest") + 1]) < 1000
    # A conversion that never ends holds the main loop, and nothing else.
    begun: list[int] = []
    pico.board.mcu.adc.on_adc_read = begun.append
    pico.board.run_for(310e6 - (pico.board.now_ns - receiver.sent[0].end_ns))
    assert len(begun) == 1
    latencies = pico.latencies_us(receiver)
    assert len(latencies) == 150
    assert pico.word(ghst.decoder.FRAMES) == 150
    assert pico.word(ghst.decoder.SKIPPED_BYTES) == 0
    assert max(latency or 1e9 for latency in latencies) <= 35.0
    for pin in SERVOS:
        assert {round(pulse.width_ns) for pulse in pico.meter.pulses[pin]} == {1_500_000}
