"""The examples that talk to a board: on the emulated one, as if it were on USB."""

from __future__ import annotations

import contextlib
import json
import os
import shlex
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from click.testing import CliRunner

from ghst_tools import board_console, boards, device_files, filesystem
from ghst_tools.cli import ghst
from ghst_tools.configuration import known_files
from ghst_tools.tool_docs.examples import Run

SHOWN_PORT = "/dev/ttyACM0"
NO_SENSORS: Mapping[str, Any] = {
    name: {"enabled": False} for name in ("battery", "gps", "barometer", "magnetometer")
}
_PATIENCE_S = 600.0
_COLUMNS = "100"


def runner(address: str, folder: Path) -> Run:
    """Runs `ghst config ...` in this process, in `folder`, with the board at `address`."""

    def run(command: str) -> str:
        environment = {
            "GHST_PORT": address,
            known_files.STATE_VARIABLE: str(folder / ".state"),
            "COLUMNS": _COLUMNS,
        }
        program, *arguments = shlex.split(command)
        assert program == "ghst", command
        # The emulated board is slow.
        patience_s, board_console.ANSWER_S = board_console.ANSWER_S, _PATIENCE_S
        try:
            with contextlib.chdir(folder):
                output = CliRunner().invoke(ghst, arguments, env=environment).output
        finally:
            board_console.ANSWER_S = patience_s
        lines = output.replace(address, SHOWN_PORT).splitlines()
        return "".join(f"{line.rstrip()}\n" for line in lines)

    return run


@contextlib.contextmanager
def emulated(folder: Path) -> Iterator[str]:
    """The address of an emulated board with the firmware, and without sensors."""
    image = folder / "filesystem.img"
    definition = boards.load(boards.DEFAULT_BOARD)
    files = device_files.collect(definition)
    files["/ghst.json"] = json.dumps(NO_SENSORS).encode()
    image.write_bytes(filesystem.build(files, definition.filesystem_size))
    process = subprocess.Popen(
        [sys.executable, "-m", "ghst_tools.cli", "emulate", "--filesystem", str(image)],
        stdout=subprocess.PIPE,
        env=dict(os.environ),
        text=True,
    )
    assert process.stdout is not None
    try:
        yield process.stdout.readline().split()[3].rstrip(":")
    finally:
        process.terminate()
        process.wait()
