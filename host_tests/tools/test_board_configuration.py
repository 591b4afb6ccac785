"""`ghst config` with a board: the real firmware on the emulated one, over TCP."""

from __future__ import annotations

import hashlib
import json
import socket
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner
from served_board import ServedBoard

from ghst_tools import board_console, board_link, boards, device_files, filesystem, hello
from ghst_tools.cli import ghst
from ghst_tools.tool_docs import board, examples, run

# The emulated board is as slow as the machine is busy; nothing waits this long for nothing.
PATIENCE_S = 600.0
OLD = b"""{
    "gps": {"enabled": false}, "battery" : {"enabled": false},
\t"barometer": {"enabled": false},\r
    "magnetometer": {"enabled": false}
}"""
WRONG = """{
    "name": "Wing",
    "failsafe": {
        "time_ms": 50
    }
}
"""


@pytest.fixture(scope="module")
def served(micropython_image: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a board that flies by OLD."""
    definition = boards.load("rpi_pico")
    files = device_files.collect(definition) | {"/ghst.json": OLD}
    image = tmp_path_factory.mktemp("image") / "filesystem.img"
    image.write_bytes(filesystem.build(files, definition.filesystem_size))
    emulated = ServedBoard(micropython_image, image)
    yield emulated.address
    assert emulated.stop() == 0


@pytest.fixture
def config(served: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Config:
    monkeypatch.setenv("GHST_STATE", str(tmp_path / "state"))
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setattr(board_console, "ANSWER_S", PATIENCE_S)
    monkeypatch.setattr(hello, "TIMEOUT_S", PATIENCE_S)
    monkeypatch.chdir(tmp_path)
    return Config(served)


class Config:
    """Runs `ghst config` with the port; what it says has BOARD in place of it."""

    def __init__(self, port: str) -> None:
        self.port = port

    def __call__(self, *arguments: str, status: int = 0, given: bytes | None = None) -> str:
        command = ["config", *arguments, "--port", self.port]
        result = CliRunner().invoke(ghst, command, input=given)
        assert result.exit_code == status, result.output
        return result.output.replace(self.port, "BOARD")

    def dump(self) -> bytes:
        return CliRunner().invoke(ghst, ["config", "dump", "--port", self.port]).stdout_bytes


def digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def test_a_pilot_sets_up_a_board_while_its_application_runs(
    config: Config, tmp_path: Path
) -> None:
    # What is there, byte for byte, and what follows from it.
    assert config("pull") == f"ghst.json: {len(OLD)} bytes\n"
    file = tmp_path / "ghst.json"
    assert file.read_bytes() == OLD
    assert config.dump() == OLD
    shown = config("show")
    assert shown.startswith("rpi_pico at BOARD, micropython-ghst 0.1.0, link searching\n")
    assert f"\n/ghst.json: {len(OLD)} bytes, hash {digest(OLD)}\n" in shown
    rows = [line.split() for line in shown.splitlines()]
    assert ["failsafe.time_ms", "500", "ms", "default"] in rows
    assert ["gps.enabled", "false", "true"] in rows
    assert "gps.uart" not in shown
    assert config("get", "outputs.6.channel") == "1\n"
    assert json.loads(config("get", "outputs.6"))["kind"] == "servo"
    assert config("get", "outputs.6.revers", status=1) == (
        "ghst: outputs.6.revers is unknown: did you mean outputs.6.reverse?\n"
    )
    # A file with a mistake does not leave this computer.
    wrong = tmp_path / "wrong.json"
    wrong.write_text(WRONG)
    assert config("push", "wrong.json", status=1) == (
        "ghst: not sent: the board would not take it\n"
        "wrong.json:4: failsafe.time_ms is 50, must be 110..10000 ms\n"
    )
    assert config("set", "failsafe.time_ms", "50", status=1) == (
        "ghst: not changed: failsafe.time_ms is 50, must be 110..10000 ms\n"
    )
    assert config.dump() == OLD
    # One key is changed, and the rest stays.
    assert "saved as /ghst.json" in config("set", "name", "Wing")
    saved = config.dump()
    assert json.loads(saved) == json.loads(OLD) | {"name": "Wing"}
    assert saved == json.dumps(json.loads(saved), indent=4).encode() + b"\n"
    assert config("set", "name", "Wing") == "name is Wing already\n"
    # The file that was pulled before is old now: nothing that the board has is lost unseen.
    file.write_bytes(OLD.replace(b"{\n", b'{\n    "role": "flight",\n', 1))
    assert config("push", "ghst.json", status=1).startswith(
        "ghst: BOARD: /ghst.json on the board is not the one that ghst.json was pulled from or "
        "pushed as: look at it with"
    )
    assert config("diff", "ghst.json", status=1).split() == [
        *("key", "on", "the", "board", "ghst.json", "name", '"Wing"', '""')
    ]
    assert config("pull", status=1).startswith("ghst: ghst.json is there and differs: ")
    said = config("push", "ghst.json", "--force", "--restart")
    kept = Path(said.splitlines()[0].removeprefix("what was on the board is kept as "))
    assert kept.read_bytes() == saved
    assert "\nmicropython-ghst 0.1.0 on rpi_pico, MicroPython 1." in said
    # After the restart it is in force, and this computer knows it.
    assert "newer than what is in force" not in config("show")
    assert config.dump() == file.read_bytes()
    assert config("push", "ghst.json") == "BOARD: has it already\n"
    # What was dumped can be pasted back.
    assert config("push", "-", given=file.read_bytes() + b"\n").endswith(
        "saved as /ghst.json\nIn force after a restart: --restart\n"
    )
    assert config.dump() == file.read_bytes() + b"\n"
    commands = config("dump", "--commands").replace("\n", "\r").encode()
    config("set", "name", "Other", "--no-restart")
    host, port = config.port.removeprefix("socket://").split(":")
    with socket.create_connection((host, int(port))) as terminal:
        terminal.settimeout(PATIENCE_S)
        terminal.sendall(commands)
        printed = b""
        while b'"to": "save"' not in printed:
            printed += terminal.recv(4096)
        assert b'"ghst": "error"' not in printed
    assert config.dump() == file.read_bytes() + b"\n"


def test_the_examples_print_what_the_document_says(config: Config, tmp_path: Path) -> None:
    (tmp_path / "ghst.json").write_text(json.dumps(board.NO_SENSORS))
    config("push", "ghst.json", "--force", "--no-restart")
    document = (boards.checkout() / run.DOCUMENT).read_text(encoding="utf-8")
    (tmp_path / "examples").mkdir()
    with_board = board.runner(config.port, tmp_path / "examples")
    rendered = examples.render(document, with_board=with_board)
    assert rendered.splitlines() == document.splitlines(), "run 'ghst docs-tools'"
    assert len(examples.commands(document)) > rendered.count("$ ghst config") > 5


def test_a_board_at_the_prompt(config: Config, tmp_path: Path) -> None:
    with board_link.connect(config.port) as transport:
        # Left there in the raw REPL, as a program does that breaks.
        transport.fs_writefile("/ghst.json", WRONG.encode())
    output = config("show", status=1)
    assert "the application does not run" in output
    assert output.endswith(
        "ghst: nothing moves, for the file cannot be used:\n"
        "/ghst.json on the board:4: failsafe.time_ms is 50, must be 110..10000 ms\n"
    )
    assert "saved as /ghst.json" in config("set", "failsafe.time_ms", "300", "--no-restart")
    assert config("get", "failsafe.time_ms") == "300\n"
    # It is at the friendly prompt then.
    host, port = config.port.removeprefix("socket://").split(":")
    deadline = time.monotonic() + PATIENCE_S
    with socket.create_connection((host, int(port))) as terminal:
        terminal.settimeout(PATIENCE_S)
        terminal.sendall(b"print(6 * 7)\r")
        printed = b""
        while b"42\r\n>>> " not in printed and time.monotonic() < deadline:
            printed += terminal.recv(4096)
        assert b"42\r\n>>> " in printed
    (tmp_path / "ghst.json").write_bytes(OLD)
    said = config("push", "ghst.json", "--force", "--restart")
    assert "\nmicropython-ghst 0.1.0 on rpi_pico, MicroPython 1." in said
