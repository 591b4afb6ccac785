"""Memory: RAM kept, and flash."""

from __future__ import annotations

from ghst_tools.bench.figures import Table
from ghst_tools.bench.rig import Rig

_PROGRAM = """
import gc
def kept():
    gc.collect()
    return gc.mem_alloc()
heap = gc.mem_alloc() + gc.mem_free()
before = kept()
from firmware.adapter import Adapter
imported = kept()
adapter = Adapter({arguments})
adapter.start()
print("kept", heap, before, imported, kept(), "end")
{ready}
"""


def ram(rig: Rig) -> tuple[Table, ...]:
    """Bytes of the heap that are in use once everything runs."""
    running = rig.run(_PROGRAM.format(arguments=rig.arguments(), ready=rig.ready))
    heap, before, imported, started = running.numbers("kept")
    kept = Table(
        "RAM",
        f"gc.mem_alloc() after gc.collect(), before and after an Adapter with {len(rig.servos)} "
        "servos is imported and started. Code that was loaded from .mpy files is in RAM and "
        "counted.",
        ("what", "bytes"),
        (
            ("MicroPython's heap", f"{heap}"),
            ("in use before", f"{before}"),
            ("the modules of library and firmware", f"{imported - before}"),
            ("the started adapter", f"{started - imported}"),
            ("in use then", f"{started}"),
        ),
    )
    return (kept,)


def flash(rig: Rig) -> tuple[Table, ...]:
    """Bytes of each file on the board."""
    sizes = [(path, len(content)) for path, content in rig.files.items()]
    sizes.append(("in all", sum(size for _, size in sizes)))
    table = Table(
        "Files on the board",
        f"Bytes; .mpy files are compiled for {rig.definition.mpy_arch}. The file system's own "
        "overhead is not counted.",
        ("file", "bytes"),
        tuple((path, f"{size}") for path, size in sizes),
    )
    return (table,)
