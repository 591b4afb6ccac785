"""What `ghst config` does while the link is up, and what it knows of the files on boards."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest
from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo

from ghst_tools.configuration import known_files, transfer
from ghst_tools.configuration.on_board import BoardConfiguration, State, digest, port_or_found
from ghst_tools.errors import GhstError

NEW = b'{"name": "Wing"}'
STATE = State(
    board="rpi_pico",
    id="e66058388357b932",
    version="0.1.0",
    link="searching",
    problems=(),
    size=2,
    hash=digest(b"{}"),
    restart=False,
)
LINKED = dataclasses.replace(STATE, link="linked")
SENT = [
    (f"config begin {len(NEW)} {digest(b'{}')}", {"ghst": "ok", "at": 0}),
    ("config put 0 eyJuYW1lIjogIldpbmcifQ==", {"ghst": "ok", "at": 16}),
    (f"config check {digest(NEW)}", {"ghst": "config", "problems": [], "count": 0}),
]
SAVED = {"ghst": "ok", "hash": digest(NEW), "ms": 31}


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GHST_STATE", str(tmp_path / "state"))


def board(*script: tuple[str, dict[str, Any]]) -> BoardConfiguration:
    """A board that is asked exactly this."""
    left = list(script)

    def ask(line: str, kind: str) -> dict[str, Any]:
        wanted, answer = left.pop(0)
        assert (line, kind) == (wanted, answer["ghst"])
        return answer

    return BoardConfiguration("PORT", ask)


def replace(found: BoardConfiguration, state: State, *, force: bool = False) -> list[str]:
    said: list[str] = []
    transfer.replace(found, state, NEW, "wing.json", force=force, report=said.append)
    return said


def test_without_a_link_it_is_saved_and_remembered() -> None:
    assert replace(board(*SENT, ("config save", SAVED)), STATE) == [
        "PORT: 16 bytes saved as /ghst.json"
    ]
    assert known_files.remembered(STATE.id, "wing.json") == digest(NEW)


def test_while_the_link_is_up_nothing_is_even_sent() -> None:
    with pytest.raises(GhstError) as caught:
        replace(board(), LINKED)
    assert str(caught.value) == (
        "PORT: the link is up, and writing the flash stops the interrupts that move the outputs "
        "and judge failsafe: switch the transmitter off, or say --force"
    )
    assert known_files.remembered(STATE.id, "wing.json") is None


def test_forced_it_says_what_happened() -> None:
    said = replace(board(*SENT, ("config save force", SAVED)), LINKED, force=True)
    assert said == [
        "PORT: 16 bytes saved as /ghst.json",
        "the link was up: for parts of 31 ms, and of the time the flash takes, the outputs held "
        "their pulses and failsafe was not judged",
    ]


def test_what_only_the_board_refuses() -> None:
    answer = {"ghst": "config", "problems": [["name", "name is unknown"]], "count": 1}
    with pytest.raises(GhstError) as caught:
        replace(board(*SENT[:2], (SENT[2][0], answer)), STATE)
    assert str(caught.value) == (
        "PORT: the board refuses it (its firmware is 0.1.0): name is unknown"
    )


def test_each_file_is_known_by_its_board_and_its_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    known_files.remember("a", "ghst.json", "1234")
    known_files.remember("a", "-", "5678")
    assert known_files.remembered("a", str(tmp_path / "ghst.json")) == "1234"
    assert known_files.remembered("a", "-") == "5678"
    assert known_files.remembered("a", "other.json") is None
    assert known_files.remembered("b", "ghst.json") is None
    # A board without a file takes any.
    transfer.refuse_unseen(board(), dataclasses.replace(STATE, hash=None), "ghst.json")
    with pytest.raises(GhstError, match=r"^PORT: /ghst\.json on the board is not the one that "):
        transfer.refuse_unseen(board(), STATE, "ghst.json")
    # What is broken knows nothing.
    (tmp_path / "state" / "boards.json").write_text('{"a": [')
    assert known_files.remembered("a", "-") is None
    assert known_files.keep("a", "1234", b"{}").read_bytes() == b"{}"


def test_the_port_of_a_board_with_its_own_usb_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    found = [ListPortInfo("/dev/ttyUSB0"), ListPortInfo("/dev/ttyACM0")]
    found[0].vid, found[0].pid = 0x10C4, 0xEA60
    found[1].vid, found[1].pid = 0x303A, 0x1001
    monkeypatch.setattr(list_ports, "comports", lambda: found)
    assert port_or_found(None) == "/dev/ttyACM0"
    assert port_or_found("/dev/ttyUSB0") == "/dev/ttyUSB0"
    found.pop()
    with pytest.raises(GhstError, match=r"^no board found on USB: say which port with --port"):
        port_or_found(None)


def test_where_nothing_can_be_noted_it_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("GHST_STATE", str(tmp_path / "file"))
    known_files.remember("a", "ghst.json", "1234")
    assert capsys.readouterr().err.endswith(": not noted what ghst.json is\n")
    assert known_files.remembered("a", "ghst.json") is None
    # What is about to be replaced has to be kept first.
    with pytest.raises(GhstError):
        known_files.keep("a", "1234", b"{}")
