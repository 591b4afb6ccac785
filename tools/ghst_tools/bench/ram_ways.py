"""What the ways to keep less in RAM save, each measured on a board without it, or with it."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from ghst_tools import device_files, fold, points_table, shorten
from ghst_tools.bench.figures import Findings, Table
from ghst_tools.bench.modules import with_nothing_connected
from ghst_tools.bench.rig import Change, Rig

_NO_LINE_NUMBERS = 3
"""The level of optimisation that leaves them out, and assertions."""

REDUCTION: tuple[str, Change] = ("firmware.equip", ("    _reduce()\n    fault", "    fault"))


def _rig(
    rig: Rig,
    *,
    help_texts: bool = False,
    full_names: bool = False,
    kept_start: bool = False,
    level: int = 0,
) -> Rig:
    """A rig whose .mpy files are made otherwise than those that boards get."""
    names = {device_files.dotted(name): name for name in rig.sources}
    texts = {name: rig.sources[path].read_text("utf-8") for name, path in names.items()}
    if not help_texts:
        points = device_files.dotted(points_table.MODULE)
        texts[points] = points_table.compact(texts[points])
    if kept_start:
        name, (old, new) = REDUCTION
        if texts[name].count(old) != 1:
            raise AssertionError(f"{name} has not once: {old}")
        texts[name] = texts[name].replace(old, new)
    texts = fold.fold(texts)
    if not full_names:
        texts = shorten.shorten(texts)
    other = copy.copy(rig)
    other.files = dict(rig.files)
    for name, text in texts.items():
        path = f"/lib/{names[name].removesuffix('.py')}.mpy"
        other.files[path] = device_files.compile_module(
            rig.sources[names[name]], path, rig.definition.mpy_arch, text, level
        )
    return other


def ram_ways(rig: Rig, findings: Findings) -> tuple[Table, ...]:
    """Bytes kept by the application with nothing connected."""
    ways = {
        "private names at their full length": _rig(rig, full_names=True),
        "points of the configuration with their help texts": _rig(rig, help_texts=True),
        "nothing forgotten behind the start": _rig(rig, kept_start=True),
        "without line numbers and assertions (mpy-cross -O3)": _rig(rig, level=_NO_LINE_NUMBERS),
    }
    with ProcessPoolExecutor(mp_context=get_context("fork")) as pool:
        kept = dict(zip(ways, pool.map(with_nothing_connected, ways.values()), strict=True))
    as_it_is = findings.kept[".mpy"]
    rows: Sequence[tuple[str, int]] = (
        (".mpy, as it is", as_it_is),
        *kept.items(),
        ("frozen, as it is", findings.kept["frozen"]),
    )
    table = Table(
        "RAM of the application: ways to keep less",
        "As above, nothing connected. Names are shortened, help texts left out and the start "
        "forgotten in the firmware as it is: the rows show what it would keep without that. Line "
        "numbers and assertions it has.",
        ("firmware", "bytes", "more"),
        tuple(
            (name, f"{size}", f"{size - as_it_is:+d}" if size != as_it_is else "")
            for name, size in rows
        ),
    )
    return (table,)
