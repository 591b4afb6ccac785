"""Settings in the flash of the emulated chip, with the power failing at every write to it."""

import base64
import hashlib
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from firmware.configuration import load

from ghst_tools import boards, filesystem
from ghst_tools.campaign.power import (
    BROKEN,
    CASES,
    DEVICE,
    NEW,
    OLD,
    PATHS,
    cut_at_each_write,
    files_of,
    put,
    save,
    settings_in,
)
from ghst_tools.emulator import Board
from ghst_tools.emulator.flash_log import FlashLog
from ghst_tools.errors import GhstError


@pytest.fixture(scope="module")
def board(micropython_image: Path, firmware_files: dict[str, bytes]) -> Board:
    """A board at the prompt with the firmware in its flash."""
    files = {path: content for path, content in firmware_files.items() if path != "/main.py"}
    size = boards.load("rpi_pico").filesystem_size
    board = Board(micropython_image, filesystem.build(files, size))
    board.boot()
    board.exec(DEVICE)
    return board


@pytest.fixture(scope="module")
def module_log(board: Board) -> FlashLog:
    return FlashLog(board)


@pytest.fixture
def log(board: Board, module_log: FlashLog) -> Iterator[FlashLog]:
    """What is written to the flash."""
    yield module_log
    for path in PATHS:
        board.exec(f"put({path!r}, None)")


@pytest.mark.parametrize("case", CASES)
def test_a_power_cut_at_any_write_leaves_the_old_or_the_new(
    board: Board, log: FlashLog, tmp_path: Path, case: str
) -> None:
    cut_at_each_write(board, log, tmp_path, case)


PUSHED = b'{\n\t"name" : "Wing",\r\n  "failsafe": {"time_ms": 300}\n}\n\n' + b" " * 700
FLOWN = b'{"name": "Old wing"}'


@pytest.mark.parametrize(
    ("before", "is_old"),
    [
        pytest.param({}, lambda here: here.values[""]["name"] == "", id="first"),
        pytest.param(
            {"/ghst.json": FLOWN},
            lambda here: here.values[""]["name"] == "Old wing",
            id="change",
        ),
        pytest.param(
            {"/ghst.json": BROKEN},
            lambda here: here.problems == [f"{load.FILE} is broken: no valid JSON"],
            id="broken",
        ),
        pytest.param(
            {"/ghst.json": FLOWN, "/ghst.json.new": PUSHED[:20]},
            lambda here: here.values[""]["name"] == "Old wing",
            id="left over",
        ),
    ],
)
def test_a_power_cut_while_a_pushed_file_is_saved_leaves_the_old_or_the_new(
    board: Board,
    log: FlashLog,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    before: dict[str, bytes],
    is_old: Callable[[Any], bool],
) -> None:
    put(board, before)
    log.restart()
    assert push(board, PUSHED) == {"ghst": "ok", "to": "save", "hash": digest(PUSHED)}
    monkeypatch.setattr(load, "FILE", str(tmp_path / "ghst.json"))
    monkeypatch.setattr(load, "BOARD_FILE", str(tmp_path / "board.json"))
    (tmp_path / "board.json").write_bytes(boards.load("rpi_pico").definition)
    seen = []
    for image in log.cuts():
        files = files_of(image)
        settings_in(tmp_path, files)
        # What the board would start with.
        here = load.load()
        if here.values["failsafe"]["time_ms"] == 300:
            assert here.problems == []
            seen.append("new")
        else:
            assert is_old(here)
            seen.append("old")
        assert files.get("/ghst.json") in (before.get("/ghst.json"), PUSHED, None)
    whole = seen[::3]
    assert whole == sorted(whole, reverse=True)
    assert (whole[0], whole[-1]) == ("old", "new")
    kept = {"/ghst.json.broken": BROKEN} if before.get("/ghst.json") == BROKEN else {}
    assert files_of(board.flash_filesystem()) == {"/ghst.json": PUSHED} | kept


def digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def push(board: Board, content: bytes) -> dict[str, Any]:
    """Have the board take a file as `ghst config push` does; its last answer, without the time."""
    pieces = [content[at : at + 45] for at in range(0, len(content), 45)]
    lines = [f"begin {len(content)}"]
    lines += [f"put {45 * n} {base64.b64encode(data).decode()}" for n, data in enumerate(pieces)]
    lines += [f"check {digest(content)}", "save"]
    printed = board.exec(
        "from firmware.config_command import ConfigCommand\n"
        "command = ConfigCommand()\n"
        f"for line in {lines}:\n"
        "    command(line)\n"
    )
    answer = json.loads(printed.splitlines()[-1])
    answer.pop("ms", None)
    return dict(answer)


