"""boards/*: that they say what the data sheets say, and that their defaults can be."""

import json
import re
from collections import Counter
from collections.abc import Iterator

import pytest

from ghst_tools import boards, device_files
from ghst_tools.chips import CHIPS

ROOT = boards.checkout()
ALL = boards.names()
RP2 = [name for name in ALL if CHIPS[boards.load(name).chip].is_rp2]
ESP32 = [name for name in ALL if name not in RP2]

# RP2040 datasheet, table "General Purpose Input/Output (GPIO) User Bank Functions": UART (F2),
# I2C (F3), PWM (F4). The table of the RP2350 has the same in these columns.
FUNCTIONS = """
UART0 TX  I2C0 SDA PWM0 A | UART0 RX  I2C0 SCL PWM0 B | UART0 CTS I2C1 SDA PWM1 A
UART0 RTS I2C1 SCL PWM1 B | UART1 TX  I2C0 SDA PWM2 A | UART1 RX  I2C0 SCL PWM2 B
UART1 CTS I2C1 SDA PWM3 A | UART1 RTS I2C1 SCL PWM3 B | UART1 TX  I2C0 SDA PWM4 A
UART1 RX  I2C0 SCL PWM4 B | UART1 CTS I2C1 SDA PWM5 A | UART1 RTS I2C1 SCL PWM5 B
UART0 TX  I2C0 SDA PWM6 A | UART0 RX  I2C0 SCL PWM6 B | UART0 CTS I2C1 SDA PWM7 A
UART0 RTS I2C1 SCL PWM7 B | UART0 TX  I2C0 SDA PWM0 A | UART0 RX  I2C0 SCL PWM0 B
UART0 CTS I2C1 SDA PWM1 A | UART0 RTS I2C1 SCL PWM1 B | UART1 TX  I2C0 SDA PWM2 A
UART1 RX  I2C0 SCL PWM2 B | UART1 CTS I2C1 SDA PWM3 A | UART1 RTS I2C1 SCL PWM3 B
UART1 TX  I2C0 SDA PWM4 A | UART1 RX  I2C0 SCL PWM4 B | UART1 CTS I2C1 SDA PWM5 A
UART1 RTS I2C1 SCL PWM5 B | UART0 TX  I2C0 SDA PWM6 A | UART0 RX  I2C0 SCL PWM6 B
"""
ADC = {26: "adc0", 27: "adc1", 28: "adc2", 29: "adc3"}


def datasheet() -> list[set[str]]:
    """For each GPIO of the RP2 chips, its functions as board.json spells them."""
    rows = []
    for gpio, cell in enumerate(re.split(r"[|\n]", FUNCTIONS.strip())):
        uart, uart_signal, i2c, i2c_signal, pwm, output = cell.split()
        row = {f"{i2c.lower()} {i2c_signal.lower()}", pwm.lower() + output}
        if uart_signal in ("TX", "RX"):
            row.add(f"{uart.lower()} {uart_signal.lower()}")
        rows.append(row | ({ADC[gpio]} if gpio in ADC else set()))
    return rows


def uses(board: boards.Board) -> Iterator[tuple[int, str]]:
    """Each pin of the defaults, and the function that it needs: a regular expression."""
    rp2 = CHIPS[board.chip].is_rp2

    def bus(kind: str, number: int, signal: str) -> str:
        return f"{kind}{number} {signal}" if rp2 else kind

    for section, options in board.defaults.items():
        if section == "wire":
            yield options["pin"], "gpio" if options["driver"] == "pio" else "uart"
            if options["driver"] == "uart":
                yield options["tx_pin"], "uart"
        elif section == "outputs":
            for gpio in options:
                yield int(gpio), r"pwm\d[AB]" if rp2 else "ledc"
        elif section == "led":
            yield options["pin"], "led"
        elif section == "battery":
            yield options["voltage_pin"], r"adc\d?"
            if "current_pin" in options:
                yield options["current_pin"], r"adc\d?"
        elif section == "gps":
            yield options["tx_pin"], bus("uart", options["uart"], "tx")
            yield options["rx_pin"], bus("uart", options["uart"], "rx")
        elif section == "i2c":
            yield options["sda_pin"], bus("i2c", options["bus"], "sda")
            yield options["scl_pin"], bus("i2c", options["bus"], "scl")
        else:
            assert section in ("barometer", "magnetometer") and "i2c" in board.defaults


