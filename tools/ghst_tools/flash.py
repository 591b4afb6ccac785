"""Puts library and firmware on a board that runs MicroPython, and starts it: `ghst flash`.

Only what differs is copied, under temporary names; then everything takes its place at once. A
copy that is cut off leaves the board with the firmware that it had.
"""

import ast
import contextlib
import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from ghst_tools import boards, device_files, hello
from ghst_tools.board_link import connect, find_port, identify
from ghst_tools.errors import GhstError

_TEMPORARY = ".new"

# Everything below /lib/<package> is ours. In the root, modules of the same names would be found
# before those in /lib: they go too, and nothing else there.
_PACKAGES = ("ghst", "firmware")

_LIST = """
import hashlib, os, gc
gc.collect()
def _walk(path):
    try:
        entries = list(os.ilistdir(path))
    except OSError:
        return
    for entry in entries:
        name = path + '/' + entry[0]
        if entry[1] & 0x4000:
            yield name, None
            yield from _walk(name)
        else:
            yield name, entry
def _hash(path):
    digest = hashlib.sha256()
    buffer = bytearray(512)
    view = memoryview(buffer)
    with open(path, 'rb') as file:
        while True:
            size = file.readinto(buffer)
            if not size:
                return digest.digest().hex()
            digest.update(view[:size])
def _show(path):
    try:
        print(repr((path, _hash(path))), end=',')
    except OSError:
        pass
for package in {packages}:
    for top in ('/lib/' + package, '/' + package):
        for path, entry in _walk(top):
            if entry:
                _show(path)
            else:
                print(repr((path, None)), end=',')
    _show('/' + package + '.py')
    _show('/' + package + '.mpy')
for path in {files}:
    _show(path)
"""

_COMMIT = """
import os
for name in {renames}:
    os.rename(name + '{temporary}', name)
for name in {removals}:
    os.remove(name)
for name in {folders}:
    try:
        os.rmdir(name)
    except OSError:
        pass
os.sync()
"""


@dataclass(frozen=True)
class Plan:
    """What has to change on a board."""

    copies: dict[str, bytes]
    removals: list[str]
    folders: list[str]
    """Folders that may be empty afterwards, and go then; deepest first."""


def make_plan(wanted: dict[str, bytes], present: dict[str, str | None]) -> Plan:
    """Compare the files that a board should have with what it has.

    `present`: path -> SHA-256 in hex, or None for a folder, of everything in our folders.
    """
    copies = {
        path: content
        for path, content in wanted.items()
        if present.get(path) != hashlib.sha256(content).hexdigest()
    }
    removals = sorted(
        path
        for path, digest in present.items()
        if digest
        and path not in wanted
        and (path.startswith("/lib/") or path.endswith((".py", ".mpy", _TEMPORARY)))
    )
    needed = {str(parent) for path in wanted for parent in Path(path).parents}
    folders = [path for path, digest in present.items() if digest is None and path not in needed]
    folders += [f"/{package}" for package in _PACKAGES]
    return Plan(copies, removals, sorted(folders, key=lambda path: -path.count("/")))


def list_files(transport: Any, wanted: dict[str, bytes]) -> dict[str, str | None]:
    """What is in our folders on the board, for `make_plan`."""
    top = [path for path in wanted if path.count("/") == 1]
    files = top + [path + _TEMPORARY for path in top]
    code = _LIST.format(packages=_PACKAGES, files=files)
    listing = transport.exec(code).decode()
    return dict(ast.literal_eval(f"[{listing}]"))


def copy(transport: Any, plan: Plan, report: Callable[[str], None]) -> None:
    """Carry out a plan; `GhstError` if a file did not arrive as it was sent."""
    made = set()
    for path, content in plan.copies.items():
        for parent in reversed(Path(path).parents):
            if str(parent) != "/" and parent not in made:
                made.add(parent)
                with contextlib.suppress(FileExistsError):
                    transport.fs_mkdir(str(parent))
        transport.fs_writefile(path + _TEMPORARY, content)
        if transport.fs_hashfile(path + _TEMPORARY, "sha256") != hashlib.sha256(content).digest():
            raise GhstError(f"{path} arrived damaged on the board: try again")
        report(f"copied {path} ({len(content)} bytes)")
    # The copies replaced their temporary names, so those are not to be removed again.
    removals = [path for path in plan.removals if path.removesuffix(_TEMPORARY) not in plan.copies]
    # File by file: mpremote waits ten seconds for an answer, and flash may be slow.
    steps: list[tuple[list[str], list[str], list[str]]] = [
        ([path], [], []) for path in plan.copies
    ]
    steps.append(([], removals, plan.folders))
    for renames, removed, folders in steps:
        transport.exec(
            _COMMIT.format(
                renames=renames, removals=removed, folders=folders, temporary=_TEMPORARY
            )
        )
    for path in removals:
        report(f"removed {path}")


def flash(
    board: str = boards.DEFAULT_BOARD,
    port: str | None = None,
    root: Path | None = None,
    report: Callable[[str], None] = click.echo,
    hello_timeout_s: float = hello.TIMEOUT_S,
) -> str:
    """Bring a board up to date and start it; returns the application's hello line."""
    definition = boards.load(board, root)
    wanted = device_files.collect(definition, root)
    port = port or find_port(definition)
    with connect(port) as transport:
        identity = identify(transport)
        identity.check(definition)
        version = ".".join(map(str, identity.version))
        report(f"{port}: {identity.machine}, MicroPython {version}")
        plan = make_plan(wanted, list_files(transport, wanted))
        copy(transport, plan, report)
        report(f"{len(plan.copies)} of {len(wanted)} files copied")
        # The board is gone before it can answer.
        transport.exec_raw_no_follow("import machine; machine.reset()")
    return hello.wait_for_hello(port, hello_timeout_s)


@click.command()
@click.option("--board", default=boards.DEFAULT_BOARD, show_default=True)
@click.option("--port", help="Serial port, or socket://HOST:PORT; default: the board on USB.")
@click.option(
    "--tree", type=click.Path(path_type=Path, file_okay=False), help="Checkout to compile."
)
def command(board: str, port: str | None, tree: Path | None) -> None:
    """Copy library and firmware to a board, restart it and wait for the firmware's hello."""
    click.echo(flash(board, port, tree))
