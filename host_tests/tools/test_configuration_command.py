"""`ghst config`: complaints with their lines, defaults that can be given back, the document."""

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from ghst_tools import boards
from ghst_tools.cli import ghst
from ghst_tools.configuration import transfer
from ghst_tools.configuration.command import DOCUMENT
from ghst_tools.configuration.document import document
from ghst_tools.configuration.keys import parse_value
from ghst_tools.configuration.on_board import State
from ghst_tools.errors import GhstError

WRONG = """\
{
    "name": "Wing {of mine}, long",
    "outputs": {
        "6": {"channel": 17},
        "7": {
            "failsafe": [1, 2],
            "spedd": 3
        }
    },
    "gps": {"uart": 1}
}
"""

STATE = State(
    board="rpi_pico",
    id="e660",
    version="0.1.0",
    link="searching",
    problems=(),
    size=2,
    hash="0",
    restart=False,
)


def run(tmp_path: Path, text: str | bytes, *options: str) -> tuple[int, str]:
    """Check a file; returns the exit status and what was said about it."""
    path = tmp_path / "ghst.json"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    result = CliRunner().invoke(ghst, ["config", "check", str(path), *options])
    return result.exit_code, result.output.replace(str(path), "FILE")


def test_each_problem_has_its_line(tmp_path: Path) -> None:
    status, output = run(tmp_path, WRONG)
    assert status == 1
    assert output.splitlines() == [
        'FILE:2: name is "Wing {of mine}, long", must be a text of at most 16 ASCII characters',
        "FILE:4: outputs.6.channel is 17, must be 1..16 or null",
        'FILE:6: outputs.7.failsafe is a list, must be "hold", "none", a pulse in us, or "on" or '
        '"off" for a switch',
        "FILE:7: outputs.7.spedd is unknown, there are channel, kind, name, reverse, minimum_us, "
        "centre_us, maximum_us, subtrim_us, deadband_us, slow_us_per_s, failsafe, frequency_hz, "
        "motor, threshold_us, hysteresis_us",
        "FILE:10: gps.tx_pin: GPIO 0 cannot be uart1 tx, must be one of 4, 8, 20",
        "FILE:10: gps.rx_pin: GPIO 1 cannot be uart1 rx, must be one of 5, 9, 21",
    ]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ('{\n"name": "x",\n}', "FILE:3: not valid JSON: "),
        ("", "FILE:1: not valid JSON: "),
        ('{"failsafe": {"time_ms": NaN}}', "FILE: not valid JSON: NaN is no number"),
        (
            '{"outputs": {"6": {}},\n"gps": {},\n"outputs": {"7": {}}}',
            "FILE:3: outputs stands there a second time, the first is in line 1\n",
        ),
        (
            '{"outputs": {\n"6": {"channel": 1,\n"reverse": true,\n"channel": 2}}}',
            "FILE:4: outputs.6.channel stands there a second time, the first is in line 2\n",
        ),
        ('{"name": "a",\n"name": "b",\n}', "FILE:3: not valid JSON: "),
        ("[]", "FILE:1: the configuration must be a JSON object"),
    ],
)
def test_what_is_no_configuration(tmp_path: Path, text: str, line: str) -> None:
    status, output = run(tmp_path, text)
    assert status == 1
    assert output.startswith(line) and output.count("\n") == 1


def test_a_value_with_a_key_twice_is_refused() -> None:
    assert parse_value('{"channel": 1, "name": "x"}') == {"channel": 1, "name": "x"}
    with pytest.raises(GhstError, match='the key "channel" stands more than once in an object'):
        parse_value('{"channel": 1, "channel": 2}')


def test_what_a_board_would_get_is_checked_the_same_way() -> None:
    with pytest.raises(GhstError, match=r"not sent: .*\nwing\.json:1: name stands there a second"):
        transfer.require(b'{"name": "a", "name": "b"}', "wing.json", STATE)


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    result = CliRunner().invoke(ghst, ["config", "check", str(tmp_path / "none.json")])
    assert result.exit_code == 1
    assert result.output == f"ghst: {tmp_path / 'none.json'}: No such file or directory\n"


@pytest.mark.parametrize(
    "name", [path.parent.name for path in boards.checkout().glob("boards/*/board.json")]
)
def test_the_defaults_of_every_board_can_be_given_back(tmp_path: Path, name: str) -> None:
    defaults = CliRunner().invoke(ghst, ["config", "defaults", "--board", name])
    assert defaults.exit_code == 0
    assert json.loads(defaults.output)["failsafe"]["time_ms"] == 500
    assert run(tmp_path, defaults.output, "--board", name) == (0, f"FILE: {name} takes it\n")


def test_the_document_is_of_these_points() -> None:
    assert (boards.checkout() / DOCUMENT).read_text(encoding="utf-8") == document()


@pytest.mark.parametrize("name", ["README.md", "docs/configuration.md"])
def test_the_example_is_taken(tmp_path: Path, name: str) -> None:
    text = (boards.checkout() / name).read_text(encoding="utf-8")
    block = re.search(r"^    \{\n(?: {5,}.*\n)*    \}\n", text, re.MULTILINE)
    assert block is not None
    assert run(tmp_path, block[0]) == (0, "FILE: rpi_pico takes it\n")


def test_an_empty_object_is_as_good_as_no_file_and_an_empty_file_is_not(tmp_path: Path) -> None:
    assert run(tmp_path, "{}") == (0, "FILE: rpi_pico takes it\n")
    assert run(tmp_path, "")[0] == 1
    text = (boards.checkout() / DOCUMENT).read_text(encoding="utf-8")
    assert "one that says `{}`" in text


def test_the_limits_of_each_kind_in_the_document_are_those_that_are_checked(
    tmp_path: Path,
) -> None:
    text = (boards.checkout() / DOCUMENT).read_text(encoding="utf-8")
    limits = re.findall(r"(\d+)\.\.(\d+) us with `(\w+)`", text)
    assert [kind for _, _, kind in limits] == ["servo", "servo_760", "oneshot125"]
    for lowest, highest, kind in limits:
        for failsafe, status in (
            (int(lowest) - 1, 1),
            (int(lowest), 0),
            (int(highest), 0),
            (int(highest) + 1, 1),
        ):
            file = {"outputs": {"6": {"kind": kind, "failsafe": failsafe}}}
            assert run(tmp_path, json.dumps(file))[0] == status, (kind, failsafe)