def test_there_are_the_eight() -> None:
    assert ALL == [
        "adafruit_itsybitsy_rp2040",
        "esp32_c3_supermini",
        "esp32_devkit",
        "esp32_s3_devkit",
        "rpi_pico",
        "rpi_pico2",
        "seeed_xiao_rp2040",
        "waveshare_rp2040_zero",
    ]


@pytest.mark.parametrize("name", RP2)
def test_functions_are_those_of_the_datasheet(name: str) -> None:
    table = datasheet()
    assert len(table) == 30
    for gpio, pin in boards.load(name).pins.items():
        functions = set(pin.functions)
        reached = functions & {"gpio", "input", "output"}
        if reached == {"gpio"}:
            assert functions - {"gpio", "led"} == table[gpio], gpio
        else:
            pwm = {function for function in table[gpio] if function.startswith("pwm")}
            assert functions in ({"led"}, {"output"} | pwm), gpio


def test_the_pins_of_the_esp32_that_are_not_safe_are_not_offered() -> None:
    # ESP-IDF, "GPIO & RTC GPIO": strapping pins, SPI0/1 (flash and PSRAM), USB, console.
    unsafe = {
        "esp32_devkit": {0, 2, 5, 12, 15} | set(range(6, 12)) | {1, 3} | {20, 24, 28, 29, 30, 31},
        "esp32_s3_devkit": {0, 3, 45, 46} | set(range(22, 38)) | {19, 20, 43, 44},
        "esp32_c3_supermini": {2, 8, 9} | set(range(11, 18)) | {18, 19, 20, 21},
    }
    input_only = {"esp32_devkit": {34, 35, 36, 37, 38, 39}}
    adc = {
        "esp32_devkit": set(range(32, 40)),
        "esp32_s3_devkit": set(range(1, 11)),
        "esp32_c3_supermini": set(range(5)),
    }
    for name in ESP32:
        pins = boards.load(name).pins
        assert len(pins) >= 9
        for gpio, pin in pins.items():
            assert gpio not in unsafe[name] or pin.functions == ("led",)
            assert ("input" in pin.functions) is (gpio in input_only.get(name, ()))
            assert ("adc" in pin.functions) is (gpio in adc[name])


@pytest.mark.parametrize("name", ALL)
def test_the_defaults_ask_of_a_pin_only_what_it_can(name: str) -> None:
    board = boards.load(name)
    for gpio, wanted in uses(board):
        assert any(re.fullmatch(wanted, function) for function in board.pins[gpio].functions), (
            gpio,
            wanted,
        )
    channels = [output["channel"] for output in board.defaults["outputs"].values()]
    assert channels == list(range(1, len(channels) + 1))
    assert len(channels) <= CHIPS[board.chip].outputs.channels
    if CHIPS[board.chip].is_rp2:
        pwm = Counter(int(gpio) % 16 for gpio in board.defaults["outputs"])
        assert set(pwm.values()) == {1}  # no two of one output
    if board.defaults["wire"]["driver"] == "uart":
        assert board.defaults["wire"]["uart"] != board.defaults.get("gps", {}).get("uart")
        assert board.defaults["wire"]["uart"] != 0  # the console
    if "i2c" in board.defaults and CHIPS[board.chip].is_rp2:
        assert board.defaults["i2c"]["bus"] in (0, 1)


@pytest.mark.parametrize("name", RP2)
def test_the_self_test_takes_a_pin_that_is_free_or_the_gps_s(name: str) -> None:
    board = boards.load(name)
    pin = board.selftest_pin
    assert pin is not None
    gps = {board.defaults["gps"]["tx_pin"], board.defaults["gps"]["rx_pin"]}
    assert pin not in {gpio for gpio, _ in uses(board)} - gps
    assert "gpio" in board.pins[pin].functions
    # Only the XIAO has no other.
    assert (pin in gps) is (name == "seeed_xiao_rp2040")


@pytest.mark.parametrize("name", ESP32)
def test_without_pio_there_is_no_self_test(name: str) -> None:
    assert boards.load(name).selftest_pin is None


