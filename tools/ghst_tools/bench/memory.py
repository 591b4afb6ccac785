"""Memory: RAM kept, flash, and the heap that a frame takes."""

from __future__ import annotations

from itertools import islice

from ghst_tools.bench.figures import Effort, Findings, Table
from ghst_tools.bench.rig import Rig, control_frames

_RATE_HZ = 500
_POLL_MS = 20

# The main loop is the application's, without what it prints.
_PROGRAM = """
import gc, time
def kept():
    gc.collect()
    return gc.mem_alloc()
def fly(count):
    receiver = adapter.receiver
    while not receiver.frames:
        pass
    gc.disable()
    first = receiver.frames
    before = gc.mem_alloc()
    while receiver.frames - first < count:
        adapter.poll()
        time.sleep_ms({poll_ms})
    return receiver.frames - first, gc.mem_alloc() - before
heap = gc.mem_alloc() + gc.mem_free()
before = kept()
from firmware.adapter import Adapter
imported = kept()
adapter = Adapter({arguments})
adapter.start()
print("kept", heap, before, imported, kept(), "end")
{ready}
print("taken", *fly({count}), "end of flight")
"""


def ram(rig: Rig, effort: Effort, findings: Findings) -> tuple[Table, Table]:
    """Bytes of the heap that are in use once everything runs, and that control frames take."""
    running = rig.run(
        _PROGRAM.format(
            arguments=rig.arguments(), ready=rig.ready, count=effort.heap_frames, poll_ms=_POLL_MS
        )
    )
    # Enough for the last round of the main loop.
    spare = 2 * _POLL_MS * _RATE_HZ // 1000
    receiver = running.receiver(islice(control_frames(), effort.heap_frames + spare), _RATE_HZ)
    receiver.start()
    running.board.run_until(lambda: b"end of flight" in running.board.console.output)
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
    frames, taken = running.numbers("taken")
    findings.heap_bytes = taken
    per_frame = Table(
        "Heap taken by frames",
        f"gc.mem_alloc() before and after frames at {_RATE_HZ} Hz with the garbage collector "
        "switched off, while the main loop does what the application's does.",
        ("frames", "bytes in all"),
        ((f"{frames}", f"{taken}"),),
    )
    return kept, per_frame


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