def test_a_cut_file_system_boots_and_goes_on(
    board: Board, log: FlashLog, micropython_image: Path, tmp_path: Path
) -> None:
    put(board, {"/ghst.json": BROKEN})
    log.restart()
    assert save(board, NEW) == "False True None"
    # The worst of them: the broken file has its new name, the new one has not.
    worst = [image for image in log.cuts() if "/ghst.json" not in files_of(image)]
    assert set(files_of(worst[0])) == {"/ghst.json.new", "/ghst.json.broken"}
    cut = Board(micropython_image, worst[0])
    cut.boot()
    rest = FlashLog(cut)
    code = "from firmware.settings import Settings\nsettings = Settings()\nsettings.load()\n"
    shown = "print(settings.get('vtx', 'vtx_power'), settings.error)"
    assert cut.exec(code + shown) == "3 None\n"
    assert rest.writes == []
    assert cut.exec(f"settings.poll(False)\nsettings.poll(True)\n{shown}") == "3 None\n"
    # And the power fails again while that is put in order.
    for image in rest.cuts():
        assert settings_in(tmp_path, files_of(image))._sections == NEW
    assert set(files_of(cut.flash_filesystem())) == {"/ghst.json", "/ghst.json.broken"}


def test_nothing_is_written_while_it_is_not_safe_or_not_asked_for(
    board: Board, log: FlashLog
) -> None:
    put(board, {"/ghst.json": json.dumps(OLD).encode()})
    log.restart()
    board.exec(
        "settings = Settings()\nsettings.load()\nsettings.poll(True)\n"
        "settings.set('vtx', 'vtx_power', 3)\nsettings.poll(True)\n"
        "settings.request_save()\nsettings.poll(False)\n"
    )
    assert log.writes == []
    # To ask without a change writes nothing either.
    board.exec("settings = Settings()\nsettings.load()\nsettings.request_save()\n")
    assert board.exec("print(settings.poll(True))") == "False\n"
    assert log.writes == []


def test_a_full_flash_is_told_and_the_old_file_stays(
    micropython_image: Path, firmware_files: dict[str, bytes]
) -> None:
    files = {path: content for path, content in firmware_files.items() if path != "/main.py"}
    files["/ghst.json"] = json.dumps(OLD).encode()
    size = boards.load("rpi_pico").filesystem_size
    board = Board(micropython_image, fill(files, size))
    board.boot()
    board.exec("from firmware.settings import Settings")
    said = save(board, {"texts": {str(n): 900 * "a" for n in range(5)}})
    assert said == "False False /ghst.json was not saved: the flash is full"
    # What was begun is removed when it is safe, and the old file is as it was.
    printed = board.exec(
        "import os\n"
        "print(settings.poll(False), settings.changed)\n"
        "print('ghst.json.new' in os.listdir())\n"
        "print(settings.poll(True), settings.saves)\n"
        "print('ghst.json.new' in os.listdir())"
    )
    assert printed.split() == ["False", "True", "True", "False", "0", "False"]
    assert json.loads(files_of(board.flash_filesystem())["/ghst.json"]) == OLD


def fill(files: dict[str, bytes], size: int) -> bytes:
    """A file system with `files` and no room for more than a block."""
    fits, most = 0, size // filesystem.BLOCK_SIZE
    image = b""
    while most - fits > 1:
        blocks = (fits + most) // 2
        try:
            image = filesystem.build(files | {"/filling": bytes(blocks * 4080)}, size)
            fits = blocks
        except GhstError:
            most = blocks
    return image


def test_saving_takes_no_longer_than_interrupts_may_stand_still(
    board: Board, log: FlashLog
) -> None:
    put(board, {"/ghst.json": json.dumps(OLD).encode()})
    printed = board.exec(
        "settings = Settings()\nsettings.load()\nsettings.set('vtx', 'vtx_power', 3)\n"
        "settings.request_save()\nbegun_ms = time.ticks_ms()\nsettings.poll(True)\n"
        "print(time.ticks_diff(time.ticks_ms(), begun_ms))"
    )
    # Without the time that a real chip takes: 45 ms for an erase, 0.7 ms for a page.
    erases = sum(write.erases for write in log.writes)
    pages = len(log.writes) - erases
    assert int(printed) + 45 * erases + 0.7 * pages < 250, (printed, erases, pages)
