"""The emulated I2C sensors: what they answer, and what they do not let pass."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import pytest

from ghst_tools.emulator import Board
from ghst_tools.emulator.i2c_barometers import Dps310, Lps22hb
from ghst_tools.emulator.i2c_bmp280 import Bmp280
from ghst_tools.emulator.i2c_hmc5883l import Hmc5883l
from ghst_tools.emulator.i2c_magnetometers import Lis3mdl, Qmc5883l
from ghst_tools.emulator.i2c_sensors import (
    RegisterTarget,
    SensorMisuse,
    field_at,
    pressure_at,
)


class Clock:
    now_ns = 0.0


def read(target: RegisterTarget, register: int, count: int = 1) -> bytes:
    assert target.start(False) and target.write(register) and target.start(True)
    values = bytes(target.read() for _ in range(count))
    target.stop()
    return values


def write(target: RegisterTarget, register: int, *values: int) -> None:
    assert target.start(False) and target.write(register)
    for value in values:
        assert target.write(value)
    target.stop()


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def bmp280(clock: Clock) -> Bmp280:
    """A BMP280 that has started up, without noise."""
    chip = Bmp280(clock, lambda t_ns: 100_653.27, lambda t_ns: 25.0825)
    chip.noise_pa = 0.0
    clock.now_ns = 3e6
    return chip


def test_bmp280_gives_the_raw_values_of_its_data_sheet(bmp280: Bmp280, clock: Clock):
    write(bmp280, 0xF4, 5 << 5 | 5 << 2 | 1)
    assert read(bmp280, 0xF3) == b"\x08"
    clock.now_ns += 66e6
    assert read(bmp280, 0xF3, 2) == bytes((0, 5 << 5 | 5 << 2))
    data = read(bmp280, 0xF7, 6)
    assert int.from_bytes(data[:3], "big") >> 4 == 415_148
    assert int.from_bytes(data[3:], "big") >> 4 == 519_888


def test_a_sensor_needs_its_time_and_its_power(bmp280: Bmp280, clock: Clock):
    write(bmp280, 0xE0, 0xB6)
    assert not bmp280.start(False)
    clock.now_ns += 2e6
    assert read(bmp280, 0xD0) == b"\x58"
    write(bmp280, 0xF5, 0x10)
    bmp280.unplug()
    assert not bmp280.start(False)
    bmp280.plug_in()
    clock.now_ns += 2e6
    assert read(bmp280, 0xF5) == b"\x00"


MISUSE: dict[str, tuple[type[RegisterTarget], Callable[[RegisterTarget], object], str]] = {
    "no such register": (Bmp280, lambda chip: read(chip, 0xF6), "0xf6 does not exist"),
    "read only": (Bmp280, lambda chip: write(chip, 0xF7, 1), "0xf7 cannot be written"),
    "no register": (Bmp280, lambda chip: chip.start(True), "without a register"),
    "too early": (Bmp280, lambda chip: read(chip, 0xF7), "no measurement yet"),
    "only pressure": (Bmp280, lambda chip: write(chip, 0xF4, 0x11), "without pressure or temp"),
    "again": (Bmp280, lambda chip: write(chip, 0xF4, 0x25, 0xF4, 0x25), "during a measurement"),
    "coefficients": (Dps310, lambda chip: read(chip, 0x10), "coefficients were not ready"),
    "no pressure": (Dps310, lambda chip: read(chip, 0x00), "no pressure yet"),
    "not ready": (Dps310, lambda chip: write(chip, 0x08, 7), "before the sensor is ready"),
    "lps": (Lps22hb, lambda chip: read(chip, 0x28), "no measurement yet"),
    "low noise": (Lps22hb, lambda chip: write(chip, 0x11, 0x12), "CTRL_REG2 is 0x12"),
    "set/reset": (Qmc5883l, lambda chip: write(chip, 0x09, 0x15), "set/reset period"),
    "qmc": (Qmc5883l, lambda chip: read(chip, 0x00), "no measurement yet"),
    "hmc": (Hmc5883l, lambda chip: read(chip, 0x03), "no measurement yet"),
    "lis": (Lis3mdl, lambda chip: read(chip, 0xA8, 6), "no measurement yet"),
    "lis gap": (Lis3mdl, lambda chip: read(chip, 0xA4, 2), "0x25 does not exist"),
}


@pytest.mark.parametrize("name", MISUSE)
def test_misuse_is_an_error(clock: Clock, name: str):
    kind, use, message = MISUSE[name]
    if kind in (Bmp280, Dps310, Lps22hb):
        chip = kind(clock, lambda t_ns: 1e5, lambda t_ns: 20.0)  # type: ignore[call-arg]
    else:
        chip = kind(clock, lambda t_ns: field_at(0))  # type: ignore[arg-type, call-arg]
    clock.now_ns = 3e6
    with pytest.raises(SensorMisuse, match=message):
        use(chip)


def hmc(clock: Clock, mode: int) -> Hmc5883l:
    """A chip of 820 LSB per gauss; each measurement gives the same new number on all axes."""
    numbers = itertools.count(1)
    chip = Hmc5883l(clock, lambda t_ns: (next(numbers) * 1e5 / 820,) * 3)
    chip.noise_nt = 0.0
    write(chip, 0x00, 6 << 2, 2 << 5, mode)
    return chip


def test_an_hmc5883l_writes_its_words_one_by_one(clock: Clock):
    chip = hmc(clock, 0)
    clock.now_ns += 2 * 1e9 / 75 + 251e3
    # The first had the gain of power-on.
    assert (read(chip, 0x09), read(chip, 0x03, 6)) == (b"\1", b"\0\2\0\2\0\2")
    clock.now_ns += 1e9 / 75 - 151e3
    assert (read(chip, 0x09), read(chip, 0x03, 2)) == (b"\0", b"\0\3")
    # What would be written while not all has been read is lost.
    clock.now_ns += 300e3
    for _ in range(2):
        assert (read(chip, 0x03, 6), read(chip, 0x09)) == (b"\0\3\0\2\0\2", b"\1")


def test_an_hmc5883l_locks_its_registers(clock: Clock):
    chip = hmc(clock, 0)
    clock.now_ns += 2 * 1e9 / 75 + 251e3
    assert (read(chip, 0x02), read(chip, 0x09)) == (b"\0", b"\3")
    clock.now_ns += 1e9
    assert read(chip, 0x03, 6) == b"\0\2\0\2\0\2"
    clock.now_ns += 1e9
    assert read(chip, 0x09) == b"\1"
    assert read(chip, 0x03) + read(chip, 0x03, 6) != b"\0\2" * 3


def test_an_hmc5883l_measures_once(clock: Clock):
    chip = hmc(clock, 1)
    clock.now_ns += 1e9
    assert (read(chip, 0x02), chip.measurements) == (b"\3", 1)
    write(chip, 0x02, 1)
    clock.now_ns += 13e6
    assert chip.measurements == 1
    clock.now_ns += 1e6
    assert (read(chip, 0x03, 6), chip.measurements) == (b"\0\2\0\2\0\2", 2)


def test_the_standard_atmosphere():
    assert pressure_at(0) == 101_325
    assert pressure_at(1000) == pytest.approx(89_874.6, abs=0.1)
    assert pressure_at(5000) == pytest.approx(54_020, abs=1)


def test_the_field_of_a_level_sensor():
    assert field_at(0) == pytest.approx((20_000, 0, -44_000))
    # Nose to the east: north is on the left.
    assert field_at(90, hard_iron_nt=(1, 2, 3)) == pytest.approx((1, 20_002, -43_997))


def test_sda_is_held_until_it_has_been_clocked_free(board: Board):
    bus = board.i2c(0)
    with pytest.raises(ValueError, match="connect the bus"):
        bus.hold_sda(9)
    bus.connect(board.pin(4), board.pin(5))
    bus.hold_sda(3)
    levels = board.exec("""
from machine import Pin
sda = Pin(4, Pin.OPEN_DRAIN, value=1)
scl = Pin(5, Pin.OPEN_DRAIN, value=1)
levels = [sda.value()]
for n in range(4):
    scl.value(0)
    levels.append(sda.value())
    scl.value(1)
print(levels)
""")
    assert levels == "[0, 0, 0, 1, 1]\n"
    assert not bus.stuck
