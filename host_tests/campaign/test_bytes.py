"""The campaign's bytes: faults of the decoder are noticed, and what is saved goes wrong again."""

from __future__ import annotations

import random
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import ghst
from ghst_tools import boards
from ghst_tools.campaign import again, cases, library_bytes, mutation, streams, wire_bytes
from ghst_tools.campaign.areas import AREAS
from ghst_tools.campaign.effort import SEED, SHORT
from ghst_tools.campaign.model import Model, frame
from ghst_tools.campaign.mutations import LIBRARY, Mutation
from ghst_tools.campaign.picos import Picos
from ghst_tools.campaign.run import attempt
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Case, Trial, Wrong

MUTATIONS = {one.what: one for one in LIBRARY}
NO_MIRROR = MUTATIONS["no mirror for frames that wrap in the ring"]
COUNT = 30_000
NOTICED = [
    "telemetry asked for by another bit",
    "video power with its second byte in the wrong place",
    "MSP frames that write beside their place",
    NO_MIRROR.what,
]


def broken(mutation_: Mutation) -> type:
    """The class `Receiver` as it is with a mutation."""
    modules: dict[str, ModuleType] = {}
    with pytest.MonkeyPatch.context() as patch:
        for name in ("decoder", "receiver"):
            path = boards.checkout() / "lib/ghst" / f"{name}.py"
            text = path.read_text(encoding="utf-8")
            if mutation_.path.endswith(path.name):
                text = mutation.mutated(mutation_, boards.checkout())
            modules[name] = ModuleType(f"ghst.{name}")
            # The types of viper's parameters are no strings there.
            exec(compile(text, path, "exec", dont_inherit=True), modules[name].__dict__)
            patch.setitem(sys.modules, f"ghst.{name}", modules[name])
    receiver: type = modules["receiver"].__dict__["Receiver"]
    return receiver


