"""Builds the stock MicroPython for the RP2040 out of packages of Debian.

For machines that cannot reach micropython.org.
"""

import tempfile
from pathlib import Path

from ghst_tools import micropython_build, micropython_sources, toolchain
from ghst_tools.build_steps import Steps
from ghst_tools.micropython_image import Report, version_of


def build(stem: str, image: Path, *, verbose: bool, report: Report) -> None:
    """Build MicroPython's board `stem` and put the UF2 file at `image`, whole or not at all.

    Takes about a minute on two cores, and 300 MB beside `image`, of which the sources, 120 MB,
    stay. `GhstError` says which step failed.
    """
    cache = image.parent
    sources = micropython_sources.debian(cache, verbose=verbose, report=report)
    toolchain.need(verbose, report)
    log = cache / "build.log"
    with tempfile.TemporaryDirectory(dir=cache, prefix="build-") as folder:
        report(f"building MicroPython for {stem} (about a minute)")
        # The port's own manifest asks for packages that Debian leaves out.
        manifest = Path(folder) / "manifest.py"
        manifest.write_text(
            'freeze("$(PORT_DIR)/modules")\ninclude("$(MPY_DIR)/extmod/asyncio")\n'
        )
        uf2 = micropython_build.rp2(
            sources,
            "rp2040",
            Path(folder) / "build",
            Steps(log, verbose),
            MICROPY_BOARD=stem,
            MICROPY_FROZEN_MANIFEST=manifest,
        )
        version_of(uf2)
        uf2.replace(image)
    log.unlink(missing_ok=True)
