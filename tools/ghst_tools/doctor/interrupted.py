"""What is on a board, whatever it is: by interrupting what runs there, and starting it anew."""

from __future__ import annotations

from collections.abc import Iterator

from ghst_tools import boards, device_files
from ghst_tools.board_link import connect, identify
from ghst_tools.doctor.finding import GOOD, WRONG, Finding
from ghst_tools.errors import GhstError
from ghst_tools.flash import list_files, make_plan


def look(port: str) -> Iterator[Finding]:
    """Findings about MicroPython and the files of the board at `port`, which restarts."""
    try:
        with connect(port) as transport:
            identity = identify(transport)
            version = ".".join(map(str, identity.version))
            text = f"{identity.machine}, {identity.name} {version}"
            text += f", .mpy files for {identity.architecture}"
            yield Finding(GOOD, port, text)
            names = [n for n in boards.names() if boards.load(n).machine == identity.machine]
            if not names:
                step = f"there is firmware for {', '.join(boards.names())}"
                yield Finding(WRONG, port, "a board that is not known here", step)
            else:
                board = boards.load(names[0])
                try:
                    identity.check(board)
                except GhstError as error:
                    yield Finding(WRONG, port, str(error))
                wanted = device_files.collect(board)
                plan = make_plan(wanted, list_files(transport, wanted))
                yield _files(port, len(plan.copies), len(wanted), names[0])
            transport.exec_raw_no_follow("import machine; machine.reset()")
    except GhstError as error:
        yield Finding(WRONG, port, str(error).removeprefix(f"{port}: "))


def _files(port: str, missing: int, count: int, board: str) -> Finding:
    if not missing:
        return Finding(GOOD, port, f"all {count} files are those of this checkout")
    text = f"{missing} of {count} files are missing or not those of this checkout"
    return Finding(WRONG, port, text, f"make flash BOARD={board}")
