"""The log of what was on the wire, in the format of `ghst sniff`."""

from __future__ import annotations

from collections.abc import Sequence

from ghst_tools.simulate.send import Sent
from ghst_tools.sniff.listen import Read
from ghst_tools.sniff.log_file import LogFile

# What was sent ends later than it was written, and reads are told late.
_SETTLED_S = 0.1


class WireLog:
    """Writes what was read. Without an echo also what was sent, as if it had been read.

    Until it is known whether there is an echo everything waits.
    """

    def __init__(self, log_file: LogFile, baud: int) -> None:
        self._log_file = log_file
        self._byte_s = 10 / baud
        self._reads: list[Read] = []
        self._sent: list[Read] = []
        self._last_s = 0.0

    def add(
        self, sent: Sequence[Sent], reads: Sequence[Read], echo: bool | None, now_s: float
    ) -> None:
        """Take what happened since the last call; `echo`: is there one, None: not known."""
        self._reads += reads
        self._sent += [
            (slot.time_s + len(slot.octets) * self._byte_s, slot.octets)
            for slot in sent
            if slot.octets
        ]
        if echo is not None:
            self._write(echo, now_s - _SETTLED_S)

    def finish(self, echo: bool | None) -> None:
        """Nothing more comes."""
        self._write(bool(echo), float("inf"))

    def _write(self, echo: bool, until_s: float) -> None:
        waiting = sorted(self._reads if echo else self._reads + self._sent)
        for time_s, octets in waiting:
            if time_s <= until_s:
                self._last_s = max(self._last_s, time_s)
                self._log_file.add(self._last_s, octets)
        self._reads = [read for read in self._reads if read[0] > until_s]
        self._sent = [] if echo else [burst for burst in self._sent if burst[0] > until_s]
