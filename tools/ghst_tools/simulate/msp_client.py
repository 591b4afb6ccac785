"""Questions over MSP, as the scripts of a Ghost radio ask them, and their answers."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

from ghst import encode, msp  # type: ignore[import-not-found]
from ghst.protocol import TYPE_MSP_REQUEST  # type: ignore[import-not-found]
from ghst_tools.frames import fields

_FIRST_S = 0.25  # the link data have been there
_TRIES = 3
_START, _V1, _V2 = 0x10, 0x20, 0x40
_LAST_V1 = 254  # the highest number of a command in MSP v1
_ERROR = 0x80


class Answer(NamedTuple):
    """What was answered to a command; `data` None: an error."""

    command: int
    data: bytes | None

    def text(self) -> str:
        """In plain words."""
        return f"MSP {title(self.command)}: {_says(self.command, self.data)}"


class MspClient:
    """Asks one command after the other, each at most three times; `answers` are those that came.

    `unanswered` are the commands that were given up. A question is repeated after `wait_s` of
    silence.
    """

    def __init__(self, commands: Sequence[int], wait_s: float = 1.0) -> None:
        self.answers: list[Answer] = []
        self.unanswered: list[int] = []
        self._open = deque(commands)
        self._message = msp.Request()
        self._tries = 0
        self._sequence = 0
        self._wait_s = wait_s
        self._last_s = _FIRST_S - wait_s

    @property
    def done(self) -> bool:
        """Whether nothing is open any more."""
        return not self._open

    def question(self, now_s: float) -> bytes | None:
        """The frame to be sent now, if it is time for one; seconds since the first slot."""
        if self._open and now_s - self._last_s >= self._wait_s and self._tries == _TRIES:
            self._next(self.unanswered.append)
        if not self._open or now_s - self._last_s < self._wait_s:
            return None
        self._tries += 1
        self._last_s = now_s
        self._sequence = (self._sequence + 1) & 15
        return request(self._open[0], self._sequence)

    def take(self, chunk: bytes, now_s: float) -> Answer | None:
        """Take the MSP part of a response frame; returns the answer that it completes."""
        message = self._message
        outcome = message.feed(chunk)
        if self._tries:
            self._last_s = now_s  # it is under way; else this follows an answer that is complete
        if outcome != msp.COMPLETE or not self._open or message.command != self._open[0]:
            return None
        failed = chunk[0] & _START and chunk[0] & _ERROR
        answer = Answer(message.command, None if failed else bytes(message.data[: message.size]))
        self.answers.append(answer)
        self._next(lambda command: None)
        return answer

    def give_up(self) -> None:
        """There is no more time: what is open stays unanswered."""
        while self._open:
            self._next(self.unanswered.append)

    def _next(self, done: Callable[[int], None]) -> None:
        done(self._open.popleft())
        self._tries = 0
        self._last_s -= self._wait_s


def request(command: int, sequence: int = 0) -> bytes:
    """A frame that asks `command`, 0..65535, without data: MSP v1 if it has a number there."""
    if command <= _LAST_V1:
        # Status, size, command, and the xor of both that radios' scripts append.
        head = bytes((_START | _V1 | sequence, 0, command, command))
    else:
        # Status, flags, command u16, size u16.
        head = bytes((_START | _V2 | sequence, 0, command & 0xFF, command >> 8, 0, 0))
    return bytes(encode.msp(TYPE_MSP_REQUEST, head + bytes(msp.PAYLOAD_SIZE - len(head))))


def number(name: str) -> int:
    """The number of a command, by its name (with `-` or `_`) or as text; else `ValueError`."""
    wanted = name.lower().replace("-", "_")
    for found, known in fields.msp_command_names().items():
        if known == wanted:
            return found
    value = int(name, 0)
    if not 0 <= value <= 0xFFFF:
        raise ValueError(f"MSP command is {value}, must be 0..65535")
    return value


def title(command: int) -> str:
    """Number and name of a command."""
    name = fields.msp_command_names().get(command)
    return f"{command} {name}" if name else str(command)


def _says(command: int, data: bytes | None) -> str:
    if data is None:
        return "error, the flight controller does not answer this command"
    name = fields.msp_command_names().get(command)
    if name == "api_version" and len(data) == 3:
        return f"protocol {data[0]}, API {data[1]}.{data[2]}"
    if name == "fc_version" and len(data) == 3:
        return ".".join(map(str, data))
    if name in ("fc_variant", "name", "build_info"):
        return data.decode("ascii", "replace").strip()
    return data.hex(" ") if data else "no data"
