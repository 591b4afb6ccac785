"""A whole recording in memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ghst_tools.errors import GhstError
from ghst_tools.frames.finder import Pieces
from ghst_tools.frames.formats import Source
from ghst_tools.frames.stream import Stream
from ghst_tools.frames.timeline import Reads, Times
from ghst_tools.frames.timing import Timing


@dataclass(frozen=True)
class Recording:
    """All pieces of a recording, the reads they came in, and when they were on the wire.

    `reads` and `times` are None if the file does not tell.
    """

    where: str
    baud: int
    pieces: Pieces
    reads: Reads | None
    times: Times | None
    timing: Timing


def load(source: Source) -> Recording:
    """Read everything. `GhstError` if there is not one valid frame in it."""
    stream: Stream | None = None
    parts: list[tuple[Pieces, Times | None]] = []
    reads: list[Reads | None] = []
    for block in source.blocks():
        stream = stream or Stream(source.baud)
        parts.append(stream.feed(block))
        reads.append(block.reads)
    if stream is not None:
        parts.append(stream.finish())
    if stream is None or not sum(stream.summary.frames.values()):
        raise GhstError(
            f"{source.where}: no valid frame in it, read as {source.format or 'an empty file'}: "
            "see what `ghst decode` shows, or name another format with --format"
        )
    return Recording(
        source.where,
        source.baud,
        _joined([pieces for pieces, _ in parts]),
        _all_reads(reads),
        _all_times([times for _, times in parts]),
        stream.timing,
    )


def _joined(parts: list[Pieces]) -> Pieces:
    return Pieces(
        b"".join(part.data for part in parts),
        0,
        np.concatenate([part.offset + part.starts for part in parts]),
        np.concatenate([part.verdicts for part in parts]),
    )


def _all_reads(parts: list[Reads | None]) -> Reads | None:
    known = [part for part in parts if part is not None]
    if len(known) < len(parts):
        return None
    lengths = [int(part.ends[-1]) if len(part.ends) else 0 for part in known]
    offsets = np.cumsum([0, *lengths[:-1]])
    return Reads(
        np.concatenate([part.ends + offset for part, offset in zip(known, offsets, strict=True)]),
        np.concatenate([part.times_s for part in known]),
    )


def _all_times(parts: list[Times | None]) -> Times | None:
    known = [part for part in parts if part is not None]
    if len(known) < len(parts):
        return None
    return Times(
        np.concatenate([part.begins_s for part in known]),
        np.concatenate([part.ends_s for part in known]),
        np.concatenate([part.first_reads for part in known]),
        np.concatenate([part.last_reads for part in known]),
    )
