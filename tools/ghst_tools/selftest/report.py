"""The table of the self-test, and the same for scripts."""

from __future__ import annotations

from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from ghst_tools.boards import Board
from ghst_tools.selftest.result import Result, Verdict

_STYLES = {
    Verdict.OK: "green",
    Verdict.FAILED: "bold red",
    Verdict.WIRING: "bold yellow",
    Verdict.SKIPPED: "dim",
}


def passed(results: list[Result]) -> bool:
    """Whether everything was checked and all right."""
    return all(result.verdict is Verdict.OK for result in results)


def table(board: Board, results: list[Result]) -> RenderableType:
    """A row for each check; below it what to do, and a line that sums up."""
    rows = Table(title=f"Self-test of the {board.title}", title_justify="left")
    for head in ("check", "expected", "measured", "verdict"):
        rows.add_column(head)
    for result in results:
        verdict = Text(result.verdict.value, style=_STYLES[result.verdict])
        rows.add_row(Text(result.check), Text(result.expected), Text(result.measured), verdict)
    hints = [Text(f"{result.check}: {result.hint}") for result in results if result.hint]
    return Group(rows, *hints, Text(_summary(results)))


def _summary(results: list[Result]) -> str:
    counts = {verdict: sum(result.verdict is verdict for result in results) for verdict in Verdict}
    if passed(results):
        return f"All {len(results)} checks passed."
    return ", ".join(f"{count} {verdict.value}" for verdict, count in counts.items() if count)


def as_json(board: str, results: list[Result]) -> dict[str, Any]:
    """The results as values for JSON."""
    return {
        "board": board,
        "passed": passed(results),
        "checks": [
            {
                "check": result.check,
                "expected": result.expected,
                "measured": result.measured,
                "verdict": result.verdict.value,
                "hint": result.hint,
            }
            for result in results
        ],
    }
