"""How much RAM a running application keeps, measured by a step of its main loop."""

import tempfile
from pathlib import Path

from ghst_tools import device_files
from ghst_tools.boards import Board
from ghst_tools.emulator import Board as EmulatedBoard

_METER = """\
import gc
rounds = 0
def step(now_ms):
    global rounds
    rounds += 1
    if rounds == 300:
        gc.collect()
        print("kept", gc.mem_alloc(), "end")
def setup(application):
    application.steps.append(step)
"""


def meter(board: Board) -> dict[str, bytes]:
    """The file that makes the application of a board tell, once, what it keeps after a second.

    It takes about 450 bytes itself, which are counted.
    """
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "user.py"
        source.write_text(_METER)
        return {"/user.mpy": device_files.compile_module(source, "/user.mpy", board.mpy_arch)}


def kept(board: EmulatedBoard) -> int:
    """Run a board that has the file of `meter`, until it tells; returns bytes."""
    output = board.console.output
    board.run_until(lambda: b"end" in output.partition(b"kept ")[2], 6e9)
    return int(output.partition(b"kept ")[2].split()[0])
