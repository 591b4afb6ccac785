"""What the tests of MSP share: requests cut into payloads, replies collected from chunks."""

V1 = 0x20
V2 = 0x40
START = 0x10
ERROR = 0x80


def v1(command, data=b""):
    """An MSP v1 request as it is before it is cut up; jumbo from 255 bytes on."""
    if len(data) < 255:
        return bytes((len(data), command)) + data
    return jumbo(command, data)


def jumbo(command, data=b""):
    """An MSP v1 request with a 16-bit size, whatever the size is."""
    return bytes((255, command, len(data) & 255, len(data) >> 8)) + data


def v2(command, data=b"", flags=0):
    """An MSP v2 request as it is before it is cut up."""
    header = (flags, command & 255, command >> 8, len(data) & 255, len(data) >> 8)
    return bytes(header) + data


def payloads(message, version=V1, sequence=0, fill=b"\0"):
    """The ten-byte payloads that carry `message`; `fill` follows it, again and again."""
    result = []
    start = START
    at = 0
    while at < len(message) or not result:
        piece = message[at : at + 9]
        piece += (fill * 9)[: 9 - len(piece)]
        result.append(bytes((version | start | sequence & 15,)) + piece)
        sequence += 1
        start = 0
        at += 9
    return result


def feed_all(target, chunks):
    """What `target.feed` returned for each of `chunks`."""
    return [target.feed(chunk) for chunk in chunks]


def chunks_of(reply, limit=200):
    """Every chunk of `reply` that is left."""
    result = []
    chunk = bytearray(6)
    while reply.next_chunk(chunk):
        result.append(bytes(chunk))
        assert len(result) < limit, "the reply does not end"
    return result


def answer_to(responder, message, version=V1):
    """Asks, and returns the payload of the reply; asserts its chunks: start, sequence, version.

    Reads as radios do: on, as long as the last chunk was filled to its end.
    """
    feed_all(responder, payloads(message, version))
    chunks = chunks_of(responder)
    first = chunks[0]
    assert first[0] & ~15 == version | START, hex(first[0])
    header = 3
    size = first[1]
    if version == V2:
        header = 6
        size = first[4] | first[5] << 8
    elif size == 255:
        header = 5
        size = first[3] | first[4] << 8
    data = first[header:]
    for place, chunk in enumerate(chunks[1:], 1):
        assert chunk[0] == version | (first[0] + place) & 15, (place, hex(chunk[0]))
        data += chunk[1:]
    assert len(chunks) == 1 + (size - (6 - header) + 5) // 5, (size, len(chunks))
    assert data[size:] == bytes(len(data) - size), "what follows the payload is zero"
    return data[:size]
