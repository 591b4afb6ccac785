"""The command `ghst campaign` and what it writes."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from ghst_tools import boards
from ghst_tools.campaign import cases, document, run
from ghst_tools.campaign.areas import AREAS, Area
from ghst_tools.campaign.effort import LONG
from ghst_tools.campaign.verdict import Row, Wrong
from ghst_tools.cli import ghst

ORDER = ("First", "Second", "Third")


def section(title: str, happened: str) -> document.Section:
    """A section with one row."""
    return document.Section(title, "ghst campaign x", 1, 2.4, [Row("a fault", "done", happened)])


def test_a_section_takes_the_place_of_its_old_one_and_no_other() -> None:
    first = document.update("", ORDER, {t: section(t, "good") for t in ("Third", "First")}, "v1")
    assert [line for line in first.splitlines() if line[:3] == "## "] == ["## First", "## Third"]
    later = {t: section(t, "better | or\nnot") for t in ("Second", "Third")}
    second = document.update(first, ORDER, later, "v2")
    parts = second.split("## ")
    assert [part.split("\n")[0] for part in parts[1:]] == list(ORDER)
    assert parts[1] == first.split("## ")[1].split("## ")[0]
    assert "| a fault | done | better \\| or not |" in parts[3] and "v2" in parts[3]
    assert document.update(second, ORDER, {}, "v3") == second


def trials(setting: object) -> object:
    """One trial that is right and one that is not."""

    def wrong() -> list[Row]:
        raise Wrong("it moved", {"kind": "bytes", "pieces": ["00"]})

    yield "right", lambda: [Row("a fault", "done", "nothing")]
    yield "wrong", wrong


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, micropython_image: Path) -> CliRunner:
    """The command, with an area of two trials, and cases in a folder of the test's."""
    monkeypatch.setitem(AREAS, "line", Area("Line", trials))
    monkeypatch.setattr(cases, "folder", lambda: tmp_path / "cases")
    return CliRunner()


def test_what_goes_wrong_is_told_saved_and_written(command: CliRunner, tmp_path: Path) -> None:
    out = tmp_path / "reliability.md"
    result = command.invoke(ghst, ["campaign", "--short", "line", "--out", str(out)])
    assert result.exit_code == 1
    assert result.stderr == "ghst: 1 trials went wrong\n"
    (saved,) = (tmp_path / "cases").iterdir()
    assert cases.load(saved) == {"kind": "bytes", "pieces": ["00"], "reason": "it moved"}
    text = out.read_text()
    assert "| a fault | done | nothing |" in text
    assert f"| wrong |  | WRONG: it moved (saved as {saved.name}) |" in text
    assert "`ghst campaign --short line` on " in text and ", seed 1, " in text


def test_the_short_form_writes_nothing_unless_asked_to(
    command: CliRunner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run, "write", lambda *arguments: pytest.fail("written"))
    assert command.invoke(ghst, ["campaign", "--short", "line"]).exit_code == 1


def test_wrong_usage(command: CliRunner) -> None:
    for arguments in (
        ["sea"],
        ["--share", "0"],
        ["--minutes", "0"],
        ["--board-files", "0"],
        ["--short", "--share", "0.5"],
    ):
        assert command.invoke(ghst, ["campaign", *arguments]).exit_code == 2


def test_a_share_of_the_long_form() -> None:
    tenth = LONG.share(0.1)
    assert (tenth.library_bytes, tenth.flight_s, tenth.power_cases) == (1_000_000, 360, 1)
    assert tenth.mutations is None


def test_the_document_of_the_tree_has_every_section_and_nothing_went_wrong() -> None:
    text = (boards.checkout() / run.DOCUMENT).read_text(encoding="utf-8")
    titles = [line[3:] for line in text.splitlines() if line.startswith("## ")]
    assert titles == [area.title for area in AREAS.values()]
    assert "WRONG" not in text
