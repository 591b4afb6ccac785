"""The command `ghst`: quick help, errors in one line."""

import os
import shutil
import subprocess
import sys

import click
import pytest
from click.testing import CliRunner

from ghst_tools import boards, cli

HEAVY = ("numpy", "matplotlib", "rp2040py", "littlefs", "mpremote", "serial", "rich")


def run(*args: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "ghst_tools.cli", *args], capture_output=True, text=True
    )


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys\n"
        "from ghst_tools.cli import main\n"
        "try:\n    main(['--help'])\n"
        "except SystemExit as stop:\n    assert stop.code == 0, stop.code\n"
        f"print('imported', [name for name in {HEAVY!r} if name in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith("imported []\n")


def test_every_command_is_listed_and_has_help() -> None:
    listing = CliRunner().invoke(cli.ghst, ["--help"]).output
    for name, (_, line) in cli.COMMANDS.items():
        assert name in listing and line in listing
        result = CliRunner().invoke(cli.ghst, [name, "--help"])
        assert result.exit_code == 0, result.output
        assert result.output.startswith(f"Usage: ghst {name} ")


def test_a_users_mistake_is_one_line_and_status_1() -> None:
    done = run("image", "--board", "no_such_board")
    assert done.returncode == 1
    assert done.stdout == ""
    known = ", ".join(boards.names())
    assert done.stderr == f"ghst: unknown board 'no_such_board': known are {known}\n"


def test_an_unknown_command_names_the_known_ones() -> None:
    done = run("fly")
    assert done.returncode == 2
    assert "no command 'fly': there are micropython, image, firmware, flash" in done.stderr


def test_a_board_that_cannot_be_emulated_is_one_line() -> None:
    done = run("emulate", "--board", "esp32_devkit")
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == (
        "ghst: esp32_devkit cannot be emulated: only boards that run RPI_PICO\n"
    )


def test_exit_statuses_are_told() -> None:
    listing = CliRunner().invoke(cli.ghst, ["--help"]).output
    assert "The console command of micropython-ghst." in listing
    for status in ("0    done", "1    it did not work", "2    wrong usage", "130  stopped with"):
        assert status in listing


def test_verbose_shows_where_an_error_comes_from() -> None:
    done = run("-v", "image", "--board", "no_such_board")
    assert done.returncode == 1
    lines = done.stderr.splitlines()
    assert lines[0] == "Traceback (most recent call last):"
    assert lines[-1].startswith("ghst: unknown board 'no_such_board': known are ")


def test_ctrl_c_is_one_line_and_status_130() -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(cli.COMMANDS, "boom", ("test_cli", ""))
        result = CliRunner().invoke(cli.ghst, ["boom"])
    assert (result.exit_code, result.stdout, result.stderr) == (130, "", "ghst: stopped\n")


def redirected(redirection: str, *args: str) -> tuple[int, str]:
    """Run in a shell; returns the exit status and what was on stderr."""
    done = subprocess.run(
        [
            "sh",
            "-c",
            f'exec "$@" {redirection}',
            "sh",
            sys.executable,
            "-m",
            "ghst_tools.cli",
            *args,
        ],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    return done.returncode, done.stderr


LOG = str(boards.checkout() / "docs" / "examples" / "wire.log")


@pytest.mark.parametrize(
    "args", [("--help",), ("config", "defaults"), ("decode", LOG), ("decode", "--json", LOG)]
)
def test_an_output_that_is_full_or_closed_is_one_line_and_status_1(args: tuple[str, ...]) -> None:
    full = "ghst: standard output: No space left on device\n"
    assert redirected(">/dev/full", *args) == (1, full)
    assert redirected(">&-", *args) == (1, "ghst: standard output is closed\n")


def test_a_closed_input_is_one_line_where_something_is_read_from_it() -> None:
    status, error = redirected("<&-", "decode", "-")
    assert status == 1
    assert error.startswith("ghst: standard input is closed: ") and error.count("\n") == 1
    assert redirected("<&-", "decode", LOG) == (0, "")


def test_a_reader_that_has_gone_is_no_error() -> None:
    assert redirected("| true", "decode", LOG) == (0, "")


@click.command()
def command() -> None:
    """Stands for a command that is interrupted."""
    raise KeyboardInterrupt


def completions(words: str) -> list[str]:
    """What bash offers behind these words."""
    done = subprocess.run(
        [sys.executable, "-m", "ghst_tools.cli"],
        capture_output=True,
        text=True,
        env={
            **os.environ,
            "_GHST_COMPLETE": "bash_complete",
            "COMP_WORDS": words,
            "COMP_CWORD": str(len(words.split(" ")) - 1),
        },
    )
    assert done.stderr == ""
    return [line.split(",")[1] for line in done.stdout.splitlines()]


def test_commands_and_options_are_completed() -> None:
    assert completions("ghst de") == ["decode", "demo"]
    assert completions("ghst --v") == ["--verbose", "--version"]
    assert completions("ghst decode --fo") == ["--follow", "--format"]
    assert completions("ghst decode --format l") == ["log"]


def test_completing_a_command_imports_nothing_heavy() -> None:
    code = (
        "import sys\n"
        "from ghst_tools.cli import main\n"
        "try:\n    main([])\n"
        "except SystemExit:\n    pass\n"
        f"print('imported', [name for name in {HEAVY!r} if name in sys.modules])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env={
            **os.environ,
            "_GHST_COMPLETE": "bash_complete",
            "COMP_WORDS": "ghst sn",
            "COMP_CWORD": "1",
        },
    )
    assert done.stdout == "plain,sniff\nimported []\n", done.stderr


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_a_shell(shell: str) -> None:
    result = CliRunner().invoke(cli.ghst, ["completion", shell])
    assert result.exit_code == 0
    assert f"_GHST_COMPLETE={shell}_complete" in result.stdout
    if shutil.which(shell):
        # Nothing is said by a shell that can read it.
        done = subprocess.run([shell, "-n"], input=result.stdout, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")


def test_bash_knows_the_completion() -> None:
    script = CliRunner().invoke(cli.ghst, ["completion", "bash"]).stdout
    bash = ["bash", "--norc", "-c", f"{script}\ncomplete -p ghst"]
    done = subprocess.run(bash, capture_output=True, text=True)
    assert done.stdout.startswith("complete -o nosort -F _ghst_completion ghst"), done.stderr
