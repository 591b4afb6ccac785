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


def test_the_picos_pins_do_not_overlap() -> None:
    pins = json.loads(boards.load("rpi_pico").definition)["pins"]
    assert pins["ghst_wire"] == 2
    assert {int(pin): channel for pin, channel in pins["servos"].items()} == {
        6: 1,
        7: 2,
        8: 3,
        9: 4,
        10: 5,
        11: 6,
        12: 7,
        13: 8,
    }
    used = [pins["ghst_wire"], pins["serial2"], pins["led"]]
    used += [pins["battery_adc"], pins["current_adc"]]
    used += [
        pins["gps_uart"]["tx"],
        pins["gps_uart"]["rx"],
        pins["i2c"]["sda"],
        pins["i2c"]["scl"],
    ]
    used += map(int, pins["servos"])
    assert sorted(used) == sorted({0, 1, 2, 3, 4, 5, *range(6, 14), 25, 26, 27})


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
