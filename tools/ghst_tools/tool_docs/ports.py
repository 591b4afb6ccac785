"""Serial ports for the examples: pseudo-terminals under the names of adapters."""

from __future__ import annotations

import contextlib
import os
import select
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from ghst_tools.frames.formats import Source
from ghst_tools.tool_docs.flight_controller import FlightController
from ghst_tools.tool_docs.recorded_board import EVERY_S, RecordedBoard

_POLL_S = 0.01
_SLOT_S = 0.001


@contextlib.contextmanager
def adapters(folder: Path, recording: Path, status: Path) -> Iterator[None]:
    """Serial ports in `folder`.

    `ttyUSB0` says again and again what `recording` has, `ttyUSB1` only listens, `ttyUSB2` is on
    one wire with a `FlightController`. `ttyACM0` is a board that says what `status` has.
    """
    reads: list[tuple[float, bytes]] = []
    for block in Source(recording).blocks():
        assert block.reads is not None
        ends = [0, *block.reads.ends.tolist()]
        for time_s, start, stop in zip(block.reads.times_s.tolist(), ends, ends[1:], strict=False):
            reads.append((time_s, block.data[start:stop]))
    stopping = threading.Event()
    with contextlib.ExitStack() as stack:
        talker = stack.enter_context(_port(folder / "ttyUSB0"))
        listener = stack.enter_context(_port(folder / "ttyUSB1"))
        partner = stack.enter_context(_port(folder / "ttyUSB2"))
        console = stack.enter_context(_port(folder / "ttyACM0"))
        threads = [
            threading.Thread(target=_say, args=(console, RecordedBoard(status), stopping)),
            threading.Thread(target=_talk, args=(talker, reads, stopping)),
            threading.Thread(target=_listen, args=(listener, stopping)),
            threading.Thread(target=_answer, args=(partner, stopping)),
        ]
        for thread in threads:
            thread.start()
        try:
            yield
        finally:
            stopping.set()
            for thread in threads:
                thread.join()


@contextlib.contextmanager
def _port(name: Path) -> Iterator[int]:
    # Not on Windows: only who writes the document needs them.
    import pty
    import tty

    ours, theirs = pty.openpty()
    try:
        tty.setraw(ours)
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        name.symlink_to(os.ttyname(theirs))
        yield ours
    finally:
        os.close(ours)
        os.close(theirs)


def _talk(port: int, reads: list[tuple[float, bytes]], stopping: threading.Event) -> None:
    while not stopping.is_set():
        begun_s = time.monotonic()
        for time_s, data in reads:
            if stopping.wait(max(0.0, begun_s + time_s - time.monotonic())):
                return
            # A line does not wait for anybody to listen either.
            with contextlib.suppress(BlockingIOError):
                os.write(port, data)


def _listen(port: int, stopping: threading.Event) -> None:
    while not stopping.is_set():
        if select.select([port], [], [], _POLL_S)[0]:
            os.read(port, 4096)


def _say(port: int, board: RecordedBoard, stopping: threading.Event) -> None:
    due_s = time.monotonic()
    while not stopping.is_set():
        if select.select([port], [], [], _POLL_S)[0]:
            os.write(port, board.hear(os.read(port, 4096)))
            due_s = time.monotonic() + EVERY_S
        elif time.monotonic() >= due_s:
            due_s += EVERY_S
            with contextlib.suppress(BlockingIOError):
                os.write(port, board.tick())


def _answer(port: int, stopping: threading.Event) -> None:
    flight_controller = FlightController()
    while not stopping.is_set():
        if not select.select([port], [], [], _POLL_S)[0]:
            continue
        octets = os.read(port, 4096)
        os.write(port, octets)  # one wire: who sends hears it
        if answer := flight_controller.hear(octets):
            time.sleep(_SLOT_S)
            os.write(port, answer)
