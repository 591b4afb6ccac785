"""Compiles the emulator's core for the Python that runs this: part of `make .venv`.

The wheel of rp2040py holds its core compiled for every Python there is (the limited API), which
is half as fast, and the C source of it. Compiled for one Python it does the same, to the cycle.
Without a C compiler and Python's headers the core of the wheel stays in use.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

from setuptools import Distribution, Extension

PACKAGE = "rp2040py"


def compile_into(folder: Path, sources: list[Path], native: str) -> list[Path]:
    """Compile each source into a module of the package `native`; returns the files."""
    command = Distribution(
        {
            "ext_modules": [
                Extension(f"{native}.{source.stem}", [str(source)], extra_compile_args=["-O3"])
                for source in sources
            ]
        }
    ).get_command_obj("build_ext")
    command.build_lib = command.build_temp = str(folder)
    command.parallel = True
    command.ensure_finalized()
    command.run()
    return [Path(command.get_ext_fullpath(f"{native}.{source.stem}")) for source in sources]


def main() -> None:
    """Compile, unless it has been done; say so if it cannot be."""
    distribution = importlib.metadata.distribution(PACKAGE)
    native = Path(str(distribution.locate_file(f"{PACKAGE}/native")))
    sources = sorted(native.glob("*.c"))
    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    state = hashlib.sha256(suffix.encode() + b"".join(map(Path.read_bytes, sources))).hexdigest()
    stamp = native / "compiled"
    placed = [native / f"{source.stem}{suffix}" for source in sources]
    whole = all(place.exists() for place in placed)
    if whole and stamp.exists() and stamp.read_text() == state:
        return
    print("venv: compiling the emulator for this Python", file=sys.stderr)
    stamp.unlink(missing_ok=True)
    modules = ", ".join(f"{PACKAGE}.native.{source.stem}" for source in sources)
    try:
        with tempfile.TemporaryDirectory() as folder:
            built = compile_into(Path(folder), sources, f"{PACKAGE}.native")
            for file, place in zip(built, placed, strict=True):
                # Renamed, not written over: a program that runs has the old one mapped.
                fresh = place.with_name(f"{place.name}.{os.getpid()}.new")
                shutil.copyfile(file, fresh)
                fresh.replace(place)
        subprocess.run(
            [sys.executable, "-c", f"import {modules}"], check=True, capture_output=True
        )
    except Exception as error:  # setuptools raises what it likes
        stamp.unlink(missing_ok=True)
        for place in placed:
            place.unlink(missing_ok=True)
        print(f"venv: the emulator stays at half its speed: {error}", file=sys.stderr)
        return
    stamp.write_text(state)
    # As files of the package: pip takes them away with it.
    record = Path(str(distribution.locate_file(""))) / next(
        file for file in distribution.files or () if file.name == "RECORD"
    )
    with record.open("a", encoding="utf-8") as lines:
        lines.writelines(f"{PACKAGE}/native/{file.name},,\n" for file in [*placed, stamp])


if __name__ == "__main__":
    main()
