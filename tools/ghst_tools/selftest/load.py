"""Brings the self-test's modules to the board, compiled, into its memory alone."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

from ghst_tools import boards, device_files
from ghst_tools.selftest.session import Session

MODULES = ("selftest_pads", "selftest_board")
"""What can be run without the firmware's control path; the first is imported by the rest."""
BENCH_MODULES = ("selftest_pulses", "selftest_player", "selftest_bench")
"""What runs it."""

_FOLDER = "tools/selftest"
_CHUNK = 1024

# A file system of which `import` needs two functions.
_MOUNT = """
import io, sys, vfs, gc
from binascii import unhexlify
class _Memory:
    def __init__(self):
        self.files = {}
    def mount(self, readonly, mkfs):
        pass
    def umount(self):
        pass
    def stat(self, path):
        if path.lstrip('/') not in self.files:
            raise OSError(2)
        return (0x8000, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    def open(self, path, mode):
        return io.BytesIO(self.files[path.lstrip('/')])
_memory = _Memory()
_place = bytearray()
"""
_IMPORT = """
_memory.files['{name}.mpy'] = bytes(_place)
_place = bytearray()
vfs.mount(_memory, '/selftest')
sys.path.insert(0, '/selftest')
try:
    import {name}
finally:
    sys.path.remove('/selftest')
    vfs.umount('/selftest')
    _memory.files.clear()
    gc.collect()
"""


@cache
def _folded(root: Path) -> dict[str, str]:
    """The sources, with the constants of the firmware in them: a board has no others."""
    own = {path.name: path for path in sorted((root / _FOLDER).glob("*.py"))}
    texts = device_files.folded(device_files.sources(root) | own)
    return {name: texts[name] for name in own}


@cache
def compiled(name: str, arch: str, root: Path | None = None) -> bytes:
    """A module of the self-test as `.mpy`."""
    root = root or boards.checkout()
    text = _folded(root)[f"{name}.py"]
    return device_files.compile_module(root / _FOLDER / f"{name}.py", f"{name}.py", arch, text)


def load(session: Session, names: tuple[str, ...], arch: str, root: Path | None = None) -> None:
    """Have the board import these modules, one after the other; nothing is written to flash."""
    session.run(_MOUNT)
    for name in names:
        content = compiled(name, arch, root)
        for at in range(0, len(content), _CHUNK):
            piece = content[at : at + _CHUNK].hex()
            session.run(f"_place.extend(unhexlify('{piece}'))")
        session.run(_IMPORT.format(name=name))
        assert ast.literal_eval(session.run(f"print(repr({name}.__name__))")) == name
