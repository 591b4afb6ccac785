"""The command `ghst doctor`."""

from __future__ import annotations

from collections.abc import Iterator

import click

from ghst_tools.doctor import board, host, ports
from ghst_tools.doctor.finding import WRONG, Finding


def findings(port: str | None, interrupt: bool) -> Iterator[Finding]:
    """Everything that is found: this computer, USB, and the boards or the one at `port`."""
    yield from host.look()
    if port is not None:
        targets = [port]
    else:
        known = ports.known()
        yield from ports.look(known)
        targets = [str(found.device) for found in known if ports.is_board(found)]
    for target in targets:
        if interrupt:
            # mpremote takes its time to load.
            from ghst_tools.doctor import interrupted

            yield from interrupted.look(target)
        else:
            yield from board.look(target)


@click.command()
@click.option("--port", help="Look at this board alone; or socket://HOST:PORT.")
@click.option(
    "--interrupt", is_flag=True, help="Stop what runs on the board, look at its files, restart it."
)
@click.pass_context
def command(ctx: click.Context, port: str | None, interrupt: bool) -> None:
    """Find boards, versions and what is missing, and say the next step.

    A line for each finding: ok; hint, something that only some need; or WRONG, and then the exit
    status is 1. An application that runs on a board goes on: it is asked on its console. Only
    --interrupt stops it, to look at MicroPython and at the files, and restarts the board.
    """
    wrong = False
    for finding in findings(port, interrupt):
        click.echo(str(finding))
        wrong = wrong or finding.level == WRONG
    if wrong:
        ctx.exit(1)
