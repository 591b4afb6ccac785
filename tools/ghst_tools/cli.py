"""The console command `ghst`: finds the subcommand's module, and nothing else."""

import importlib
import sys
from typing import Any

import click

from ghst_tools.errors import GhstError

# Name -> module whose `command` it is, and the line that `ghst --help` shows. A module is imported
# when its subcommand runs, so that help and short commands do not wait for numpy and the emulator.
COMMANDS = {
    "micropython": ("ghst_tools.micropython_image", "Print the MicroPython image, getting it."),
    "image": ("ghst_tools.filesystem", "Write a board's file-system image."),
    "firmware": ("ghst_tools.frozen", "Build MicroPython with the firmware in it."),
    "flash": ("ghst_tools.flash", "Put the firmware on a board and start it."),
    "config": ("ghst_tools.configuration.command", "Check and show a board's configuration."),
    "emulate": ("ghst_tools.emulator.console_server", "Run the emulated board on a TCP port."),
    "demo": ("ghst_tools.demo.run", "Watch an emulated board follow a simulated receiver."),
    "bench": ("ghst_tools.bench.run", "Measure the firmware on the emulated chip."),
    "wiring": ("ghst_tools.wiring", "Draw the boards' wiring and write docs/boards.md."),
    "mip-manifest": ("ghst_tools.mip", "Write package.json for lib/ghst."),
}


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

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, line) for name, (_, line) in COMMANDS.items()])


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="micropython-ghst")
def ghst() -> None:
    """Tools for the Ghost receiver adapter: images, boards, the emulated board."""


def main(args: list[str] | None = None) -> Any:
    """Run `ghst`; a `GhstError` becomes one line on stderr and exit status 1."""
    try:
        return ghst.main(args=args, prog_name="ghst", standalone_mode=True)
    except GhstError as error:
        click.echo(f"ghst: {error}", err=True)
        sys.exit(1)


if __name__ == "__main__":
    main()
