"""Runs code in a child process, so that many trials can start from one booted board.

Booting the emulated chip takes seconds of the host's time, a fork of a booted one milliseconds;
and whatever is done to the board is gone when the child ends.
"""

from __future__ import annotations

import os
import pickle
import select
import signal
import traceback
from collections.abc import Callable
from typing import TypeVar

Result = TypeVar("Result")

_LIMIT_S = 12 * 3600
"""Far beyond what the longest flight takes: ends an emulator that hangs."""


class ChildError(Exception):
    """The code raised; the message is its traceback."""


def in_child(function: Callable[[], Result]) -> Result:
    """What `function` returns, called in a fork. Raises ChildError if it raises or hangs."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            try:
                answer = pickle.dumps((function(), ""))
            except BaseException:
                answer = pickle.dumps((None, traceback.format_exc()))
            with os.fdopen(writer, "wb") as pipe:
                pipe.write(answer)
        finally:
            os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as pipe:
        answered, _, _ = select.select([pipe], [], [], _LIMIT_S)
        if not answered:
            os.kill(child, signal.SIGKILL)
        answer = pipe.read()
    _, status = os.waitpid(child, 0)
    if not answered:
        raise ChildError(f"no answer within {_LIMIT_S} s")
    if not answer:
        raise ChildError(f"the child ended with status {status}")
    result, failure = pickle.loads(answer)
    if failure:
        raise ChildError(failure)
    return result  # type: ignore[no-any-return]
