"""Which firmware it is, by what is in its files."""

from __future__ import annotations

import hashlib
from pathlib import Path

import ghst  # type: ignore[import-not-found]
from ghst_tools import boards


def firmware_digest() -> str:
    """The first twelve digits of a SHA-256 over the Python files of firmware/ and lib/ghst/.

    A commit would do as little as a version: figures are committed after they were measured.
    """
    digest = hashlib.sha256()
    for folder in (boards.resources() / "firmware", Path(ghst.__file__).parent):
        for path in sorted(folder.rglob("*.py")):
            text = path.read_bytes()
            name = path.relative_to(folder.parent).as_posix()
            digest.update(f"{name} {len(text)}\n".encode() + text)
    return digest.hexdigest()[:12]
