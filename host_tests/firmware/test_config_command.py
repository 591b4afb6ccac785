"""The console command `config` of a running board, as a program types it."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from typing import Any

import pytest
from rig import NO_SENSORS, PERIOD_NS, SERVOS, Pico

import ghst
from ghst_tools import filesystem as littlefs

CENTRE = ghst.encode.channels(0x30, (2048,) * 4, (128,) * 4)
OLD = json.dumps(NO_SENSORS).encode()
NEW = json.dumps(NO_SENSORS | {"name": "Wing", "failsafe": {"time_ms": 300}}).encode()
SET_VTX = ghst.encode.msp(0x21, bytes((0x30, 4, 89, 37, 23, 3, 0)) + bytes(3))
EEPROM_WRITE = ghst.encode.msp(0x21, bytes((0x31, 0, 250)) + bytes(7))
WRONG = b'{"failsafe": {"time_ms": 50}, "outputs": {"6": {"kind": "swtch"}}}'


def digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def ask(pico: Pico, line: str) -> dict[str, Any]:
    """The answer to a line."""
    output = pico.board.console.output
    start = len(output)
    pico.board.console.write(b"\x15" + line.encode() + b"\r")
    found = re.compile(rb'^({"ghst": .*})\r\n', re.MULTILINE)
    pico.board.run_until(lambda: found.search(output, start) is not None, poll_ns=1e6)
    match = found.search(output, start)
    assert match is not None
    answer = dict(json.loads(match[1]))
    assert answer.pop("to") == " ".join(line.split()[1:3])
    return answer


def refused(pico: Pico, line: str) -> str:
    """What the board says to a line that it does not do."""
    answer = ask(pico, line)
    assert answer["ghst"] == "error"
    return str(answer["text"])


def send(pico: Pico, content: bytes, base: str = "") -> None:
    """Send a file without having it checked."""
    assert ask(pico, f"config begin {len(content)} {base}") == {"ghst": "ok", "at": 0}
    for at in range(0, len(content), 45):
        piece = content[at : at + 45]
        answer = ask(pico, f"config put {at} {base64.b64encode(piece).decode()}")
        assert answer == {"ghst": "ok", "at": at + len(piece)}


def on_board(pico: Pico) -> bytes:
    return littlefs.read(pico.board.flash_filesystem())["/ghst.json"]


@pytest.mark.boot()
def test_a_new_file_is_read_checked_and_saved(pico: Pico) -> None:
    state = ask(pico, "config")
    assert state == {
        "ghst": "config",
        "version": ghst.__version__,
        "board": "rpi_pico",
        "id": state["id"],
        "link": "searching",
        "problems": [],
        "size": len(OLD),
        "hash": digest(OLD),
        "restart": False,
    }
    found = b""
    while piece := base64.b64decode(ask(pico, f"config read {len(found)}")["data"]):
        found += piece
    assert found == OLD
    # What the board would not take is told, and cannot be saved.
    send(pico, WRONG)
    answer = ask(pico, f"config check {digest(WRONG)}")
    assert sorted(answer["problems"]) == [
        ["failsafe.time_ms", "failsafe.time_ms is 50, must be 110..10000 ms"],
        [
            "outputs.6.kind",
            'outputs.6.kind is "swtch", must be one of servo, switch, servo_760, oneshot125, '
            "unused",
        ],
    ]
    assert (answer["ghst"], answer["count"]) == ("config", 2)
    assert refused(pico, "config save") == "the new file was not checked"
    # Nor is one that is no JSON, or that arrived damaged, or that is not whole.
    cut_off = NEW[:-2]
    send(pico, cut_off)
    answer = ask(pico, f"config check {digest(cut_off)}")
    assert answer["problems"] == [["", "no valid JSON"]]
    send(pico, NEW, digest(OLD))
    assert refused(pico, f"config check {digest(OLD)}") == "the new file arrived damaged"
    assert refused(pico, "config save") == "the new file was not checked"
    # A piece that comes twice, since its answer was lost, does no harm.
    assert ask(pico, f"config put 0 {base64.b64encode(NEW[:9]).decode()}")["at"] == 9
    assert refused(pico, f"config check {digest(NEW)}") == "the new file arrived damaged"
    assert "out of order" in refused(pico, "config put 10 AAAA")
    send(pico, NEW, digest(OLD))
    assert ask(pico, f"config check {digest(NEW)}") == {
        "ghst": "config",
        "problems": [],
        "count": 0,
    }
    assert on_board(pico) == OLD
    answer = ask(pico, "config save")
    assert (answer["ghst"], answer["hash"]) == ("ok", digest(NEW))
    assert on_board(pico) == NEW
    assert ask(pico, "config")["restart"] is True
    # Once saved there is nothing to save.
    assert refused(pico, "config save") == "no new file was begun"
    # And the restart has it in force, without a pulse on the way.
    assert ask(pico, "config restart") == {"ghst": "ok", "restart": True}
    start = len(pico.board.console.output)
    pico.board.run_until(lambda: len(pico.board.resets) == 1)
    pico.board.run_until(lambda: b"failsafe after 300 ms" in pico.board.console.output[start:])
    assert all(pico.meter.pulses[pin] == [] for pin in SERVOS)


@pytest.mark.boot()
def test_what_is_no_command_of_config(pico: Pico) -> None:
    for line, text in (
        ("config save", "no new file was begun"),
        ("config put 0 AAAA", "no new file was begun"),
        ("config check 00", "no new file was begun"),
        ("config fly", "config fly is unknown"),
        ("config begin 0", "the file has 0 bytes, must have 1..16384"),
        ("config begin 16385", "the file has 16385 bytes, must have 1..16384"),
        ("config restart now", "now is unknown, there is force"),
    ):
        assert refused(pico, line) == text
    for line in ("config begin", "config begin x", "config read -1 2", "config put 1"):
        assert refused(pico, line)
    send(pico, b"{}")
    assert refused(pico, "config put 2 AAAA") == "bytes 2..5 of 2 come out of order"
    assert refused(pico, "config put 0 A")
    # The largest file has room while the application runs.
    assert ask(pico, "config begin 16384") == {"ghst": "ok", "at": 0}
    assert pico.reply_to_enter().count("main loop: stood still 0 times") == 1


@pytest.mark.boot()
def test_a_file_that_changed_meanwhile_is_not_replaced(pico: Pico) -> None:
    send(pico, NEW, "-")
    ask(pico, f"config check {digest(NEW)}")
    assert refused(pico, "config save") == "the file on the board has changed meanwhile"
    assert on_board(pico) == OLD
    assert ask(pico, f"config begin {len(NEW)} {digest(OLD)}")["ghst"] == "ok"
    send(pico, NEW, digest(OLD))
    ask(pico, f"config check {digest(NEW)}")
    # The radio sets the video transmitter and saves: that waits for the end of the link.
    requests = {20: SET_VTX, 40: EEPROM_WRITE}
    pico.fly(lambda index, t: requests.get(index, CENTRE), 250)
    pico.board.run_for(500e6)
    assert on_board(pico) == OLD
    assert refused(pico, "config save force") == "the file on the board has changed meanwhile"
    saved = json.loads(on_board(pico))
    assert saved["vtx"]["vtx_power"] == 3
    assert saved["gps"] == {"enabled": False}
    # Without a word about what it replaces, a file replaces anything.
    send(pico, NEW)
    ask(pico, f"config check {digest(NEW)}")
    assert ask(pico, "config save force")["hash"] == digest(NEW)


@pytest.mark.boot()
def test_while_the_link_is_up_only_force_writes(pico: Pico) -> None:
    receiver = pico.fly(lambda index, t: CENTRE, 250)
    pico.board.run_for(300e6)
    assert ask(pico, "config")["link"] == "linked"
    begun = pico.board.now_ns
    send(pico, NEW, digest(OLD))
    assert ask(pico, f"config check {digest(NEW)}")["problems"] == []
    assert refused(pico, "config save") == "the link is up"
    assert refused(pico, "config restart") == "the link is up"
    assert on_board(pico) == OLD
    # No frame was late for all of that, and no pulse is missing.
    sent = [end_ns for end_ns, _ in receiver.sent if begun < end_ns < pico.board.now_ns - 1e6]
    late = [one for one in pico.latencies_us(receiver)[-len(sent) - 1 : -1] if one is None]
    assert late == []
    forced = pico.board.now_ns
    assert ask(pico, "config save force")["hash"] == digest(NEW)
    assert on_board(pico) == NEW
    pico.board.run_for(200e6)
    for pin in SERVOS:
        pulses = pico.meter.since(begun, pin)
        assert len(pulses) >= (pico.board.now_ns - begun) // PERIOD_NS - 1
        assert {round(pulse.width_ns) for pulse in pulses} == {1500000}, pin
    assert pico.board.now_ns > forced
    assert pico.reply_to_enter().count("failsafes 0") == 1
    assert ask(pico, "config restart force")["ghst"] == "ok"
    pico.board.run_until(lambda: len(pico.board.resets) == 1)


def test_a_broken_file_is_told_and_can_be_replaced(pico: Pico) -> None:
    pico.boot(files={"/ghst.json": WRONG})
    state = ask(pico, "config")
    assert sorted(state["problems"]) == [
        "/ghst.json: failsafe.time_ms is 50, must be 110..10000 ms",
        '/ghst.json: outputs.6.kind is "swtch", must be one of servo, switch, servo_760, '
        "oneshot125, unused",
    ]
    assert (state["size"], state["hash"]) == (len(WRONG), digest(WRONG))
    send(pico, NEW, digest(WRONG))
    ask(pico, f"config check {digest(NEW)}")
    assert ask(pico, "config save")["ghst"] == "ok"
    assert on_board(pico) == NEW
