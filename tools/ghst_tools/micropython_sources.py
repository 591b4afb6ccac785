"""The sources of MicroPython: a folder of the user's, or packages of Debian."""

import re
import shutil
import tarfile
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ghst_tools import debian_packages
from ghst_tools.build_steps import Steps
from ghst_tools.errors import GhstError

OLDEST = (1, 25)
"""The oldest MicroPython that the firmware runs on."""


@dataclass(frozen=True)
class Sources:
    """A folder with the sources of MicroPython, and of what its ports are built with."""

    folder: Path
    version: str
    epoch: int | None
    """Seconds since 1970 that a build takes for its date; None: the time of the build."""


def given(folder: Path) -> Sources:
    """The sources that a user has; `GhstError` if they are none, or too old."""
    folder = folder.absolute()
    try:
        text = (folder / "py/mpconfig.h").read_text(encoding="utf-8")
    except OSError as error:
        raise GhstError(
            f"{folder} has no MicroPython in it: name the folder that has py/mpconfig.h"
        ) from error
    found = dict(re.findall(r"^#define MICROPY_VERSION_(\w+) (\d+)$", text, re.MULTILINE))
    if not {"MAJOR", "MINOR", "MICRO"} <= found.keys():
        raise GhstError(f"{folder}: py/mpconfig.h does not say which MicroPython this is")
    version = ".".join(found[part] for part in ("MAJOR", "MINOR", "MICRO"))
    if (int(found["MAJOR"]), int(found["MINOR"])) < OLDEST:
        oldest = ".".join(map(str, OLDEST))
        raise GhstError(f"{folder}: MicroPython {version} is too old: {oldest} or newer is needed")
    return Sources(folder, version, None)


def debian(cache: Path, *, verbose: bool, report: Callable[[str], None]) -> Sources:
    """The sources in Debian's packages, fetched once and unpacked into `cache`.

    One process at a time may do that. `GhstError` says which step failed.
    """
    name = "sources-" + debian_packages.SOURCE.replace("=", "-")
    folder = cache / name
    if not folder.is_dir():
        if shutil.which("apt-get") is None or shutil.which("dpkg") is None:
            raise GhstError("this system has no apt-get")
        log = cache / "fetch.log"
        with tempfile.TemporaryDirectory(dir=cache, prefix=f"{name}-") as temporary:
            report("fetching the sources of MicroPython from Debian")
            steps = Steps(log, verbose)
            new = Path(temporary) / "new"
            _unpack(debian_packages.fetch(Path(temporary), steps), new, steps)
            new.rename(folder)
        log.unlink(missing_ok=True)
    micropython = folder / "micropython"
    epoch = int((folder / "epoch").read_text())
    return Sources(micropython, given(micropython).version, epoch)


def _unpack(packages: Path, folder: Path, steps: Steps) -> None:
    """Unpack the packages, and cut out of MicroPython what needs sources Debian leaves out."""
    folder.mkdir()
    for package in packages.glob("*.deb"):
        steps.run("dpkg", "-x", package, folder, folder=folder)
    (archive,) = packages.glob("micropython_*.orig.tar.xz")
    with tarfile.open(archive) as tar:
        top = tar.next()
        assert top is not None
        # The date in the banner is that of the sources: the same build gives the same bytes.
        (folder / "epoch").write_text(f"{int(top.mtime)}\n")
        # Python 3.11.2 of Debian 12 has no filters yet; apt has checked the archive's hash.
        tar.extraction_filter = getattr(tarfile, "data_filter", None)
        tar.extractall(folder)
        micropython = (folder / top.name.split("/")[0]).rename(folder / "micropython")
    port = micropython / "ports/rp2"
    _edit(
        port / "CMakeLists.txt",
        (r"^set\(MICROPY_SSL_MBEDTLS ON\)", "set(MICROPY_SSL_MBEDTLS OFF)"),
        (r"^.*(mbedtls/mbedtls_port\.c|micropy_lib_mbedtls).*\n", ""),
    )
    _edit(
        port / "mpconfigport.h",
        (r"^(#define MICROPY_(?:SSL_MBEDTLS|PY_CRYPTOLIB|PY_HASHLIB_\w+) +)\(1\)", r"\1(0)"),
    )
    (micropython / "lib/micropython-lib").mkdir(exist_ok=True)
    (micropython / "lib/micropython-lib/README.md").touch()
    # Where a checkout has its submodules.
    for name in ("tinyusb", "pico-sdk"):
        place = micropython / "lib" / name
        if place.is_dir():
            place.rmdir()
        place.symlink_to(Path("../../usr/src") / name)


def _edit(path: Path, *changes: tuple[str, str]) -> None:
    text = path.read_text()
    for pattern, replacement in changes:
        text, count = re.subn(pattern, replacement, text, flags=re.MULTILINE)
        if not count:
            raise GhstError(f"{path.name} has no {pattern}: not the sources that were expected")
    path.write_text(text)
