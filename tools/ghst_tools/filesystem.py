"""The file-system image of a board: `ghst image`."""

from pathlib import Path, PurePosixPath

import click
from littlefs import LittleFS, LittleFSError, UserContext

from ghst_tools import boards, device_files
from ghst_tools.errors import GhstError
from ghst_tools.files import explained, need_folder, write_file

BLOCK_SIZE = 4096
"""Erase unit of the flash, and littlefs's block on the rp2 port (ports/rp2/rp2_flash.c)."""

_PROGRAM_SIZE = 256
"""The rp2 port mounts with progsize=256, the flash's page (ports/rp2/modules/_boot.py)."""

# Oldest on-disk format that is still current: every MicroPython from 1.13 on mounts it.
_DISK_VERSION = 0x00020000


def build(files: dict[str, bytes], size: int) -> bytes:
    """A littlefs image of `size` bytes with `files` (absolute path -> content) in it.

    The same files give the same bytes. `GhstError` if they do not fit.
    """
    filesystem = LittleFS(
        context=UserContext(buffsize=size),
        block_size=BLOCK_SIZE,
        block_count=size // BLOCK_SIZE,
        prog_size=_PROGRAM_SIZE,
        disk_version=_DISK_VERSION,
    )
    try:
        for path, content in sorted(files.items()):
            filesystem.makedirs(str(PurePosixPath(path).parent), exist_ok=True)
            with filesystem.open(path, "wb") as file:
                file.write(content)
    except LittleFSError as error:
        if error.code != LittleFSError.Error.LFS_ERR_NOSPC:
            raise
        total = sum(map(len, files.values()))
        raise GhstError(f"{total} bytes of files do not fit in {size} bytes of flash") from error
    filesystem.unmount()
    return bytes(filesystem.context.buffer)


def read(image: bytes) -> dict[str, bytes]:
    """The files of an image: absolute path -> content."""
    context = UserContext(buffsize=len(image))
    context.buffer = bytearray(image)
    filesystem = LittleFS(
        context=context,
        block_size=BLOCK_SIZE,
        block_count=len(image) // BLOCK_SIZE,
        prog_size=_PROGRAM_SIZE,
        mount=False,
    )
    try:
        filesystem.mount()
    except LittleFSError as error:
        raise GhstError("not a littlefs image of this size") from error
    files = {}
    for folder, _, names in filesystem.walk("/"):
        for name in names:
            path = str(PurePosixPath(folder) / name)
            with filesystem.open(path, "rb") as file:
                files[path] = file.read()
    return dict(sorted(files.items()))


def write(
    board: str = boards.DEFAULT_BOARD, root: Path | None = None, output: Path | None = None
) -> Path:
    """Compile the firmware and write the board's image; returns where it is.

    Default: `build/<board>/filesystem.img` in the checkout.
    """
    root = root or boards.checkout()
    definition = boards.load(board, root)
    path = output or root / "build" / board / "filesystem.img"
    if output is not None:
        need_folder(output)
    content = build(device_files.collect(definition, root), definition.filesystem_size)
    with explained(path):
        write_file(path, content)
    return path


@click.command()
@click.option("--board", default=boards.DEFAULT_BOARD, show_default=True)
@click.option("--output", type=click.Path(path_type=Path, dir_okay=False), help="Image to write.")
@click.option(
    "--tree", type=click.Path(path_type=Path, file_okay=False), help="Checkout to compile."
)
def command(board: str, output: Path | None, tree: Path | None) -> None:
    """Compile library and firmware and write the board's file-system image."""
    click.echo(write(board, tree, output))
