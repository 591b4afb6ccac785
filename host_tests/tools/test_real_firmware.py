"""This tree's firmware on a served board: flashing, mpremote while it runs, the hello."""

import subprocess
import sys

from served_board import ServedBoard

import ghst
from ghst_tools import boards, device_files, flash

PATIENCE_S = 180


def mpremote(board: ServedBoard, *arguments: str) -> str:
    """Run mpremote against the board; return what it printed."""
    done = subprocess.run(
        [sys.executable, "-m", "mpremote", "connect", board.address, *arguments],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )
    assert done.returncode == 0, done.stderr + done.stdout
    return done.stdout


def test_an_empty_board_is_flashed_flies_and_stays_usable(empty_board: ServedBoard) -> None:
    said: list[str] = []
    hello = flash.flash("rpi_pico", empty_board.address, None, said.append, PATIENCE_S)
    assert hello.startswith(f"micropython-ghst {ghst.__version__} on rpi_pico, MicroPython 1.")
    count = len(device_files.collect(boards.load("rpi_pico")))
    assert said[-1] == f"{count} of {count} files copied"
    # The application runs; mpremote interrupts it, and the watchdog leaves it in peace.
    output = mpremote(empty_board, "exec", "import time; time.sleep(1.5); print('still here')")
    assert "still here" in output
    # The watchdog's REASON: bit 0 would be a time-out, bit 1 is the reset at the end of flashing.
    reason = mpremote(empty_board, "exec", "import machine; print(machine.mem32[0x40058008])")
    assert reason.strip() == "2"
    listing = mpremote(empty_board, "fs", "ls", ":/lib/firmware")
    assert "interrupts.mpy" in listing
