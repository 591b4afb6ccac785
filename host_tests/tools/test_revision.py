"""The digest that says which firmware was measured."""

from __future__ import annotations

import re
import shutil
from importlib.metadata import version
from pathlib import Path

import pytest
from click.testing import CliRunner

import ghst
from ghst_tools import boards, cli, revision


def test_it_changes_with_each_file_and_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = revision.firmware_digest()
    for folder, source in (
        ("firmware", boards.checkout()),
        ("ghst", Path(ghst.__file__).parents[1]),
    ):
        shutil.copytree(source / folder, tmp_path / folder)
    monkeypatch.setattr(boards, "resources", lambda: tmp_path)
    monkeypatch.setattr(ghst, "__file__", str(tmp_path / "ghst" / "__init__.py"))
    assert revision.firmware_digest() == real
    seen = {real}
    for name in ("firmware/sensors/vario.py", "ghst/decoder.py"):
        path = tmp_path / name
        path.write_bytes(path.read_bytes() + b"\n")
        seen.add(revision.firmware_digest())
    path.rename(path.with_name("other.py"))
    seen.add(revision.firmware_digest())
    assert len(seen) == 4


def test_the_command_tells_it() -> None:
    found = CliRunner().invoke(cli.ghst, ["--version"])
    assert found.exit_code == 0
    assert found.output == (
        f"ghst, version {version('micropython-ghst')}, firmware {revision.firmware_digest()}\n"
    )
    assert re.fullmatch("[0-9a-f]{12}", revision.firmware_digest())