@pytest.mark.parametrize("what", NOTICED)
def test_on_cpython_the_fuzz_notices(monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    monkeypatch.setattr(ghst, "Receiver", broken(MUTATIONS[what]))
    with pytest.raises(Wrong, match="CPython: the receiver is not as the model"):
        library_bytes.on_cpython(streams.blocks(SEED, COUNT))


@pytest.mark.parametrize("what", NOTICED)
def test_on_the_unix_port_the_fuzz_notices(monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    made = list(streams.blocks(SEED, COUNT))
    expected = library_bytes.on_cpython(made).lines
    with mutation._copy() as root:
        text = mutation.mutated(MUTATIONS[what], root)
        (root / MUTATIONS[what].path).write_text(text, encoding="utf-8")
        monkeypatch.setattr(boards, "checkout", lambda: root)
        with pytest.raises(Wrong, match=r"unix port: .*, the model has "):
            library_bytes.on_unix(made, expected, 60)


@pytest.mark.parametrize(
    "name", ["telemetry_requested", "vtx_power_mw", "vtx_control", "alt_scale"]
)
def test_on_the_board_another_value_is_noticed(
    monkeypatch: pytest.MonkeyPatch, picos: Picos, name: str
) -> None:
    # The same for all: the model's frames leave that value as it was.
    accept = Model._accept

    def forgetful(model: Model, *arguments: Any) -> None:
        before = getattr(model, name)
        accept(model, *arguments)
        setattr(model, name, before)

    monkeypatch.setattr(Model, "_accept", forgetful)
    pieces = [
        frame(0x82, 0x33, bytes(6) + bytes((100, 60, 0x6B, 20))),
        frame(0x83, 0x20, bytes((1, 0x9E, 0x16, 0x58, 0x02, 0x4A, 0, 0, 0, 0))),
        frame(0x82, 0x14, bytes(6) + b"wxyz"),
        streams.sentinel(random.Random(1)),
    ]
    block = [(400.0, piece) for piece in pieces]
    with pytest.raises(Wrong, match=f"on the chip: {name}: "):
        wire_bytes.replay(wire_bytes.wire_case(block), picos)


def test_on_the_board_another_msp_payload_is_noticed(
    monkeypatch: pytest.MonkeyPatch, picos: Picos
) -> None:
    accept = Model._accept

    def empty(model: Model, *arguments: Any) -> None:
        accept(model, *arguments)
        model.msp_waiting = [bytes(10) for _ in model.msp_waiting]

    monkeypatch.setattr(Model, "_accept", empty)
    pieces = [frame(0x82, 0x21, bytes(range(10))), streams.sentinel(random.Random(1))]
    with pytest.raises(Wrong, match="on the chip: MSP: "):
        wire_bytes.replay(wire_bytes.wire_case([(400.0, piece) for piece in pieces]), picos)


def swallowed() -> list[bytes]:
    """The beginning of a frame that ends in the intact one behind it, with the right CRC."""
    intact = streams.sentinel(random.Random(1))
    for number in range(0x10000):
        false = frame(0x82, 0x30, number.to_bytes(2, "big") + intact[:8])
        if false[-1] == intact[8]:
            return [false[:5], intact]
    raise AssertionError


def test_an_intact_frame_may_be_lost_only_in_another_without_a_pause() -> None:
    block = swallowed()
    without = library_bytes.on_cpython([block], paused=False)
    assert without.intact == 0
    library_bytes.on_unix([block], without.lines, 60, paused=False)
    assert library_bytes.on_cpython([block]).intact == 1


def failed(area: str, name: str, trial: Trial, picos: Picos, folder: Path) -> Case:
    """The case that is saved when a trial goes wrong."""
    _, right = attempt(area, name, trial, Setting(picos.image, SHORT, SEED), Quiet())
    assert not right
    (path,) = folder.iterdir()
    return cases.load(path)


class Quiet:
    """Prints nothing."""

    def print(self, *arguments: object, **options: object) -> None:
        pass


@pytest.fixture
def folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Path]:
    """Where cases go."""
    monkeypatch.setattr(cases, "folder", lambda: tmp_path)
    yield tmp_path


@pytest.mark.parametrize("paused", [True, False])
def test_what_goes_wrong_only_behind_others_is_saved_with_them(
    monkeypatch: pytest.MonkeyPatch, picos: Picos, folder: Path, paused: bool
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(ghst, "Receiver", broken(NO_MIRROR))
        trial = partial(library_bytes.fuzz, SEED, COUNT, paused)
        case = failed("bytes", "library", trial, picos, folder)
        assert case["kind"] == "bytes" and case["before"]
        assert "alone it was right; done again behind the" in case["reason"]
        with pytest.raises(Wrong, match="not as the model"):
            cases.replay(case, picos)
        del case["before"]
        cases.replay(case, picos)
    cases.replay(cases.load(next(folder.iterdir())), picos)


class Tired(ghst.Receiver):  # type: ignore[misc]
    """One that has decoded too much."""

    @property
    def frames(self) -> int:
        count: int = super().frames
        return count + (count > 250)


def test_what_goes_wrong_only_behind_many_is_saved_as_the_trial_up_to_there(
    monkeypatch: pytest.MonkeyPatch, picos: Picos, folder: Path
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(ghst, "Receiver", Tired)
        trial = dict(AREAS["bytes"].trials(Setting(picos.image, SHORT, SEED)))["library"]
        case = failed("bytes", "library", trial, picos, folder)
        assert case["kind"] == "trial" and "frames=" in case["reason"]
        assert "the trial up to there: done again alone, it was right, behind" in case["reason"]
        count = case["effort"]["library_bytes"]
        assert count < SHORT.library_bytes / 10
        with pytest.raises(Wrong, match="frames=") as wrong:
            cases.replay(case, picos)
        assert wrong.value.counts == {"library_bytes": count}
    cases.replay(case, picos)


def test_a_wire_case_is_saved_with_what_was_before_it(
    monkeypatch: pytest.MonkeyPatch, picos: Picos, folder: Path
) -> None:
    control = Model._control

    def tired(model: Model, kind: int, payload: bytes) -> None:
        control(model, kind, payload)
        model.frames += model.frames == 12

    monkeypatch.setattr(Model, "_control", tired)
    trial = partial(wire_bytes.fuzz, picos, SEED, 10_000)
    case = failed("bytes", "wire", trial, picos, folder)
    assert case["kind"] == "wire" and case["before"]
    with pytest.raises(Wrong, match="on the chip: frames: "):
        cases.replay(case, picos)


def test_blocks_of_other_trials_are_found_again() -> None:
    def case_of(number: int) -> tuple[Case, int]:
        return {"number": number}, 10

    with pytest.raises(Wrong) as wrong, again.among(range(100), case_of, "line_frames"):
        raise Wrong("it moved", {"number": 9})
    assert [[one["number"] for one in again.blocks_of(case)] for case in wrong.value.wider] == [
        [8, 9],
        list(range(2, 10)),
        list(range(10)),
    ]
    assert wrong.value.counts == {"line_frames": 100}
    with pytest.raises(Wrong) as wrong, again.among(range(100), case_of, "line_frames"):
        raise Wrong("it moved")
    assert (wrong.value.wider, wrong.value.counts) == ([], {})
