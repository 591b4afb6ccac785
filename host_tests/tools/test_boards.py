"""boards/<name>/board.json, and what it says of the Pico."""

import json
from pathlib import Path

import pytest

from ghst_tools import boards
from ghst_tools.errors import GhstError


def write_board(root: Path, text: str) -> None:
    folder = root / "boards" / "test"
    folder.mkdir(parents=True)
    (folder / "board.json").write_text(text)


def test_the_pico() -> None:
    board = boards.load("rpi_pico")
    assert (board.chip, board.mpy_arch) == ("rp2040", "armv6m")
    # ports/rp2: the file system is the last 1408 KiB of the 2 MiB flash.
    assert (board.filesystem_offset, board.filesystem_size) == (0xA0000, 352 * 4096)
    assert board.filesystem_offset + board.filesystem_size == 2 * 1024 * 1024


def test_the_rows_of_the_pico() -> None:
    board = boards.load("rpi_pico")
    assert board.pins[7] == boards.Pin("GP7", ("gpio", "pwm3B", "i2c1 scl"), "")
    assert board.label(25) == "LED"
    assert board.connection("BEC 5 V") == boards.Connection(
        "BEC 5 V",
        "VSYS",
        "Schottky diode",
        False,
        "unless USB and BEC are never plugged in at the same time",
    )
    assert board.battery_limit_v == 36


def test_the_default_board_comes_first_and_the_esp32_last() -> None:
    chips = [board.chip for board in boards.load_all()]
    assert next(boards.load_all()).name == boards.DEFAULT_BOARD
    assert [chip.startswith("esp32") for chip in chips] == sorted(
        chip.startswith("esp32") for chip in chips
    )


def test_an_unknown_board_names_the_known_ones(tmp_path: Path) -> None:
    write_board(tmp_path, "{}")
    with pytest.raises(GhstError, match=r"^unknown board 'x': known are test$"):
        boards.load("x", tmp_path)


def test_a_board_name_is_not_a_path(tmp_path: Path) -> None:
    write_board(tmp_path, "{}")
    with pytest.raises(GhstError, match="unknown board"):
        boards.load("../boards/test", tmp_path)


def test_a_missing_key_is_named(tmp_path: Path) -> None:
    write_board(tmp_path, '{"chip": "rp2040"}')
    with pytest.raises(GhstError, match=r"board\.json: the key 'mpy_arch' is missing$"):
        boards.load("test", tmp_path)


def test_broken_json_is_located(tmp_path: Path) -> None:
    write_board(tmp_path, '{\n  "chip": rp2040\n}')
    with pytest.raises(GhstError, match=r"board\.json:2: not valid JSON"):
        boards.load("test", tmp_path)


def test_a_file_that_is_no_text(tmp_path: Path) -> None:
    write_board(tmp_path, "{}")
    (tmp_path / "boards/test/board.json").write_bytes(b'{"name": "\xff"}')
    with pytest.raises(GhstError, match=r"board\.json: not valid JSON"):
        boards.load("test", tmp_path)


def changed(keys: str, value: object) -> str:
    """The Pico's file with one value, at "a.b", replaced, or removed if it is `...`."""
    path = boards.checkout() / "boards/rpi_pico/board.json"
    values = json.loads(path.read_text()) | {"name": "test"}
    *way, last = keys.split(".")
    place = values
    for key in way:
        place = place[int(key)] if isinstance(place, list) else place[key]
    if value is ...:
        del place[last]
    else:
        place[int(last) if isinstance(place, list) else last] = value
    return json.dumps(values)


