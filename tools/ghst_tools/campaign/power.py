"""The power fails at every write to the flash while a configuration is saved."""

from __future__ import annotations

import importlib
import json
import sys
import tempfile
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from ghst_tools import boards, filesystem
from ghst_tools.campaign.cut_starts import start
from ghst_tools.campaign.picos import Picos, forked
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Row, Trial, equal, expect
from ghst_tools.emulator import Board
from ghst_tools.emulator.flash_log import FlashLog

PATHS = ("/ghst.json", "/ghst.json.new", "/ghst.json.broken")
OLD = {"vtx": {"vtx_power": 1, "vtx_band": 5}, "failsafe": {"time_ms": 300}}
NEW = {"vtx": {"vtx_power": 3, "vtx_band": 5}, "failsafe": {"time_ms": 400}}
# More than a block of the flash: all there is to say about outputs, eight of them in use.
_OUTPUT: dict[str, Any] = {
    "reverse": False,
    "minimum_us": None,
    "centre_us": None,
    "maximum_us": None,
    "subtrim_us": 0,
    "deadband_us": 0,
    "slow_us_per_s": 0,
    "failsafe": "none",
    "frequency_hz": 50,
    "motor": False,
    "threshold_us": 1500,
    "hysteresis_us": 50,
}
LARGE = {
    "outputs": {
        str(pin): {"kind": "servo" if pin < 14 else "unused", "channel": pin - 5} | _OUTPUT
        for pin in range(6, 22)
    }
}
BROKEN = b'{"vtx": {"power": 1'
# For a board at the prompt.
DEVICE = """
import os, time
from firmware.settings import Settings
def put(path, content):
    try:
        os.remove(path)
    except OSError:
        pass
    if content is not None:
        with open(path, 'wb') as file:
            file.write(content)
"""


class Save(NamedTuple):
    """The files before a save, what it changes, and the settings until the save counts.

    `old` None: nothing but an error.
    """

    before: Mapping[str, bytes]
    changes: dict[str, Any]
    old: dict[str, Any] | None

    @property
    def new(self) -> dict[str, Any]:
        """The settings from then on."""
        return (self.old or {}) | self.changes


CASES = {
    "first": Save({}, OLD, {}),
    "change": Save({"/ghst.json": json.dumps(OLD).encode()}, NEW, OLD),
    "large": Save({"/ghst.json": json.dumps(LARGE).encode()}, NEW, LARGE),
    "broken": Save({"/ghst.json": BROKEN}, NEW, None),
    "left over": Save(
        {"/ghst.json": json.dumps(OLD).encode(), "/ghst.json.new": BROKEN}, NEW, OLD
    ),
    "twice": Save({"/ghst.json": BROKEN, "/ghst.json.new": json.dumps(OLD).encode()}, NEW, OLD),
}


def new_settings(path: Path) -> Any:
    """The firmware's `Settings` for a file of this machine."""
    root = str(boards.checkout())
    if root not in sys.path:
        sys.path.append(root)
    return importlib.import_module("firmware.settings").Settings(str(path))


def put(board: Board, contents: Mapping[str, bytes]) -> None:
    """Make files on the board."""
    for path, content in contents.items():
        board.exec(f"put({path!r}, {content!r})")


def save(board: Board, values: dict[str, dict[str, Any]]) -> str:
    """Have the board load its settings, change them to `values` and save; its words about it.

    A file that is broken is not changed: a whole new one takes its place.
    """
    if files_of(board.flash_filesystem()) == {"/ghst.json": BROKEN}:
        return board.exec(
            "settings = Settings()\n"
            "settings.load()\n"
            f"print(settings.poll(False), settings.replace({json.dumps(values).encode()!r}), "
            "settings.error)"
        ).strip()
    return board.exec(
        "settings = Settings()\n"
        "settings.load()\n"
        f"for section, values in {values}.items():\n"
        "    for key, value in values.items():\n"
        "        settings.set(section, key, value)\n"
        "settings.request_save()\n"
        "print(settings.poll(False), settings.poll(True), settings.error)"
    ).strip()


def files_of(image: bytes) -> dict[str, bytes]:
    """Those of our files that are in a file system."""
    found = filesystem.read(image)
    return {path: found[path] for path in PATHS if path in found}


def settings_in(folder: Path, files: dict[str, bytes]) -> Any:
    """Settings that were loaded on this machine from `files`, which are put into `folder`."""
    for path in PATHS:
        (folder / path[1:]).unlink(missing_ok=True)
    for path, content in files.items():
        (folder / path[1:]).write_bytes(content)
    settings = new_settings(folder / "ghst.json")
    settings.load()
    return settings