@pytest.mark.parametrize("name", ALL)
def test_the_wiring_is_that_of_the_defaults(name: str) -> None:
    board = boards.load(name)
    wire = board.defaults["wire"]
    rows = [row for row in board.wiring if row.source == "receiver Tx"]
    assert [row.to for row in rows if not row.part] == [board.label(wire["pin"])]
    diodes = [row.to for row in rows if row.part == "Schottky diode"]
    pull_ups = [(row.part, row.optional) for row in rows if row.part.endswith("kOhm")]
    if name in RP2:
        assert (diodes, pull_ups) == ([], [("10 kOhm", True)])
    else:
        assert (diodes, pull_ups) == ([board.label(wire["tx_pin"])], [("2.2 kOhm", False)])


def test_the_pico_does_by_default_what_it_did() -> None:
    defaults = boards.load("rpi_pico").defaults
    assert defaults == {
        "wire": {"driver": "pio", "pin": 2},
        "led": {"pin": 25},
        "outputs": {str(gpio): {"channel": gpio - 5} for gpio in range(6, 14)},
        "battery": {
            "voltage_pin": 26,
            "divider": 11.0,
            "current_pin": 27,
            "current_mv_per_a": 40,
        },
        "gps": {"uart": 0, "tx_pin": 0, "rx_pin": 1},
        "i2c": {"bus": 0, "sda_pin": 4, "scl_pin": 5},
        "barometer": {},
        "magnetometer": {},
    }
    assert boards.load("rpi_pico2").defaults == defaults


# ports/rp2/boards/*/mpconfigboard.h and ports/esp32/partitions-*.csv of MicroPython 1.25.
FLASH = {
    "adafruit_itsybitsy_rp2040": (8 << 20, 7 << 20),
    "esp32_c3_supermini": (4 << 20, 2 << 20),
    "esp32_devkit": (4 << 20, 2 << 20),
    "esp32_s3_devkit": (8 << 20, 6 << 20),
    "rpi_pico": (2 << 20, 1408 << 10),
    "rpi_pico2": (4 << 20, 3 << 20),
    "seeed_xiao_rp2040": (2 << 20, 1408 << 10),
    "waveshare_rp2040_zero": (2 << 20, 1408 << 10),
}


@pytest.mark.parametrize("name", ALL)
def test_the_file_system_ends_with_the_flash(name: str) -> None:
    board = boards.load(name)
    flash, size = FLASH[name]
    assert (board.filesystem_offset, board.filesystem_size) == (flash - size, size)


@pytest.mark.parametrize("name", ALL)
def test_what_the_device_gets(name: str) -> None:
    board = boards.load(name)
    file = json.loads(board.definition)
    assert len(board.definition) < 1500
    assert (file["name"], file["title"], file["chip"]) == (name, board.title, board.chip)
    assert file["defaults"] == board.defaults
    for gpio, pin in board.pins.items():
        assert file["labels"].get(str(gpio), f"GP{gpio}") == pin.label
        found = {function for function, pins in file["functions"].items() if gpio in pins}
        left_out = {f for f in pin.functions if f.startswith(("pwm", "ledc"))}
        assert found == {re.sub(r"adc\d", "adc", f) for f in pin.functions} - left_out
        # Which pins can give servo pulses, needs no list of its own.
        assert bool(left_out) is bool(found & {"gpio", "output"})
        if CHIPS[board.chip].is_rp2 and left_out:
            assert left_out == {f"pwm{gpio >> 1 & 7}{'AB'[gpio & 1]}"}


@pytest.mark.parametrize("name", ALL)
def test_it_compiles_for_every_board(name: str) -> None:
    board = boards.load(name)
    files = device_files.collect(board)
    code = {path: data for path, data in files.items() if path.endswith(".mpy")}
    modules = device_files.library_modules() + device_files.firmware_modules(board=board)
    assert len(code) == len(modules)
    # Header of a .mpy: the architecture in bits 2-5 of the third byte, none without native code.
    number = {"armv6m": 4, "armv7emsp": 7, "xtensawin": 10, "rv32imc": 11}[board.mpy_arch]
    assert {data[2] >> 2 & 15 for data in code.values()} == {0, number}
