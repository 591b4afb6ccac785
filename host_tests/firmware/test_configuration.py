"""What a board does with its configuration, and with one that cannot be.

What may stand in it is in the library's tests: `behaviour/configuration.py`.
"""

from __future__ import annotations

import json
from itertools import pairwise

import pytest
from rig import NO_SENSORS, SERVOS, Pico

import ghst
from ghst_tools import boards
from ghst_tools import filesystem as littlefs

CENTRE = ghst.encode.channels(0x30, (2048,) * 4, (128,) * 4)
BOARD = json.loads(boards.load("rpi_pico").definition)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (b'{"name": "Wing", ', "/ghst.json is broken: no valid JSON"),
        (b'{"name": "Wing"', "/ghst.json is broken: no valid JSON"),
        (b"\xff\xfe\x00", "/ghst.json is broken: no valid JSON"),
        (b"[" * 3000, "/ghst.json is broken: no valid JSON"),
        (
            b'{"failsafe": {"time_ms": 50}}',
            "/ghst.json: failsafe.time_ms is 50, must be 110..10000 ms",
        ),
        (
            b'{"outputs": {"22": {"channel": 9}}}',
            "/ghst.json: outputs.22 and outputs.6 share one PWM channel: take another pin for one "
            "of them",
        ),
    ],
)
def test_with_a_broken_file_nothing_moves_and_the_reason_is_told(
    pico: Pico, text: bytes, reason: str
) -> None:
    pico.boot(files={"/ghst.json": text})
    assert f"micropython-ghst: {reason}. Nothing moves." in pico.board.console.output.decode()
    edges: list[tuple[float, bool | None]] = []
    pico.board.pin(25).watch(lambda t, level: edges.append((t, level)))
    pico.fly(lambda index, t: CENTRE, 55)
    pico.board.run_for(1.5e9)
    assert all(pico.meter.pulses[pin] == [] for pin in SERVOS)
    assert pico.compares == []
    # Three short flashes in 1.28 s.
    on = [round((b[0] - a[0]) / 1e6) for a, b in pairwise(edges) if a[1]]
    assert set(on) == {80} and len(on) in (3, 4, 5)
    reply = pico.reply_to_enter()
    assert f"nothing moves: {reason}" in reply and "link: linked; frames 8" in reply
    # The file is the user's.
    assert littlefs.read(pico.board.flash_filesystem())["/ghst.json"] == text


def test_what_is_there_and_cannot_be_read_is_not_taken_for_no_file(pico: Pico) -> None:
    pico.boot(files={"/ghst.json": None, "/ghst.json/kept": b""})
    reason = "/ghst.json cannot be read: OSError 21"
    assert f"micropython-ghst: {reason}. Nothing moves." in pico.board.console.output.decode()
    pico.fly(lambda index, t: CENTRE, 55)
    pico.board.run_for(200e6)
    assert all(pico.meter.pulses[pin] == [] for pin in SERVOS)


def test_a_broken_file_is_not_replaced_by_what_the_radio_sets(pico: Pico) -> None:
    broken = b'{"outputs": {"8": {"motor": true}}'
    pico.boot(files={"/ghst.json": broken})
    # MSP_SET_VTX_CONFIG and MSP_EEPROM_WRITE, as a script of the radio sends them.
    messages = (b"\x30\x04\x59\x1f\x00\x01\x00", b"\x31\x00\xfa")
    frames = []
    for message in messages:
        xor = 0
        for byte in message[1:]:
            xor ^= byte
        frames.append(ghst.encode.msp(0x21, (message + bytes([xor])).ljust(10, b"\x00")))

    def frame(index: int, t_ns: float) -> bytes | None:
        return frames.pop(0) if index % 10 == 9 and frames else CENTRE

    receiver = pico.fly(frame, 55)
    pico.board.run_for(700e6)
    receiver.stop()
    pico.board.run_for(1.5e9)
    assert frames == []
    reply = pico.reply_to_enter()
    assert "MSP: 2 frames, 2 answered, 0 errors" in reply
    assert "/ghst.json was not saved: it is broken, put it in order first" in reply
    left = littlefs.read(pico.board.flash_filesystem())
    assert left["/ghst.json"] == broken and "/ghst.json.broken" not in left


@pytest.mark.parametrize(
    ("board", "line"),
    [
        (BOARD | {"chip": "rp2350"}, "/board.json is for an rp2350, this is an rp2040"),
        (BOARD | {"defaults": None}, "/board.json: defaults is missing or wrong: flash the board"),
        (
            BOARD | {"defaults": {"wire": {"pin": 77}}},
            "/board.json: wire.pin is 77, must be a GPIO number",
        ),
    ],
)
def test_a_board_that_cannot_be_moves_nothing(
    pico: Pico, board: dict[str, object], line: str
) -> None:
    files = {"/board.json": json.dumps(board).encode()}
    pico.boot(files=files, until=f"micropython-ghst: {line}".encode())
    begun = pico.board.now_ns
    pico.board.run_for(300e6)
    for pin in SERVOS:
        assert pico.meter.pulses[pin] == []
        assert not pico.meter.level(pin)
    assert pico.board.exec("print('repl')", limit_ns=1e9) == "repl\n"
    assert pico.board.now_ns > begun
    assert pico.board.resets == []


@pytest.mark.boot(NO_SENSORS | {"name": "Wing", "led": {"pin": 15, "active_low": True}})
def test_name_and_led_are_as_configured(pico: Pico) -> None:
    receiver = pico.fly(lambda index, t: CENTRE, 55)
    pico.board.run_for(300e6)
    # Linked: on, which is low.
    assert pico.board.pin(15).device is False
    receiver.stop()
    question = ghst.encode.msp(0x21, bytes((0x30, 0, 10)) + bytes(7))
    link = ghst.encode.link_data(0x13, (1984,) * 4, rf_mode=6)
    receiver = pico.fly(lambda index, t: question if index == 5 else link, 160)
    pico.board.run_for(200e6)
    answers = [frame.frame[3:9] for frame in receiver.downlink if frame.frame[2] == 0x28]
    assert answers[0] == b"\x30\x04\x0aWin"
