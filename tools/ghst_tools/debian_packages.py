"""Fetches packages of Debian 13 (trixie), which carries MicroPython, the Pico SDK and TinyUSB.

For machines that cannot reach micropython.org. They come through apt with folders of its own, so
that neither the machine's package lists nor root are needed.
"""

import re
from pathlib import Path

from ghst_tools.build_steps import Steps
from ghst_tools.errors import GhstError

SUITE = "trixie"
SOURCE = "micropython=1.25.0+ds-1"
PACKAGES = ("pico-sdk-source=2.1.1-1", "tinyusb-source=0.18.0+dfsg-1")

_KEYRINGS = ("debian-archive-keyring.gpg", "debian-archive-keyring.pgp")


def fetch(folder: Path, steps: Steps) -> Path:
    """Download the packages, checked by apt against Debian's keys; returns where they are."""
    state = folder / "apt"
    for name in ("lists/partial", "cache/archives/partial", "sources", "preferences"):
        (state / name).mkdir(parents=True)
    (state / "status").touch()
    steps.environment["APT_CONFIG"] = str(state / "apt.conf")
    lists = f'Dir::State::Lists "{state}/lists";\n'
    (state / "apt.conf").write_text(lists)
    source = f"URIs: {mirror(folder, steps)}\nSuites: {SUITE}\nComponents: main\n"
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
    steps.run("apt-get", "-q", "update", folder=folder)
    packages = folder / "packages"
    packages.mkdir()
    steps.run("apt-get", "-q", "source", "--download-only", SOURCE, folder=packages)
    steps.run("apt-get", "-q", "download", *PACKAGES, folder=packages)
    return packages


def mirror(folder: Path, steps: Steps) -> str:
    """Address of the Debian archive that this machine is set up for.

    Asked of apt itself, which knows every form of a sources file and needs no package lists.
    """
    plan = steps.run("apt-get", "--print-uris", "update", folder=folder, keep=True)
    found = re.search(r"^'(\S*/debian)/dists/[^/]+/InRelease'", plan, re.MULTILINE)
    if found is None:
        raise GhstError("apt's sources name no Debian archive (an address ending in /debian)")
    return found[1]
