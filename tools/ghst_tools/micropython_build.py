"""Builds MicroPython out of its sources: the stock image, or one with another manifest."""

import sys
from pathlib import Path

from ghst_tools import uf2
from ghst_tools.build_steps import Steps
from ghst_tools.errors import GhstError
from ghst_tools.micropython_image import mpy_cross
from ghst_tools.micropython_sources import Sources

_FAMILIES = {"rp2040": uf2.RP2040_FAMILY, "rp2350": uf2.RP2350_FAMILY}


def rp2(
    sources: Sources, chip: str, output: Path, steps: Steps, **definitions: str | Path
) -> Path:
    """Build the rp2 port in the folder `output`; returns the UF2 file, which is in it.

    `definitions`: cmake's, such as `MICROPY_BOARD="RPI_PICO"`. What is in `output` from an earlier
    build with the same ones is built anew only where something has changed.
    """
    need_submodules(sources, "rp2", "pico-sdk/pico_sdk_init.cmake", "tinyusb/src")
    steps.environment["MICROPY_MPYCROSS"] = str(mpy_cross())
    if sources.epoch is not None:
        steps.environment["SOURCE_DATE_EPOCH"] = str(sources.epoch)
        # A repository around the cache folder is not MicroPython's: take no version from it.
        steps.environment["GIT_CEILING_DIRECTORIES"] = str(sources.folder.parent)
    steps.run(
        "cmake",
        *("-G", "Ninja", "-S", sources.folder / "ports/rp2", "-B", output),
        # Its only use would be the conversion to UF2, and it would be fetched and built for it.
        "-DPICO_NO_PICOTOOL=1",
        f"-DPython3_EXECUTABLE={sys.executable}",
        *(f"-D{name}={value}" for name, value in definitions.items()),
        folder=sources.folder,
    )
    steps.run("ninja", "-C", output, folder=sources.folder)
    if chip == "rp2040":
        _check_native_code(steps.run("arm-none-eabi-nm", "firmware.elf", folder=output, keep=True))
    image = output / "ghst.uf2"
    steps.run(
        sys.executable,
        sources.folder / "tools/uf2conv.py",
        *("-f", hex(_FAMILIES[chip]), "-b", hex(uf2.FLASH_BASE), "-c"),
        *("-o", image, output / "firmware.bin"),
        folder=sources.folder,
    )
    return image


def esp32(sources: Sources, definition: Path, name: str, output: Path, steps: Steps) -> Path:
    """Build the esp32 port for the board definition in a folder; returns the image, in `output`.

    ESP-IDF has to be set up in the caller's shell. `name`: of the board, for MicroPython.
    """
    need_submodules(sources, "esp32", "micropython-lib/README.md")
    steps.environment["MICROPY_MPYCROSS"] = str(mpy_cross())
    steps.run(
        "make",
        *("-C", sources.folder / "ports/esp32"),
        *(f"BOARD={name}", f"BOARD_DIR={definition}", f"BUILD={output}"),
        f"PYTHON={sys.executable}",
        folder=sources.folder,
    )
    return output / "firmware.bin"


def _check_native_code(symbols: str) -> None:
    """`GhstError` if native code of frozen modules stands where a Cortex-M0+ misreads it.

    `symbols`: what nm says. See boards/frozen/native_code.h.
    """
    for line in symbols.splitlines():
        *address, kind, name = line.split()
        if kind.lower() == "t" and name.startswith("fun_data_") and int(address[0], 16) % 4:
            raise GhstError(
                f"{name} is not on a multiple of 4: boards/frozen/native_code.h does not reach it "
                "in this MicroPython"
            )


def need_submodules(sources: Sources, port: str, *places: str) -> None:
    """`GhstError` unless the parts of MicroPython that are no part of its repository are there."""
    for place in places:
        if not (sources.folder / "lib" / place).exists():
            raise GhstError(
                f"{sources.folder}: lib/{place.split('/')[0]} is empty: run "
                f"'make -C ports/{port} submodules' there"
            )
