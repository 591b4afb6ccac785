"""The self-test on an emulated Pico, without a port between them: all in emulated time."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from ghst_tools import boards
from ghst_tools.campaign.pico import Pico
from ghst_tools.emulator import Jumper
from ghst_tools.selftest import run
from ghst_tools.selftest.context import Context
from ghst_tools.selftest.result import Result, Verdict

BOARD = boards.load("rpi_pico")
WIRE, PLAYER = 2, 3


class EmulatedSession:
    """What `BoardSession` is for a board on a port."""

    def __init__(self, pico: Pico) -> None:
        self.board = pico.board

    def run(self, code: str) -> str:
        return self.board.exec(code)

    def run_into_reset(self, code: str) -> str | None:
        board = self.board
        resets, start = len(board.resets), len(board.console.output)
        board.start(code)
        board.run_until(lambda: len(board.resets) > resets or board.done, 10e9)
        if len(board.resets) == resets:
            return None
        board.boot(until=b"link: searching")
        return bytes(board.console.output[start:]).decode()


class Rig:
    """A board with the firmware at the prompt, its jumper, and the self-test's modules."""

    def __init__(self, pico: Pico) -> None:
        self.pico = pico
        self.board = pico.board
        self.jumper = Jumper(self.board, WIRE, PLAYER)
        self.session = EmulatedSession(pico)
        self.context = run.prepare(self.session, BOARD)

    def start(self) -> None:
        """Start the adapter that is put to the test."""
        run.start(self.context, watchdog=False)

    def all(self) -> list[Result]:
        """The whole self-test."""
        return list(run.checks(self.context))

    def of(self, checks: Callable[[Context], Iterable[Result]]) -> dict[str, Result]:
        """The results of some checks by name."""
        return {result.check: result for result in checks(self.context)}


def not_ok(results: Iterable[Result]) -> list[str]:
    """The names of the checks that found something."""
    return [result.check for result in results if result.verdict is not Verdict.OK]
