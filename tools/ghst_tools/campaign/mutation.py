"""Breaks a copy of this tree in small ways and runs the tests that have to notice."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from ghst_tools import boards, device_files
from ghst_tools.campaign.mutations import LIBRARY, MUTATIONS, Mutation
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Row, Trial, Wrong, expect
from ghst_tools.errors import GhstError

_PARTS = ("boards", "docs", "firmware", "host_tests", "lib", "tools", "pyproject.toml")
_LIMIT_S = 3600
"""Far beyond what any selection takes: ends tests that hang."""
_PASSED, _FAILED = 0, 1
# A board that cannot be set up for a test is an ERROR of that test. What cannot be collected is an
# ERROR of its file, and another exit status.
_FAILURE = re.compile(r"^(?:FAILED|ERROR) host_tests/\S+?::(.+?)(?: - .*)?$", re.MULTILINE)


def mutated(mutation: Mutation, root: Path) -> str:
    """The changed text of its file. Raises Wrong if its old text is not in there just once."""
    text = (root / mutation.path).read_text(encoding="utf-8")
    count = text.count(mutation.old)
    expect(count == 1, f"{mutation.path} has {mutation.old!r} {count} times: bring it up to date")
    return text.replace(mutation.old, mutation.new)


@contextmanager
def _copy() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="ghst-mutation-") as folder:
        root = Path(folder)
        for name in _PARTS:
            source = boards.checkout() / name
            if source.is_dir():
                shutil.copytree(source, root / name, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy2(source, root / name)
        yield root


def _pytest(root: Path, tests: tuple[str, str]) -> tuple[int, str]:
    """Run a selection in a copy of the tree; pytest's exit status and what it printed."""
    file, keyword = tests
    arguments = ["-x", "-q", "-rfE", "--no-header", "-p", "no:cacheprovider", "-k", keyword]
    done = subprocess.run(
        [sys.executable, "-B", "-m", "pytest", *arguments, f"host_tests/{file}"],
        cwd=root,
        env={key: value for key, value in os.environ.items() if key != "PYTHONPATH"},
        capture_output=True,
        text=True,
        timeout=_LIMIT_S,
    )
    return done.returncode, done.stdout + done.stderr


def _compile(mutation: Mutation, root: Path) -> None:
    """Compile the changed file for CPython, and for a board if boards have it. Raises Wrong."""
    path = root / mutation.path
    board = boards.load(boards.DEFAULT_BOARD)
    try:
        compile(path.read_bytes(), path, "exec")
        modules = device_files.sources(root, board)
        for name in [name for name in modules if modules[name] == path]:
            text = device_files.folded(modules)[name]
            device_files.compile_module(path, name, board.mpy_arch, text)
    except (SyntaxError, ValueError, GhstError) as error:
        raise Wrong(f"{mutation.what}: does not compile: {error}") from error


def _selection(tests: tuple[str, str]) -> str:
    return f"pytest host_tests/{tests[0]} -k '{tests[1]}'"


def noticed(mutation: Mutation) -> list[Row]:
    """The changed file compiles, and a test fails with it."""
    with _copy() as root:
        text = mutated(mutation, root)
        (root / mutation.path).write_text(text, encoding="utf-8")
        _compile(mutation, root)
        status, output = _pytest(root, mutation.tests)
    selection = _selection(mutation.tests)
    if status == _PASSED:
        raise Wrong(f"{mutation.what}: not noticed by {selection}")
    failed = _FAILURE.search(output)
    if status != _FAILED or failed is None:
        raise Wrong(f"{mutation.what}: no test of {selection} failed: {output[-500:]}")
    old = " / ".join(line.strip() for line in mutation.old.strip().splitlines())
    done = f"{mutation.path}: `{old}`"
    return [Row(mutation.what, done, f"noticed by {failed[1]} ({selection})")]


def unbroken(mutations: Sequence[Mutation]) -> list[Row]:
    """All of these tests pass as long as nothing is broken."""
    selections = sorted({mutation.tests for mutation in mutations})
    with _copy() as root:
        for tests in selections:
            status, output = _pytest(root, tests)
            expect(status == _PASSED, f"{_selection(tests)} fails without a mutation: {output}")
    return [Row("nothing broken", "a copy of the tree", f"all {len(selections)} selections pass")]


def applicable() -> list[Row]:
    """Every mutation still fits the source."""
    for mutation in MUTATIONS:
        mutated(mutation, boards.checkout())
    return [
        Row("all", "looked up in the source", f"all {len(MUTATIONS)} apply, each to one place")
    ]


def trials(setting: Setting) -> Iterator[tuple[str, Trial]]:
    """The trials, by name: those of the library come first."""
    yield "applicable", applicable
    chosen = MUTATIONS if setting.effort.mutations is None else LIBRARY[: setting.effort.mutations]
    yield "nothing broken", partial(unbroken, chosen)
    for mutation in chosen:
        yield mutation.what, partial(noticed, mutation)
