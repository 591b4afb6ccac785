"""The console command `ghst`: finds the subcommand's module, and nothing else."""

import contextlib
import errno
import importlib
import io
import os
import sys
import traceback
from typing import Any, NoReturn

import click
from click.shell_completion import CompletionItem

from ghst_tools.errors import GhstError

# Name -> module whose `command` it is, and the line that `ghst --help` shows. A module is imported
# when its subcommand runs, so that help and short commands do not wait for numpy and the emulator.
COMMANDS = {
    "micropython": ("ghst_tools.micropython_image", "Print the MicroPython image, getting it."),
    "image": ("ghst_tools.filesystem", "Write a board's file-system image."),
    "firmware": ("ghst_tools.frozen", "Build MicroPython with the firmware in it."),
    "flash": ("ghst_tools.flash", "Put the firmware on a board and start it."),
    "selftest": ("ghst_tools.selftest.run", "Have a board test itself, with one jumper."),
    "doctor": ("ghst_tools.doctor.run", "Find boards and what is missing, say the next step."),
    "monitor": ("ghst_tools.monitor.run", "Watch a running board: channels, outputs, link."),
    "config": ("ghst_tools.configuration.command", "Check and show a board's configuration."),
    "decode": ("ghst_tools.decode", "Show the frames of a recording, one line each."),
    "sniff": ("ghst_tools.sniff.run", "Listen on the wire: frames, timing, a log."),
    "simulate": ("ghst_tools.simulate.run", "Be a Ghost receiver on a serial adapter."),
    "replay": ("ghst_tools.replay", "Send the receiver's side of a recording to a port."),
    "plot": ("ghst_tools.plot.run", "Draw channels, link and timing of a recording."),
    "vcd": ("ghst_tools.wire_vcd", "Write a log as a VCD file, for PulseView."),
    "emulate": ("ghst_tools.emulator.console_server", "Run the emulated board on a TCP port."),
    "demo": ("ghst_tools.demo.run", "Watch an emulated board follow a simulated receiver."),
    "bench": ("ghst_tools.bench.run", "Measure the firmware on the emulated chip."),
    "campaign": ("ghst_tools.campaign.run", "Attack the firmware, write docs/reliability.md."),
    "wiring": ("ghst_tools.wiring", "Draw the boards' wiring and write docs/boards.md."),
    "mip-manifest": ("ghst_tools.mip", "Write package.json for lib/ghst."),
    "docs-tools": ("ghst_tools.tool_docs.run", "Write docs/tools.md from runs of its examples."),
    "completion": ("ghst_tools.completion", "Print the script that completes in a shell."),
}

_INTERRUPTED = 130  # what a shell makes of Ctrl-C

# What a disk or a device says that takes no more; no defect of the tools.
_TAKES_NO_MORE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class LazyGroup(click.Group):
    """A group whose subcommands are imported on use."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        command = importlib.import_module(COMMANDS[cmd_name][0]).command
        assert isinstance(command, click.Command)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        # click's own version loads every command to suggest a similar name.
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            ctx.fail(f"no command {args[0]!r}: there are {', '.join(COMMANDS)}")
        return super().resolve_command(ctx, args)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        # So does its completion, for the lines of help.
        found = [
            CompletionItem(name, help=line)
            for name, (_, line) in COMMANDS.items()
            if name.startswith(incomplete)
        ]
        return found + click.Command.shell_complete(self, ctx, incomplete)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, line) for name, (_, line) in COMMANDS.items()])

    def invoke(self, ctx: click.Context) -> Any:
        """Run the subcommand; a `GhstError` becomes one line on stderr and exit status 1."""
        try:
            result = super().invoke(ctx)
            sys.stdout.flush()
            return result
        except GhstError as error:
            if ctx.params["verbose"]:
                traceback.print_exc()
            click.echo(f"ghst: {error}", err=True)
            ctx.exit(1)
        except BrokenPipeError:
            # Whoever read the output has seen enough (`ghst decode ... | head`). What is still
            # buffered must not be written when Python ends.
            _write_no_more()
            ctx.exit(0)
        except KeyboardInterrupt:
            click.echo("ghst: stopped", err=True)
            ctx.exit(_INTERRUPTED)


def _version(ctx: click.Context, parameter: click.Parameter, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        # Hashing takes its time: only when it is asked for.
        from importlib.metadata import version

        from ghst_tools.revision import firmware_digest

        click.echo(f"ghst, version {version('micropython-ghst')}, firmware {firmware_digest()}")
        ctx.exit()


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("-v", "--verbose", is_flag=True, help="Show where an error comes from.")
@click.option("--version", is_flag=True, callback=_version, expose_value=False, is_eager=True,
              help="Show the version, and which firmware it is.")  # fmt: skip
def ghst(verbose: bool) -> None:
    """The console command of micropython-ghst.

    Firmware for boards, an emulated board, and a bench kit for the wire between a Ghost receiver
    and a flight controller. `ghst COMMAND --help` tells of each.

    \b
    Exit status:
      0    done; also if the reader of the output has gone
      1    it did not work, or what was checked is not right: the reason is on stderr
      2    wrong usage
      130  stopped with Ctrl-C before the end
    """


def main(args: list[str] | None = None) -> Any:
    """Run `ghst` with these arguments, or those of the process.

    A standard output that takes nothing (a full disk, closed) is told in one line, with exit
    status 1.
    """
    if sys.stdout is None:
        # The next file that is opened would be in its place.
        _fail("standard output is closed")
    if sys.stdin is None:
        os.open(os.devnull, os.O_RDONLY)  # takes the place 0, or the next file would
        sys.stdin = io.TextIOWrapper(io.BufferedReader(_NoInput()))
    try:
        return ghst.main(args=args, prog_name="ghst", standalone_mode=True)
    except OSError as error:
        if error.filename is not None or error.errno not in _TAKES_NO_MORE:
            raise
        _write_no_more()
        _fail(f"standard output: {error.strerror}")


class _NoInput(io.RawIOBase):
    """Stands for a standard input that is closed: only who reads from it fails."""

    def fileno(self) -> int:
        return 0

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: object) -> int:
        raise GhstError("standard input is closed: give it something to read, or name a file")


def _fail(text: str) -> NoReturn:
    with contextlib.suppress(OSError):
        click.echo(f"ghst: {text}", err=True)
    sys.exit(1)


def _write_no_more() -> None:
    """What is still buffered must not be written when Python ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


if __name__ == "__main__":
    main()
