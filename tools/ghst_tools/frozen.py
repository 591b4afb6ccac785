"""The frozen image: MicroPython with library and firmware in its flash: `ghst firmware`.

Frozen code is run where it stands, so it takes no RAM, and starts at once. The file system is the
user's alone: without any file the board does what its description says.
"""

import hashlib
import shutil
from collections.abc import Callable
from pathlib import Path

import click

from ghst_tools import (
    boards,
    device_files,
    filesystem,
    micropython_build,
    micropython_sources,
    toolchain,
)
from ghst_tools.build_steps import Steps
from ghst_tools.chips import CHIPS
from ghst_tools.errors import GhstError
from ghst_tools.micropython_image import cache_folder, lock, print_to_stderr

_DEFINITION = "micropython"
"""The folder of a board that has its definition for MicroPython."""


def build(
    board: str = boards.DEFAULT_BOARD,
    micropython: Path | None = None,
    *,
    root: Path | None = None,
    verbose: bool = False,
    report: Callable[[str], None] = print_to_stderr,
) -> Path:
    """Build the frozen image of a board; returns where it is.

    `micropython`: a folder with the sources of MicroPython 1.25 or newer; None: Debian's packages.
    The image is `build/<board>/firmware.uf2` in the checkout, `firmware.bin` for the ESP32
    family. The first build takes about a minute, the next one seconds: what has been compiled
    stays in the cache folder. `GhstError` says what is missing or failed.
    """
    root = root or boards.checkout()
    definition = boards.load(board, root)
    folder = root / "boards" / board / _DEFINITION
    if not (folder / "mpconfigboard.cmake").is_file():
        raise GhstError(f"{folder} is missing: there is no frozen image for {board}")
    is_rp2 = CHIPS[definition.chip].is_rp2
    if micropython is None and not is_rp2:
        raise GhstError(
            f"Debian's packages can build images for RP2 chips only, {board} has an "
            f"{CHIPS[definition.chip].title}: name MicroPython's sources with --micropython "
            "(make: MICROPYTHON=...)"
        )
    if not is_rp2 and shutil.which("idf.py") is None:
        raise GhstError("idf.py is missing: set ESP-IDF up as MicroPython's ports/esp32 tells")
    cache = cache_folder()
    # Before the lock: a wrong path is told at once.
    sources = None if micropython is None else micropython_sources.given(micropython)
    with lock(cache, report):
        if sources is None:
            try:
                sources = micropython_sources.debian(cache, verbose=verbose, report=report)
            except GhstError as error:
                raise GhstError(
                    f"no sources of MicroPython from Debian's packages: {error}: name sources of "
                    "1.25 or newer with --micropython (make: MICROPYTHON=...), or use Debian"
                ) from error
        if is_rp2:
            toolchain.need(verbose, report)
        place = hashlib.sha256(f"{sources.folder}\n{root}".encode()).hexdigest()[:8]
        output = cache / "frozen" / f"{board}-{sources.version}-{place}"
        output.mkdir(parents=True, exist_ok=True)
        steps = Steps(output.with_name(output.name + ".log"), verbose)
        report(f"building MicroPython {sources.version} with the firmware for {board}")
        try:
            if is_rp2:
                built = micropython_build.rp2(
                    sources, definition.chip, output, steps, MICROPY_BOARD_DIR=folder
                )
            else:
                built = micropython_build.esp32(
                    sources, folder, f"GHST_{board.upper()}", output, steps
                )
        except GhstError:
            # A mistake in the firmware is better told by its place than by a log.
            device_files.compile_modules(
                device_files.sources(root, definition), definition.mpy_arch
            )
            raise
        image = root / "build" / board / f"firmware{built.suffix}"
        filesystem.write_file(image, built.read_bytes())
    return image


@click.command()
@click.option("--board", default=boards.DEFAULT_BOARD, show_default=True)
@click.option(
    "--micropython",
    type=click.Path(path_type=Path),
    help="Sources of MicroPython, 1.25 or newer; default: Debian's packages.",
)
@click.option("-v", "--verbose", is_flag=True, help="Show what the build prints.")
def command(board: str, micropython: Path | None, verbose: bool) -> None:
    """Build MicroPython with the firmware in it and print where the image is."""
    click.echo(build(board, micropython, verbose=verbose))
