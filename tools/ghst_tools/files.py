"""Writing files so that nothing is lost, and telling in one line what went wrong with them."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from ghst_tools.errors import GhstError


@contextlib.contextmanager
def replacing(path: Path, mode: str = "wb", encoding: str | None = None) -> Iterator[IO[Any]]:
    """Open a new file that takes the place of `path` at the end, whole, or not at all.

    A reader sees the old file or the new one, never a part.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, mode, encoding=encoding) as file:
            yield file
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def write_file(path: Path, content: bytes) -> None:
    """Write a file so that a reader sees the old one or the whole new one, never a part."""
    with replacing(path) as file:
        file.write(content)


@contextlib.contextmanager
def explained(path: Path | str) -> Iterator[None]:
    """Turn what the system says of a file into a `GhstError` that names it."""
    try:
        yield
    except OSError as error:
        raise GhstError(f"{path}: {error.strerror or error}") from error
