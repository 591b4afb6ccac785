"""What once went wrong in the campaign, done again; and that it would be noticed."""

import re
import subprocess
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import ghst
from ghst_tools.campaign import cases, library_bytes, wire_bytes
from ghst_tools.campaign.areas import AREAS, Area
from ghst_tools.campaign.effort import SEED, SHORT
from ghst_tools.campaign.fork import ChildError
from ghst_tools.campaign.model import Model
from ghst_tools.campaign.picos import Picos
from ghst_tools.campaign.run import attempt
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Row, Wrong
from ghst_tools.emulator.repl import DeviceError
from ghst_tools.errors import GhstError

FILES = sorted(cases.folder().glob("*.json"))
BLOCK = [b"\x82\x0c\x10", bytes.fromhex("820c3100088000088080808080e6")]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_saved_case(path: Path, picos: Picos) -> None:
    cases.replay(cases.load(path), picos)


def test_each_kind_has_a_saved_case() -> None:
    # A whole trial is saved only for want of anything smaller: see below.
    assert {cases.load(path)["kind"] for path in FILES} | {"trial"} == set(cases.REPLAYS)


def test_a_wrong_result_is_noticed_and_becomes_a_case(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, picos: Picos
) -> None:
    monkeypatch.setattr(cases, "folder", lambda: tmp_path)
    console = Recorder()
    with monkeypatch.context() as patch:
        # A receiver that takes one pulse too long for right.
        patch.setattr(Model, "_control", one_pulse_too_long)
        setting = Setting(picos.image, SHORT, SEED)
        trial = partial(library_bytes.fuzz, 1, 200, True)
        _, right = attempt("bytes", "library", trial, setting, console)
        assert not right
    saved = list(tmp_path.glob("*.json"))
    assert len(saved) == 1
    case = cases.load(saved[0])
    assert case["kind"] == "bytes" and "not as the model: pulses=" in case["reason"]
    assert case["reason"].endswith("(done again, it went wrong again)")
    assert f"saved as {saved[0].name}" in console.text
    cases.replay(case, picos)
    with monkeypatch.context() as patch:
        patch.setattr(Model, "_control", one_pulse_too_long)
        with pytest.raises(Wrong, match="the receiver is not as the model"):
            cases.replay(case, picos)


@pytest.mark.parametrize(
    "error",
    [
        *(Wrong("it moved"), TimeoutError("it moved"), ChildError("it moved")),
        *(DeviceError("it moved"), ValueError("it moved"), GhstError("it moved")),
        subprocess.TimeoutExpired("it moved", 60),
    ],
    ids=repr,
)
def test_a_failure_without_a_case_is_saved_as_its_trial(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, picos: Picos, error: Exception
) -> None:
    monkeypatch.setattr(cases, "folder", lambda: tmp_path)
    asked: list[Setting] = []
    broken = True

    def trial(setting: Setting) -> list[Row]:
        asked.append(setting)
        if broken:
            raise error
        return [Row("a fault", "done", "nothing")]

    area = Area("Line", lambda setting: iter([("moving", partial(trial, setting))]))
    monkeypatch.setitem(AREAS, "line", area)
    setting = Setting(picos.image, SHORT, 7)
    rows, right = attempt("line", "moving", partial(trial, setting), setting, Recorder())
    assert not right and "it moved" in rows[0].happened
    (path,) = tmp_path.iterdir()
    case = cases.load(path)
    with pytest.raises(type(error), match="it moved"):
        cases.replay(case, picos)
    broken = False
    cases.replay(case, picos)
    assert [(one.image, one.effort, one.seed) for one in asked] == 3 * [(picos.image, SHORT, 7)]
    assert asked[-1].picos is picos
    with pytest.raises(Wrong, match="no trial line, 'flying' any more"):
        cases.replay(case | {"name": "flying"}, picos)


def test_ctrl_c_is_no_failure(monkeypatch: pytest.MonkeyPatch, picos: Picos) -> None:
    def trial() -> list[Row]:
        raise KeyboardInterrupt

    monkeypatch.setattr(cases, "save", lambda *arguments: pytest.fail("saved"))
    with pytest.raises(KeyboardInterrupt):
        attempt("line", "moving", trial, Setting(picos.image, SHORT, 7), Recorder())


def test_a_whole_trial_as_a_case_is_the_trial_of_its_area(picos: Picos) -> None:
    case = cases.trial_case("mutation", "applicable", Setting(Path(), SHORT, SEED))
    del case["effort"]["talks"]
    cases.replay(case | {"effort": case["effort"] | {"unknown": 1}}, picos)


class Recorder:
    """Takes what would be printed."""

    text = ""

    def print(self, line: str, **_: object) -> None:
        self.text += line


_control = Model._control


def one_pulse_too_long(model: Model, kind: int, payload: bytes) -> None:
    """As the model's, but for the first channel."""
    _control(model, kind, payload)
    model.pulses[0] += 1


def test_an_exception_on_cpython_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(receiver: object, data: bytes) -> int:
        raise IndexError("of the test")

    monkeypatch.setattr(ghst.Receiver, "feed", fail)
    with pytest.raises(Wrong, match="CPython: IndexError: of the test") as wrong:
        library_bytes.on_cpython([BLOCK])
    assert wrong.value.case == library_bytes.bytes_case(BLOCK, True)


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("bytearray(length)", r"(.|\n)*MemoryError"),
        ("__import__('sys').exit()", "nothing, the model has"),
        ("__import__('time').sleep(60)", "no answer within 2 s"),
    ],
)
def test_a_failure_of_the_unix_port_is_noticed(
    monkeypatch: pytest.MonkeyPatch, code: str, told: str
) -> None:
    expected = library_bytes.on_cpython([BLOCK]).lines
    program = library_bytes._PROGRAM
    failing = program.replace("receiver.feed(piece, length)", code)
    assert failing != program
    monkeypatch.setattr(library_bytes, "_PROGRAM", failing)
    with pytest.raises(Wrong, match=f"unix port: {told}") as wrong:
        library_bytes.on_unix([BLOCK], expected, 2)
    assert wrong.value.case == library_bytes.bytes_case(BLOCK, True)


def test_another_state_of_the_chip_is_noticed(picos: Picos, monkeypatch: Any) -> None:
    monkeypatch.setattr(Model, "_control", one_pulse_too_long)
    with pytest.raises(Wrong, match="on the chip: pulses: "):
        wire_bytes.replay(wire_bytes.wire_case([(0.0, BLOCK[0]), (400.0, BLOCK[1])]), picos)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"kind": "bits"}'])
def test_a_file_that_is_no_case(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bytes-1.json"
    path.write_text(text)
    with pytest.raises(GhstError, match=re.escape(str(path))):
        cases.load(path)
