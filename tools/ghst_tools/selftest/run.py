"""Has a board test itself: `ghst selftest`.

The board needs one jumper and no receiver. What it runs beside its firmware is brought into its
memory and forgotten with the next reset.
"""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Iterator

import click
from rich.console import Console

from ghst_tools import boards
from ghst_tools.board_link import find_port, identify
from ghst_tools.boards import Board
from ghst_tools.chips import CHIPS
from ghst_tools.errors import GhstError
from ghst_tools.selftest import before, link, loss, servos, slot
from ghst_tools.selftest.context import Context
from ghst_tools.selftest.firmware import check_firmware
from ghst_tools.selftest.load import BENCH_MODULES, MODULES, load
from ghst_tools.selftest.report import as_json, passed, table
from ghst_tools.selftest.result import Result, Verdict
from ghst_tools.selftest.session import BoardSession, Session, ask

_START = "bench = selftest_bench.Bench({wire}, {pin}, {servos}, {failsafe}, watchdog={watchdog})"
_NEED_JUMPER = (
    "no pulses, bad frames",
    "wire",
    "servos",
    "telemetry slot",
    "failsafe",
    "watchdog",
)


def prepare(session: Session, board: Board) -> Context:
    """Bring what is needed to a board that stands at the prompt with its firmware on it."""
    load(session, (*MODULES, *BENCH_MODULES), board.mpy_arch)
    return Context(session, board, ask(session, "__import__('machine').freq()"))


def checks(context: Context) -> Iterator[Result]:
    """Everything that is checked, in order."""
    session = context.session
    tied = before.jumper(context)
    yield tied
    yield from before.analog(context)
    yield from before.i2c(context)
    if tied.verdict is not Verdict.OK:
        for name in _NEED_JUMPER:
            yield Result(name, "-", "-", Verdict.SKIPPED)
        return
    start(context, watchdog=False)
    yield from link.before_frames(context)
    yield from link.types(context)
    yield from servos.pulses(context)
    yield servos.bad_frames_in_flight(context)
    yield from slot.slots(context)
    yield from loss.failsafe(context)
    session.run("bench.stop()")
    start(context, watchdog=True)
    yield from loss.watchdog(context)


def start(context: Context, watchdog: bool) -> None:
    """Have the board start an adapter and the player; `watchdog`: as `Adapter.start` has it."""
    context.session.run(
        _START.format(
            wire=context.wire_pin,
            pin=context.pin,
            servos=context.servos,
            failsafe=context.failsafe,
            watchdog=watchdog,
        )
    )


def selftest(
    board: str,
    port: str | None,
    report: Callable[[str], None],
    found: Callable[[Result], None] = lambda result: None,
) -> list[Result]:
    """Run the self-test on the board at `port`; leaves it running its firmware.

    `report` is told what goes on, `found` each result as it comes.
    """
    definition = testable(board)
    port = port or find_port(definition)
    results = []
    with BoardSession(port) as session:
        identity = identify(session.transport)
        identity.check(definition)
        check_firmware(session, definition, report)
        try:
            session.forget()
            for result in checks(prepare(session, definition)):
                results.append(result)
                found(result)
        except BaseException:
            # Whatever happened: no pulse may go on, and the board is as it was.
            with contextlib.suppress(Exception):
                session.restart()
            raise
        try:
            report(session.restart())
        except GhstError as error:
            # What was found is worth more.
            report(str(error))
    return results


def testable(name: str) -> Board:
    """The board; `GhstError` if its chip cannot do it."""
    board = boards.load(name)
    chip = CHIPS[board.chip]
    if not chip.is_rp2:
        raise GhstError(
            f"{name}: the self-test plays the receiver by PIO, which the {chip.title} has not: "
            "only boards with an RP2040 or RP2350 can test themselves"
        )
    return board


def _confirm(board: Board) -> None:
    """Ask the user; a motor must not be surprised."""
    if not sys.stdin.isatty():
        raise GhstError(
            "the servo pins will give pulses: say --yes when nothing is connected to them"
        )
    assert board.selftest_pin is not None
    wire, pin = board.label(board.defaults["wire"]["pin"]), board.label(board.selftest_pin)
    click.confirm(
        f"All servo pins of the {board.title} will give pulses: take off servos, motors and "
        f"receiver, and tie {wire} to {pin}. Go on?",
        abort=True,
        err=True,
    )


@click.command()
@click.option("--board", default=boards.DEFAULT_BOARD, show_default=True)
@click.option("--port", help="Serial port, or socket://HOST:PORT; default: the board on USB.")
@click.option("--json", "json_", is_flag=True, help="Print one JSON object instead of a table.")
@click.option("--yes", is_flag=True, help="Do not ask whether servos and receiver are off.")
def command(board: str, port: str | None, json_: bool, yes: bool) -> None:
    """Have a board test its wire, slot, servo pins, ADC, I2C and watchdog, without a receiver.

    One jumper ties the pin of the Ghost wire to the one that plays the receiver, as
    docs/img/selftest_BOARD.svg shows. The exit status is 1 if anything failed or was left out.
    """
    definition = testable(board)
    if not yes:
        _confirm(definition)
    progress = Console(stderr=True)
    with progress.status("connecting ...") as status:
        results = selftest(
            board,
            port,
            report=lambda text: click.echo(text, err=True),
            found=lambda result: status.update(f"{result.check}: {result.verdict.value}"),
        )
    if json_:
        click.echo(json.dumps(as_json(board, results), ensure_ascii=False))
    else:
        Console().print(table(definition, results))
    if not passed(results):
        raise SystemExit(1)