class Cut(NamedTuple):
    """A file system that a cut has left, and what this machine reads there."""

    image: bytes
    values: dict[str, Any]
    error: str | None


def cut_at_each_write(
    board: Board, log: FlashLog, folder: Path, name: str
) -> tuple[int, list[Cut]]:
    """Save as the case `name` says; the file systems of all cuts have the old file or the new one.

    `folder`: for files of this machine. How many cuts there were, and the first with each set of
    files.
    """
    before, changes, old = CASES[name]
    new = CASES[name].new
    put(board, before)
    log.restart()
    first: dict[tuple[tuple[str, bytes], ...], Cut] = {}
    others = {p: c for p, c in filesystem.read(log.start).items() if p not in PATHS}
    equal(save(board, changes), "False True None", "what the save says")
    seen = []
    for image in log.cuts():
        found = filesystem.read(image)
        equal({p: c for p, c in found.items() if p not in PATHS}, others, "other files")
        files = files_of(image)
        settings = settings_in(folder, files)
        values = settings._sections
        error = settings.error and settings.error.replace(str(folder), "")
        first.setdefault(tuple(files.items()), Cut(image, values, error))
        if old is None and settings.error is not None:
            seen.append("old")
            equal((values, found["/ghst.json"]), ({}, BROKEN), "a broken file before")
        else:
            equal(settings.error, None, "error")
            expect(values in (old, new), f"values: {values}")
            seen.append("new" if values == new else "old")
        # The next safe moment puts in order what the cut has left.
        expect(not settings.poll(True), "nothing to save")
        expect(not (folder / "ghst.json.new").exists(), "ghst.json.new is left")
        again = new_settings(folder / "ghst.json")
        again.load()
        equal((again._sections, again.error), (values, settings.error), "after the next start")
        if before.get("/ghst.json") == BROKEN:
            kept = [folder / "ghst.json", folder / "ghst.json.broken"]
            contents = [path.read_bytes() for path in kept if path.exists()]
            expect(BROKEN in contents, "the broken file of the user's is lost")
    expect(len(seen) == 1 + 3 * len(log.writes) > 6, f"{len(seen)} cuts")
    # After each whole write: once new, always new.
    whole = seen[::3]
    equal(whole, sorted(whole, reverse=True), "old and new after each write")
    equal((whole[0], whole[-1]), ("old", "new"), "the first and the last")
    final = files_of(board.flash_filesystem())
    equal(json.loads(final.pop("/ghst.json")), new, "the file at the end")
    left = {"/ghst.json.broken": BROKEN} if before.get("/ghst.json") == BROKEN else {}
    equal(final, left, "other files at the end")
    return len(seen), list(first.values())


def cut_and_start(picos: Picos, name: str) -> tuple[int, list[str]]:
    """Save as a case says, and start a board from the first cut with each set of files.

    How many cuts there were, and what each start was like.
    """
    board = Board(picos.image, filesystem.build(picos.files, picos.filesystem_size))
    board.boot(until=b"link: searching")
    board.exec(DEVICE)
    with tempfile.TemporaryDirectory() as folder:
        count, cuts = cut_at_each_write(board, FlashLog(board), Path(folder), name)
    starts = []
    for cut in cuts:
        sizes = [f"{path[1:]} {len(data)} bytes" for path, data in files_of(cut.image).items()]
        files = ", ".join(sizes) or "no file"
        starts.append(f"with {files}: {forked(partial(start, picos, *cut))}")
    return count, starts


def _row(setting: Setting, name: str) -> list[Row]:
    count, starts = cut_and_start(setting.picos, name)
    return [
        Row(
            "power cut while saving",
            f'case "{name}", {count} cuts: before the first write to the flash, then half, some '
            "bits and all of each",
            "all cuts read on the host, by the firmware's settings module there: the old file or "
            "the new one each time, whole, nothing else changed; once new, always new; the next "
            "safe moment puts in order what is left. The emulated board, with main.py, started "
            f"from the first cut with each of {len(starts)} different sets of files, and left no "
            f"ghst.json.new: {'; '.join(starts)}",
        )
    ]


def trials(setting: Setting) -> Iterator[tuple[str, Trial]]:
    """The trials, by name."""
    for name in list(CASES)[: setting.effort.power_cases]:
        yield name, partial(_row, setting, name)
