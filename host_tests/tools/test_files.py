"""What a command writes: never over what it reads, and never in place of a device."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import pytest
from click.testing import CliRunner
from recordings import log_text
from terminal import terminal

from ghst_tools.cli import ghst
from ghst_tools.files import replacing, write_file


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "in.log"
    path.write_text(log_text(4))
    return path


def run(*args: str | Path, stdin: bytes | None = None) -> tuple[int, str]:
    result = CliRunner().invoke(ghst, [str(arg) for arg in args], input=stdin)
    return result.exit_code, result.stderr


@pytest.mark.parametrize("name", ["in.log", "hard", "soft"])
def test_the_input_is_not_overwritten(log: Path, name: str) -> None:
    output = log.with_name(name)
    if name == "hard":
        output.hardlink_to(log)
    elif name == "soft":
        output.symlink_to(log)
    before = log.read_bytes()
    error = f"ghst: {output}: is the file that is read: name another output\n"
    assert run("vcd", log, "-o", output) == (1, error)
    assert log.read_bytes() == before


def test_a_picture_is_not_drawn_over_its_recording(log: Path) -> None:
    recording = log.rename(log.with_name("in.svg"))
    error = f"ghst: {recording}: is the file that is read: name another output\n"
    assert run("plot", recording, "-o", recording) == (1, error)
    assert recording.read_text() == log_text(4)


@pytest.mark.parametrize(
    "words",
    [
        ("vcd", "in.log", "-o"),
        ("plot", "in.log", "-o"),
        ("image", "--output"),
        ("config", "pull"),
        ("config", "wizard"),
    ],
)
def test_a_missing_folder_is_told_and_not_made(
    log: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    monkeypatch.chdir(log.parent)
    error = "ghst: no/such/out.svg: there is no folder no/such: make it first\n"
    assert run(*words, "no/such/out.svg") == (1, error)
    assert not Path("no").exists()


@pytest.mark.parametrize("words", [("sniff",), ("simulate",), ("monitor", "--json")])
def test_a_log_in_a_missing_folder(tmp_path: Path, words: tuple[str, ...]) -> None:
    path = tmp_path / "no" / "wire.log"
    with terminal() as wire:
        assert run(*words, "--port", wire.port, "--log", path) == (
            1,
            f"ghst: {path}: there is no folder {path.parent}: make it first\n",
        )
    assert not path.parent.exists()


def test_a_fifo_is_written_to(log: Path) -> None:
    fifo = log.with_name("fifo")
    os.mkfifo(fifo)
    read: list[bytes] = []
    reader = threading.Thread(target=lambda: read.append(fifo.read_bytes()))
    reader.start()
    assert run("vcd", log, "-o", fifo)[0] == 0
    reader.join(timeout=10)
    assert fifo.is_fifo()
    assert run("vcd", log, "-o", log.with_name("out.vcd"))[0] == 0
    assert read == [log.with_name("out.vcd").read_bytes()]


def test_a_device_is_written_to(log: Path) -> None:
    assert run("vcd", log, "-o", "/dev/full") == (1, "ghst: /dev/full: No space left on device\n")
    assert Path("/dev/full").is_char_device()


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_text("old")
    link.symlink_to(target)
    write_file(link, b"new")
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_what_fails_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("old")
    with pytest.raises(RuntimeError), replacing(path) as file:
        file.write(b"new")
        raise RuntimeError
    assert [(found.name, found.read_text()) for found in tmp_path.iterdir()] == [("file", "old")]
