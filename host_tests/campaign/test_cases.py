"""What once went wrong in the campaign, done again; and that it would be noticed."""

import re
from pathlib import Path
from typing import Any

import pytest

import ghst
from ghst_tools.campaign import cases, library_bytes, wire_bytes
from ghst_tools.campaign.model import Model
from ghst_tools.campaign.picos import Picos
from ghst_tools.campaign.run import attempt
from ghst_tools.campaign.verdict import Wrong
from ghst_tools.errors import GhstError

FILES = sorted(cases.folder().glob("*.json"))
BLOCK = [b"\x82\x0c\x10", bytes.fromhex("820c3100088000088080808080e6")]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_saved_case(path: Path, picos: Picos) -> None:
    cases.replay(cases.load(path), picos)


def test_each_kind_has_a_saved_case() -> None:
    assert {cases.load(path)["kind"] for path in FILES} == set(cases.REPLAYS)


def test_a_wrong_result_is_noticed_and_becomes_a_case(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, picos: Picos
) -> None:
    monkeypatch.setattr(cases, "folder", lambda: tmp_path)
    console = Recorder()
    with monkeypatch.context() as patch:
        # A receiver that takes one pulse too long for right.
        patch.setattr(Model, "_control", one_pulse_too_long)
        _, right = attempt("library", lambda: library_bytes.fuzz(1, 200), console)
        assert not right
    saved = list(tmp_path.glob("*.json"))
    assert len(saved) == 1
    case = cases.load(saved[0])
    assert case["kind"] == "bytes" and "not as the model" in case["reason"]
    assert f"saved as {saved[0].name}" in console.text
    cases.replay(case, picos)
    with monkeypatch.context() as patch:
        patch.setattr(Model, "_control", one_pulse_too_long)
        with pytest.raises(Wrong, match="the receiver is not as the model"):
            cases.replay(case, picos)


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
    assert wrong.value.case == library_bytes.bytes_case(BLOCK)


def test_an_exception_on_the_unix_port_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    expected, _ = library_bytes.on_cpython([BLOCK])
    program = library_bytes._PROGRAM
    failing = program.replace("receiver.feed(piece, length)", "bytearray(length)")
    assert failing != program
    monkeypatch.setattr(library_bytes, "_PROGRAM", failing)
    with pytest.raises(Wrong, match=r"unix port: (.|\n)*MemoryError") as wrong:
        library_bytes.on_unix([BLOCK], expected, 60)
    assert wrong.value.case == library_bytes.bytes_case(BLOCK)


def test_another_state_of_the_chip_is_noticed(picos: Picos, monkeypatch: Any) -> None:
    monkeypatch.setattr(Model, "_control", one_pulse_too_long)
    with pytest.raises(Wrong, match="channels on the chip"):
        wire_bytes.replay(wire_bytes.wire_case([(0.0, BLOCK[0]), (400.0, BLOCK[1])]), picos)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"kind": "bits"}'])
def test_a_file_that_is_no_case(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bytes-1.json"
    path.write_text(text)
    with pytest.raises(GhstError, match=re.escape(str(path))):
        cases.load(path)
