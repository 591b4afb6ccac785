"""What judges the campaign's results notices what is wrong."""

from __future__ import annotations

import copy

import pytest

from ghst_tools.campaign import configuration_files, corruption, mutation, starts
from ghst_tools.campaign.configuration_files import defaults
from ghst_tools.campaign.configuration_readers import USER, on_host
from ghst_tools.campaign.merge import compare
from ghst_tools.campaign.mutations import LIBRARY, Mutation
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
    ("status", "line", "told"),
    [
        (1, "FAILED host_tests/library/test_x.py::test_it - AssertionError: no", ""),
        (1, "ERROR host_tests/library/test_x.py::test_it - AssertionError: no", ""),
        (2, "ERROR host_tests/library/test_x.py - NameError: no", "no test of"),
        (5, "", "no test of"),
        (0, "", "not noticed by"),
    ],
)
def test_only_a_test_that_fails_has_noticed(
    monkeypatch: pytest.MonkeyPatch, status: int, line: str, told: str
) -> None:
    monkeypatch.setattr(mutation, "_pytest", lambda root, tests: (status, f"F\n{line}\n1 ...\n"))
    if told:
        with pytest.raises(Wrong, match=told):
            mutation.noticed(LIBRARY[0])
    else:
        (row,) = mutation.noticed(LIBRARY[0])
        assert row.happened.startswith("noticed by test_it (pytest")


@pytest.mark.parametrize(
    ("path", "old", "new"),
    [
        ("lib/ghst/decoder.py", "0x1D5", "0x1D5 +"),
        # Both are Python, but no machine code.
        ("lib/ghst/decoder.py", "0x1D5", "1.5"),
        ("firmware/shape_thumb.py", "    ble(DECIDED)\n", "    blue(DECIDED)\n"),
    ],
)
def test_a_mutation_has_to_compile(
    monkeypatch: pytest.MonkeyPatch, path: str, old: str, new: str
) -> None:
    monkeypatch.setattr(mutation, "_pytest", lambda root, tests: pytest.fail("run"))
    with pytest.raises(Wrong, match="does not compile"):
        mutation.noticed(Mutation("one that is none", path, old, new, LIBRARY[0].tests))
