"""The command `ghst`: quick help, errors in one line."""

import subprocess
import sys

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
