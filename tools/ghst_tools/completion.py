"""The command `ghst completion`."""

import click
from click.shell_completion import get_completion_class

_VARIABLE = "_GHST_COMPLETE"


@click.command()
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def command(ctx: click.Context, shell: str) -> None:
    """Print the script that completes commands and options in a shell.

    \b
    bash: eval "$(ghst completion bash)" in ~/.bashrc
    zsh:  eval "$(ghst completion zsh)" in ~/.zshrc
    fish: ghst completion fish > ~/.config/fish/completions/ghst.fish
    """
    complete = get_completion_class(shell)
    assert complete is not None
    click.echo(complete(ctx.find_root().command, {}, "ghst", _VARIABLE).source())
