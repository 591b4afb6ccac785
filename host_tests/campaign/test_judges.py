"""What judges the campaign's results notices what is wrong."""

from __future__ import annotations

import copy

import pytest

from ghst_tools.campaign import configuration_files, corruption, mutation, starts
from ghst_tools.campaign.configuration_files import defaults
from ghst_tools.campaign.configuration_readers import USER, on_host
from ghst_tools.campaign.merge import compare
from ghst_tools.campaign.mutations import LIBRARY
from ghst_tools.campaign.verdict import Wrong

TEXT = corruption.user_file()


def test_each_value_that_is_not_what_the_file_says_is_noticed() -> None:
    ((kind, values),) = on_host(USER, [TEXT])
    assert kind == "valid"
    compare(values, TEXT, defaults())
    changes = [(section, name) for section, named in values.items() for name in named]
    assert len(changes) > 40
    for section, name in changes:
        wrong = copy.deepcopy(values)
        wrong[section][name] = "another"
        with pytest.raises(Wrong, match=rf"{section}\.{name} is 'another'"):
            compare(wrong, TEXT, defaults())
    wrong = copy.deepcopy(values)
    wrong["outputs"][7]["minimum_us"] = 1100.5
    with pytest.raises(Wrong, match=r"outputs\.7"):
        compare(wrong, TEXT, defaults())
    del wrong["outputs"][7]
    with pytest.raises(Wrong, match="names in outputs"):
        compare(wrong, TEXT, defaults())


@pytest.mark.parametrize(
    ("where", "line", "right"),
    [
        ("host", "/tmp/x/ghst.json: wire.pin is 99, must be a GPIO number", True),
        ("host", "/tmp/x/ghst.json is broken: no valid JSON", True),
        ("host", "wire.pin is 99, must be a GPIO number", False),
        ("host", "/tmp/x/board.json: wire.pin is 99, must be a GPIO number", False),
        ("emulated board", "/texts/7 is broken: no valid JSON", True),
        ("emulated board", "/ghst.json is broken: no valid JSON", False),
    ],
)
def test_an_error_names_its_file(where: str, line: str, right: bool) -> None:
    outcome = ("problems", line, 0)
    if right:
        assert configuration_files._judged(outcome, USER, b"{", where) == "error"
    else:
        with pytest.raises(Wrong, match="names no file"):
            configuration_files._judged(outcome, USER, b"{", where)


def test_limits_are_those_of_the_file_or_else_of_the_kind() -> None:
    output = {"kind": "servo", "motor": False, "minimum_us": None, "maximum_us": 1900}
    assert starts._limits_us(output) == (800, 1900)
    assert starts._limits_us(output | {"motor": True, "maximum_us": None}) == (988, 2012)
    assert starts._limits_us(output | {"kind": "oneshot125", "maximum_us": None}) == (100, 275)


@pytest.mark.parametrize(
    ("word", "told"),
    [("FAILED", "noticed by test_it (pytest"), ("ERROR", "noticed by test_it, before its test")],
)
def test_a_fixture_that_fails_is_told_from_a_test(
    monkeypatch: pytest.MonkeyPatch, word: str, told: str
) -> None:
    output = f"F\n{word} host_tests/library/test_x.py::test_it - AssertionError: no\n1 failed\n"
    monkeypatch.setattr(mutation, "_pytest", lambda root, tests: (1, output))
    (row,) = mutation.noticed(LIBRARY[0])
    assert row.happened.startswith(told)