@pytest.mark.parametrize(
    ("keys", "value", "line"),
    [
        ("name", "rpi_pico", "name is 'rpi_pico', must be 'test'"),
        (
            "chip",
            "stm32",
            "chip is 'stm32', must be one of rp2040, rp2350, esp32, esp32s3, esp32c3",
        ),
        (
            "mpy_arch",
            "x64",
            "mpy_arch is 'x64', must be one of armv6m, armv7emsp, xtensawin, rv32imc",
        ),
        ("title", 1, "title is 1, must be a string"),
        ("micropython", "RPI_PICO", "micropython is 'RPI_PICO', must be an object"),
        ("micropython.machine", ..., "the key 'micropython.machine' is missing"),
        ("flash.filesystem_size", 1.5, "flash.filesystem_size is 1.5, must be an integer"),
        ("flash.filesystem_size", True, "flash.filesystem_size is True, must be an integer"),
        ("colour", "green", "the key 'colour' is unknown"),
        ("selftest", ..., "the key 'selftest' is missing"),
        ("selftest.receiver_pin", "GP3", "selftest.receiver_pin is 'GP3', must be an integer"),
        ("selftest.receiver_pin", 23, "selftest.receiver_pin: GPIO 23 cannot be driven and read"),
        ("selftest.receiver_pin", 25, "selftest.receiver_pin: GPIO 25 cannot be driven and read"),
        (
            "selftest.receiver_pin",
            6,
            "selftest.receiver_pin: GPIO 6 is used by defaults.outputs.6 already",
        ),
        ("outputs_hardware.kind", "ledc", "outputs_hardware.kind is 'ledc', must be 'pwm_slices'"),
        ("outputs_hardware.channels", 24, "outputs_hardware.channels is 24, must be 16"),
        ("pins.30", {"label": "A", "functions": ["gpio"]}, "pins.30.functions: GPIO 30 of the "),
        ("pins.07", {"label": "A", "functions": []}, "pins.07: '07' is no GPIO number"),
        ("pins.7.label", "GP8", "pins.8.label: pins.7 is 'GP8' already"),
        ("pins.7.functions", ["pwm3B"], "pins.7.functions: must have one of gpio, input, "),
        ("pins.7.functions", ["gpio", "output"], "pins.7.functions: must have one of gpio, "),
        (
            "pins.7.functions",
            ["gpio", "pwm3A", "i2c1 scl"],
            "pins.7.functions: must have gpio, i2c1 scl, pwm3B",
        ),
        ("pins.7.functions", ["gpio", "pwm3B"], "pins.7.functions: must have gpio, i2c1 scl, pwm"),
        ("pins.7.functions", ["input", "pwm3B"], "pins.7.functions: must have input"),
        ("pins.1.functions", ["input"], "pins.1.functions: must have input, uart0 rx"),
        ("pins.25.functions", ["led", "pwm4B"], "pins.25.functions: must have led"),
        ("defaults.wire", ..., "the key 'defaults.wire' is missing"),
        ("defaults.wire", 2, "defaults.wire is 2, must be an object"),
        ("defaults.wire.pin", "2", "defaults.wire.pin is '2', must be an integer"),
        ("defaults.wire.pin", 24, "defaults.wire.pin: GPIO 24 is not among pins"),
        ("defaults.led.pin", 2, "defaults.led.pin: GPIO 2 is used by defaults.wire.pin already"),
        ("defaults.outputs.25", {}, "defaults.outputs.25: GPIO 25 is used by defaults.led.pin "),
        ("defaults.outputs.6", 1, "defaults.outputs.6 is 1, must be an object"),
        ("wiring.0.from", "antenna", "wiring.0.from is 'antenna', must be one of receiver Tx, "),
        ("wiring.0.to", "GP99", "wiring.0.to is 'GP99', which is no pin's label"),
        ("wiring.0.colour", "red", "the key 'wiring.0.colour' is unknown"),
        ("wiring.3.from", "BEC 5 V", "wiring: must have one row from 'BEC 5 V'"),
        ("wiring.4.from", "receiver Tx", "wiring.4.to is '3V3', which is no pin's label"),
    ],
)
def test_one_line_names_file_and_key(tmp_path: Path, keys: str, value: object, line: str) -> None:
    write_board(tmp_path, changed(keys, value))
    with pytest.raises(GhstError) as caught:
        boards.load("test", tmp_path)
    start = f"{tmp_path / 'boards/test/board.json'}: "
    message = str(caught.value)
    assert message.startswith(start + line)
    assert "\n" not in message
