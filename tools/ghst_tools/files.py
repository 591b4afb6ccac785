"""Writing files so that nothing is lost, and telling in one line what went wrong with them."""

from __future__ import annotations

import contextlib
import os
import stat
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from ghst_tools.errors import GhstError


@contextlib.contextmanager
def replacing(path: Path, mode: str = "wb", encoding: str | None = None) -> Iterator[IO[Any]]:
    """Open a new file that takes the place of `path` at the end, whole, or not at all.

    A reader sees the old file or the new one, never a part. What is there and is no regular file,
    such as a FIFO or a device, is written to as it is. A missing folder is made: of a path that
    a user has named, `need_folder` or `check_output` comes first.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.exists() and not path.is_file():
        with path.open(mode, encoding=encoding) as file:
            yield file
        return
    path = path.resolve()  # a link stays one, its target is replaced
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
    """Write a file so that a reader sees the old one or the whole new one, never a part.

    As `replacing`.
    """
    with replacing(path) as file:
        file.write(content)


def need_folder(path: Path) -> None:
    """`GhstError` if the folder that `path` would be in is missing."""
    if not path.parent.is_dir():
        raise GhstError(f"{path}: there is no folder {path.parent}: make it first")


def check_output(output: Path, source: Path) -> None:
    """`GhstError` if `output` cannot be written, or is the file that `source` is read from.

    `source` may be `-`, for standard input.
    """
    need_folder(output)
    with contextlib.suppress(OSError, ValueError):
        read = os.fstat(sys.stdin.fileno()) if str(source) == "-" else source.stat()
        if stat.S_ISREG(read.st_mode) and os.path.samestat(read, output.stat()):
            raise GhstError(f"{output}: is the file that is read: name another output")


@contextlib.contextmanager
def explained(path: Path | str) -> Iterator[None]:
    """Turn what the system says of a file into a `GhstError` that names it."""
    try:
        yield
    except OSError as error:
        raise GhstError(f"{path}: {error.strerror or error}") from error
