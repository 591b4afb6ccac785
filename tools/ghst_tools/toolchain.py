"""The compiler for RP2 boards: whether it is there, and how it gets there on Debian."""

import os
import shutil
import subprocess
from collections.abc import Callable

from ghst_tools.build_steps import environment
from ghst_tools.errors import GhstError

_PROGRAMS = {
    "gcc-arm-none-eabi": "arm-none-eabi-gcc",
    "cmake": "cmake",
    "ninja-build": "ninja",
}
_LIBRARIES = {
    "libnewlib-arm-none-eabi": "libc.a",
    "libstdc++-arm-none-eabi-newlib": "libstdc++.a",
}


def missing_packages() -> list[str]:
    """Debian packages of the toolchain that are not there, found by what they provide."""
    missing = [package for package, program in _PROGRAMS.items() if not shutil.which(program)]
    for package, library in _LIBRARIES.items():
        if "gcc-arm-none-eabi" in missing or not _has_library(library):
            missing.append(package)
    return missing


def _has_library(name: str) -> bool:
    # The compiler answers with the bare name for a file that it does not find.
    answer = subprocess.run(
        ["arm-none-eabi-gcc", f"-print-file-name={name}"], capture_output=True, text=True
    )
    return os.path.isabs(answer.stdout.strip())


def need(verbose: bool, report: Callable[[str], None]) -> None:
    """Install what is missing of the toolchain, as root on Debian; `GhstError` elsewhere."""
    missing = missing_packages()
    if not missing:
        return
    if shutil.which("apt-get") is None:
        raise GhstError(f"the toolchain is missing: install what Debian calls {' '.join(missing)}")
    install = ["apt-get", "install", "--yes", "--no-install-recommends", *missing]
    if os.geteuid() != 0:
        raise GhstError(f"the toolchain is missing: as root, run {' '.join(install)}")
    report(f"installing {' '.join(missing)}")
    for command in (["apt-get", "update"], install):
        done = subprocess.run(
            command,
            env={**environment(), "DEBIAN_FRONTEND": "noninteractive"},
            stdout=None if verbose else subprocess.PIPE,
            stderr=None if verbose else subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            text=True,
        )
    if still := missing_packages():
        lines = (done.stdout or "").strip().splitlines() or [f"it ended with {done.returncode}"]
        raise GhstError(f"apt-get could not install {' '.join(still)}: {lines[-1]}")
