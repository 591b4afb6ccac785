"""Whether the firmware on a board is the one of this checkout."""

from __future__ import annotations

from collections.abc import Callable

from ghst_tools import device_files, flash
from ghst_tools.boards import Board
from ghst_tools.errors import GhstError
from ghst_tools.selftest.session import BoardSession

_FROZEN = """
try:
    from ghst_board import DEFINITION
    from ghst import __version__
    print(__version__, bytes(DEFINITION).hex())
except ImportError:
    print()
"""


def check_firmware(session: BoardSession, board: Board, report: Callable[[str], None]) -> None:
    """`GhstError` if the board has another firmware, or none.

    What is frozen in an image can be compared by its version and its board alone; `report` is told
    so.
    """
    wanted = device_files.collect(board)
    present = flash.list_files(session.transport, wanted)
    plan = flash.make_plan(wanted, present)
    if not any(path.startswith("/lib/") for path in present):
        version, _, definition = session.run(_FROZEN).strip().partition(" ")
        if definition:
            if bytes.fromhex(definition) != board.definition:
                raise GhstError(
                    f"{session.port}: the image on the board was built for another one, or from "
                    f"another checkout: make firmware BOARD={board.name}, and copy it there"
                )
            report(f"frozen image, version {version}: what else is in it cannot be compared")
            return
    different = [*plan.copies, *plan.removals]
    if different:
        raise GhstError(
            f"{session.port}: the firmware on the board is not that of this checkout "
            f"({len(different)} files differ, such as {different[0]}): make flash "
            f"BOARD={board.name} PORT={session.port}"
        )
