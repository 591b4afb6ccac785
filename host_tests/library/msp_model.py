"""A second implementation of MSP in GHST, from its description: whole messages at a time.

`Assembly` sees all payloads that came so far as a list, `reply_chunks` makes all chunks at once,
`read_reply` reads chunks as a radio does.
"""

import struct
from dataclasses import dataclass, field

V1, V2, START, ERROR = 0x20, 0x40, 0x10, 0x80
REQUEST_SIZE = 512


@dataclass
class Message:
    """A request: `size` bytes announced, `data` what has come of them."""

    version: int
    flags: int
    command: int
    size: int
    data: bytes


def parse_start(payload: bytes) -> Message | None:
    """The message that a start payload begins, with all that follows the header; None: cut off."""
    version = 1 if payload[0] & 0x60 == V1 else 2
    rest = payload[1:]
    try:
        if version == 2:
            flags, command, size = struct.unpack_from("<BHH", rest)
            return Message(2, flags, command, size, rest[5:])
        size, command = struct.unpack_from("<BB", rest)
        if size != 255:
            return Message(1, 0, command, size, rest[2:])
        (size,) = struct.unpack_from("<H", rest, 2)
        return Message(1, 0, command, size, rest[4:])
    except struct.error:
        return None


@dataclass
class Assembly:
    """Takes payloads; `complete` and `refused` are the messages that came out."""

    complete: list[Message] = field(default_factory=list)
    refused: list[Message] = field(default_factory=list)
    sequence_errors: int = 0
    restarts: int = 0
    orphans: int = 0
    malformed: int = 0
    _open: Message | None = None
    _due: int | None = None
    """The sequence that must come next; None when nothing can be continued."""

    def feed(self, payload: bytes) -> Message | None:
        """The message that this payload completes or that is refused, if there is one."""
        payload = payload[:10]
        opened, due = self._open, self._due
        self._open = self._due = None
        if not payload or payload[0] & 0x60 == 0x60:
            self.malformed += 1
            return None
        sequence = payload[0] & 15
        if payload[0] & START:
            self.restarts += opened is not None
            message = parse_start(payload)
            if message is None:
                self.malformed += 1
                return None
            if message.size > REQUEST_SIZE:
                self.refused.append(message)
                return message
        elif due != sequence:
            self.sequence_errors += opened is not None
            self.orphans += opened is None
            return None
        elif opened is None:
            return None  # the end of a message whose data filled the payload before
        else:
            message = opened
            message.data += payload[1:]
        if len(message.data) <= message.size:
            self._due = (sequence + 1) % 16
        if len(message.data) < message.size:
            self._open = message
            return None
        message.data = message.data[: message.size]
        self.complete.append(message)
        return message


def reply_chunks(
    version: int, command: int, data: bytes, error: bool, sequence: int
) -> list[bytes]:
    """All chunks of a reply."""
    if version == 2:
        body = struct.pack("<BHH", 0, command, len(data)) + data
    elif len(data) < 255:
        body = struct.pack("<BB", len(data), command) + data
    else:
        body = struct.pack("<BBH", 255, command, len(data)) + data
    status = V1 if version == 1 else V2
    chunks = []
    for place in range(len(body) // 5 + 1):
        first = (START | (ERROR if error else 0)) if place == 0 else 0
        piece = body[5 * place : 5 * place + 5].ljust(5, b"\0")
        chunks.append(bytes([status | first | (sequence + place) % 16]) + piece)
    return chunks


def read_reply(chunks: list[bytes]) -> Message:
    """What a radio makes of a whole reply; it wants another chunk after one that is full."""
    message = parse_start(chunks[0])
    assert message is not None
    sequence = chunks[0][0] & 15
    rest = list(chunks[1:])
    full = len(message.data) <= message.size
    while full:
        chunk = rest.pop(0)
        sequence = (sequence + 1) % 16
        assert chunk[0] == (chunks[0][0] & 0x60) | sequence
        full = len(message.data) + 5 <= message.size
        message.data += chunk[1:]
    assert not rest, "chunks behind the end"
    message.data = message.data[: message.size]
    return message
