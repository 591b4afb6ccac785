"""What board.json may say, and the one line that comes when it says something else.

The validator runs on the unix port; what a board does with a bad file is tried on the chip.
"""

import json
import subprocess
from copy import deepcopy
from pathlib import Path

import pytest
from rig import SERVOS, Pico

from ghst_tools import boards, micropython_image

GOOD = json.loads(boards.load("rpi_pico").definition)
READ = """
import sys
from firmware import board
try:
    here = board.load(sys.argv[1])
    print(here.name, here.chip, here.wire, sorted(here.servos.items()), here.led,
          here.failsafe_ms, sorted(here.failsafe.items()))
except board.BoardError as error:
    print("BoardError:", error)
"""


def load(path: Path) -> str:
    """What the board's own validator makes of a file."""
    root = boards.checkout()
    done = subprocess.run(
        [micropython_image.unix_micropython(), "-c", READ, path],
        capture_output=True,
        text=True,
        env={"MICROPYPATH": f"{root}:{root / 'lib'}"},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def changed(keys: str, value: object) -> dict[str, object]:
    """The board's file with one value, at "a.b", replaced."""
    values = deepcopy(GOOD)
    *path, last = keys.split(".")
    place = values
    for key in path:
        place = place.setdefault(key, {})
    place[last] = value
    return values


def test_the_file_of_the_pico(tmp_path: Path) -> None:
    path = tmp_path / "board.json"
    path.write_text(json.dumps(changed("failsafe", {"6": "hold", "7": "none", "8": 1000.25})))
    servos = str(sorted(SERVOS.items()))
    assert load(path) == f"rpi_pico rp2040 2 {servos} 25 500 [(6, -1), (7, 0), (8, 4001)]"


@pytest.mark.parametrize(
    ("keys", "value", "line"),
    [
        ("pins", None, "pins is missing"),
        ("pins.ghst_wire", None, "pins.ghst_wire is missing"),
        ("pins.ghst_wire", True, "pins.ghst_wire is True, must be of type int"),
        ("pins.ghst_wire", 30, "pins.ghst_wire: 30 is no GPIO number, 0..29"),
        ("pins.led", True, "pins.led: True is no GPIO number, 0..29"),
        ("pins.led", 1e99, "pins.led: 1e+99 is no GPIO number, 0..29"),
        ("pins.servos.6", 17, "pins.servos.6 is 17, must be a channel, 1..16"),
        ("pins.servos.6", "one", "pins.servos.6 is 'one', must be a channel, 1..16"),
        ("pins.servos.06", 3, "pins.servos names GP6 twice"),
        ("pins.servos.x", 3, "pins.servos: 'x' is no GPIO number, 0..29"),
        ("failsafe_ms", "500", "failsafe_ms is '500', must be of type int"),
        ("failsafe.20", "hold", "failsafe.20: GP20 is not among pins.servos"),
        ("failsafe.6", 700, 'failsafe.6 is 700, must be "hold", "none" or 800..2200 us'),
        ("pins.ghst_wire", 6, "pins.servos: GP6 is taken by ghst_wire"),
        ("pins.servos", {}, "pins.servos is empty: no servo outputs given"),
        ("pins.i2c.sda", 6, "pins.i2c: GP6 is taken by servos"),
        ("pins.gps_uart", 3, "pins.gps_uart is 3, must have id, tx, rx"),
        ("pins.gps_uart", {"id": 0, "tx": 0}, "pins.gps_uart.rx is missing"),
        ("sensors.battery", 11, "sensors.battery is 11, must be a JSON object"),
        ("role", "pilot", "role is 'pilot', must be one of flight, goggles"),
        ("wire_driver", "spi", "wire_driver is 'spi', must be one of pio, uart"),
        ("failsafe.6", True, 'failsafe.6 is True, must be "hold", "none" or 800..2200 us'),
    ],
)
def test_one_line_says_what_is_wrong(tmp_path: Path, keys: str, value: object, line: str) -> None:
    path = tmp_path / "board.json"
    path.write_text(json.dumps(changed(keys, value)))
    assert load(path) == f"BoardError: {path}: {line}"


def test_a_missing_or_broken_file(tmp_path: Path) -> None:
    path = tmp_path / "board.json"
    assert load(path) == f"BoardError: {path} is missing: flash the board again"
    path.write_text('{"name": ')
    assert load(path) == f"BoardError: {path} is not valid JSON: flash the board again"
    path.write_text("[]")
    assert load(path) == f"BoardError: {path}: must be a JSON object"


@pytest.mark.parametrize(
    ("keys", "value", "line"),
    [
        ("pins.led", 13, "/board.json: pins.led: GP13 is taken by servos"),
        ("pins.servos.22", 9, "GP22 shares its PWM channel with GP6"),
        ("failsafe_ms", 50, "failsafe_ms is 50, must be 110..10000"),
        ("chip", "rp2350", "/board.json is for an rp2350, this is an rp2040"),
    ],
)
def test_a_board_that_cannot_be_moves_nothing(
    pico: Pico, keys: str, value: object, line: str
) -> None:
    pico.boot(changed(keys, value), until=f"micropython-ghst: {line}. Nothing moves.".encode())
    begun = pico.board.now_ns
    pico.board.run_for(300e6)
    for pin in SERVOS:
        assert pico.meter.pulses[pin] == []
        assert not pico.meter.level(pin)
    assert pico.board.exec("print('repl')", limit_ns=1e9) == "repl\n"
    assert pico.board.now_ns > begun
    assert pico.board.resets == []
