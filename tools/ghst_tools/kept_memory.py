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


_SECOND = """\
import second
def setup(application):
    second.setup(application)
    application.steps.append(step)
"""
_IMPORT_BYTES = 64
"""More than what is in `_SECOND` and not in `_METER`."""


def meter(board: Board, twice: bool = False) -> dict[str, bytes]:
    """The files that make the application of a board tell, once, what it keeps after a second.

    `twice`: there is a second meter beside it, which tells the same; so `share` can tell what one
    takes itself.
    """
    texts = {"user": _METER}
    if twice:
        texts = {"user": _METER.partition("def setup")[0] + _SECOND, "second": _METER}
    files = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, text in texts.items():
            source = Path(folder) / f"{name}.py"
            source.write_text(text)
            path = f"/{name}.mpy"
            files[path] = device_files.compile_module(source, path, board.mpy_arch)
    return files


def share(once: int, twice: int) -> int:
    """What the meter takes itself, at least, from what is kept with one and with two of them."""
    return max(0, twice - once - _IMPORT_BYTES)


def kept(board: EmulatedBoard) -> int:
    """Run a board that has the file of `meter`, until it tells; returns bytes."""
    output = board.console.output
    board.run_until(lambda: b"end" in output.partition(b"kept ")[2], 6e9)
    return int(output.partition(b"kept ")[2].split()[0])
