"""Reads from the serial adapter on the wire."""

from __future__ import annotations

import queue
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from ghst_tools.frames.blocks import Block
from ghst_tools.frames.timeline import Reads
from ghst_tools.serial_port import unplugged
from ghst_tools.sniff.log_file import LogFile

_WAIT_S = 0.05
# How long Python may run the view before it lets the reading thread take the time of a read.
_SWITCH_S = 0.0002

Read = tuple[float, bytes]


class Listener:
    """Reads in a thread of its own, so that drawing delays no time; `with` starts and stops it.

    Times are seconds since the start, when a read returned; by the performance counter, since the
    monotonic clock of Windows advances in steps of 15.6 ms before Python 3.13.
    """

    def __init__(self, line: Any) -> None:
        self._line = line
        self._reads: queue.SimpleQueue[Read | Exception] = queue.SimpleQueue()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._begun_s = 0.0
        self._switch_s = 0.0

    def __enter__(self) -> Listener:
        self._switch_s = sys.getswitchinterval()
        sys.setswitchinterval(_SWITCH_S)
        self._begun_s = time.perf_counter()
        self._thread.start()
        return self

    def __exit__(self, *details: object) -> None:
        self.stop()

    def stop(self) -> None:
        """Read no more. What was read can still be taken."""
        if not self._stopping.is_set():
            self._stopping.set()
            self._thread.join()
            sys.setswitchinterval(self._switch_s)

    @property
    def time_s(self) -> float:
        """The time now."""
        return time.perf_counter() - self._begun_s

    def take(self, wait_s: float = _WAIT_S) -> list[Read]:
        """What has been read since the last call; waits for something, but not long.

        Raises what the port raised, when everything before that has been taken.
        """
        found: list[Read] = []
        try:
            while True:
                item = self._reads.get(timeout=0.0 if found else wait_s)
                if isinstance(item, Exception):
                    if not found:
                        raise item
                    self._reads.put(item)  # the last one: the thread has ended
                    return found
                found.append(item)
        except queue.Empty:
            return found

    def _run(self) -> None:
        try:
            while not self._stopping.is_set():
                if data := self._line.read(1):
                    data += self._line.read(self._line.in_waiting)
                    self._reads.put((self.time_s, data))
        except Exception as error:  # to be raised where somebody listens
            self._reads.put(error)


def blocks(
    line: Any, log_file: LogFile, seconds: float | None = None
) -> Iterator[tuple[float, Block]]:
    """What comes from the serial port `line`, and the time; empty blocks in a silence.

    Everything goes into the log. Ends after `seconds`, or with Ctrl-C.
    """
    kept = f"; what came before is in {log_file.path}" if log_file.path else ""
    with Listener(line) as listener:
        while seconds is None or listener.time_s < seconds:
            try:
                with unplugged(line.port, f"listened for {listener.time_s:.1f} s{kept}"):
                    reads = listener.take()
            except KeyboardInterrupt:
                seconds = 0.0
                listener.stop()
                reads = listener.take(0.0)
            for time_s, data in reads:
                log_file.add(time_s, data)
            yield listener.time_s, _block(reads)


def _block(reads: list[Read]) -> Block:
    ends = np.cumsum([len(data) for _, data in reads], dtype=np.int64)
    return Block(b"".join(data for _, data in reads), Reads(ends, np.array([t for t, _ in reads])))
