"""The wheel: `ghst config` works where there is no checkout."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ghst_tools import boards

SOURCES = ("lib", "tools/ghst_tools", "firmware", "boards", "README.md", "LICENSE")
BUILT_BY = ("pyproject.toml", "setup.py")
PIP = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", "--no-input"]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that the wheel of this tree is installed into."""
    folder = tmp_path_factory.mktemp("wheel")
    for name in (*SOURCES, *BUILT_BY):
        source, target = boards.checkout() / name, folder / "source" / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, target)
    offline = ("--no-index", "--no-deps")
    options = (*offline, "--no-build-isolation", "--wheel-dir", "out")
    run(*PIP, "wheel", *options, "./source", cwd=folder)
    (wheel,) = (folder / "out").glob("*.whl")
    run(*PIP, "install", *offline, "--target", "site", str(wheel), cwd=folder)
    shutil.rmtree(folder / "source")
    return folder / "site"


def run(*command: str, cwd: Path, site: Path | None = None, status: int = 0) -> str:
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    if site is not None:
        environment["PYTHONPATH"] = str(site)
    done = subprocess.run(
        command,
        cwd=cwd,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        stdin=subprocess.DEVNULL,
        text=True,
    )
    assert done.returncode == status, done.stdout
    return done.stdout


def test_the_validator_works_from_an_empty_folder(site: Path, tmp_path: Path) -> None:
    ghst = str(site / "bin" / "ghst")
    (tmp_path / "ghst.json").write_text('{\n"failsafe": {"time_ms": 50}}')
    assert run(ghst, "config", "check", "ghst.json", cwd=tmp_path, site=site, status=1) == (
        "ghst.json:2: failsafe.time_ms is 50, must be 110..10000 ms\n"
    )
    for board in ("rpi_pico", "esp32_devkit"):
        text = run(ghst, "config", "defaults", "--board", board, cwd=tmp_path, site=site)
        (tmp_path / "ghst.json").write_text(text)
        assert run(
            *(ghst, "config", "check", "ghst.json", "--board", board), cwd=tmp_path, site=site
        ) == (f"ghst.json: {board} takes it\n")


def test_everything_comes_from_the_wheel(site: Path, tmp_path: Path) -> None:
    code = (
        "import sys, ghst, ghst_tools.boards as boards\n"
        "from ghst_tools.configuration.validator import firmware_module\n"
        "modules = (ghst, boards, firmware_module('configuration.check'))\n"
        "print(boards.resources(), *(module.__file__ for module in modules), sep='\\n')\n"
        "print(*boards.names())\n"
    )
    *paths, names = run(sys.executable, "-c", code, cwd=tmp_path, site=site).splitlines()
    assert all(Path(path).is_relative_to(site) for path in paths), paths
    assert names.split() == boards.names()
