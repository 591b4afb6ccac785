"""The command `ghst campaign` and what it writes."""

from __future__ import annotations

import re
from datetime import date
from pathlib import Path

import pytest
from click.testing import CliRunner

from ghst_tools import boards
from ghst_tools.campaign import cases, document, run
from ghst_tools.campaign.areas import AREAS, Area
from ghst_tools.campaign.effort import LONG, SEED, SHORT
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Row, Wrong
from ghst_tools.cli import ghst
from ghst_tools.revision import firmware_digest

ORDER = ("First", "Second", "Third")


def section(title: str, happened: str, versions: str) -> document.Section:
    """A section with one row."""
    rows = [Row("a fault", "done", happened)]
    began = document.Beginning(date(2026, 1, 2), "abc", versions)
    return document.Section(title, "ghst campaign x", 1, began, 2.4, rows)


def test_a_section_takes_the_place_of_its_old_one_and_no_other() -> None:
    sections = [section(title, "good", "v1") for title in ("Third", "First")]
    first = document.update("", ORDER, sections)
    assert [line for line in first.splitlines() if line[:3] == "## "] == ["## First", "## Third"]
    later = [section(title, "better | or\nnot", "v2") for title in ("Second", "Third")]
    second = document.update(first, ORDER, later)
    parts = second.split("## ")
    assert [part.split("\n")[0] for part in parts[1:]] == list(ORDER)
    assert parts[1] == first.split("## ")[1].split("## ")[0]
    assert "| a fault | done | better \\| or not |" in parts[3] and "v2" in parts[3]
    assert "`ghst campaign x` on 2026-01-02, seed 1, in 2 s of the host's time; v2." in parts[3]
    assert document.update(second, ORDER, []) == second


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
    monkeypatch.setattr(cases, "_fails", lambda case, setting: True)
    return CliRunner()


def test_what_goes_wrong_is_told_saved_and_written(command: CliRunner, tmp_path: Path) -> None:
    out = tmp_path / "reliability.md"
    result = command.invoke(ghst, ["campaign", "--short", "line", "--out", str(out)])
    assert result.exit_code == 1
    assert result.stderr == "ghst: 1 trials went wrong\n"
    (saved,) = (tmp_path / "cases").iterdir()
    remark = "done again, it went wrong again"
    reason = f"it moved ({remark})"
    assert cases.load(saved) == {"kind": "bytes", "pieces": ["00"], "reason": reason}
    text = out.read_text()
    assert "| a fault | done | nothing |" in text
    assert f"| wrong |  | WRONG: it moved (saved as {saved.name}; {remark}) |" in text
    assert "`ghst campaign --short line` on " in text and ", seed 1, " in text
    assert f"; firmware {firmware_digest()}, micropython-ghst " in text and "unix" not in text


def test_what_has_ended_is_in_the_document_whatever_comes_then(
    command: CliRunner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(setting: object) -> object:
        raise KeyboardInterrupt

    monkeypatch.setitem(AREAS, "time", Area("Time", stop))
    monkeypatch.setattr(cases, "save", lambda case, reason: tmp_path / "case")
    out = tmp_path / "reliability.md"
    result = command.invoke(ghst, ["campaign", "--short", "line", "time", "--out", str(out)])
    assert result.exit_code == 130
    assert "\n## Line\n" in out.read_text() and "\n## Time\n" not in out.read_text()


def test_an_area_without_a_trial_is_wrong(
    command: CliRunner, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(AREAS, "time", Area("Time", lambda setting: iter(())))
    result = command.invoke(ghst, ["campaign", "--short", "time"])
    assert result.exit_code == 1 and "time: WRONG: there is no trial in it" in result.stdout


def test_a_firmware_that_is_changed_during_the_run_is_wrong(
    command: CliRunner, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run, "firmware_digest", lambda: "another")
    result = command.invoke(ghst, ["campaign", "--short", "line"])
    assert f"are no longer those of {firmware_digest()}" in result.stdout


def test_the_unix_ports_version_is_told_where_it_takes_part(micropython_image: Path) -> None:
    both = document.Beginning.now(micropython_image, unix_port=True).taking_part
    assert re.search(r", MicroPython \d+\.\d+\.\d+ \(unix port: \d+\.\d+\.\d+(-\w+)?\), ", both)


def test_each_area_has_trials_in_the_short_form() -> None:
    for area in AREAS.values():
        assert list(area.trials(Setting(Path(), SHORT, SEED))), area.title


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
