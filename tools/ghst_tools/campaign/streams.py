"""Bytes that a wire may bring, made from a seed: noise, real traffic with errors, wild content.

Everything is a function of the seed: the same one gives the same bytes on every machine.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator

from ghst_tools.campaign.model import CONTROL_TYPES, FC, control, frame

# What two frames of a real receiver carried: the sticks wander from here.
_REAL_RAW = (0x7D8, 0x7E2, 0x75C, 0x748)
_REAL_TYPES = (0x11, 0x13, 0x10)
_ADDRESSES = range(0x80, 0x8A)


def real_traffic(rng: random.Random) -> bytes:
    """A frame as a receiver with 12 channels sends it: sticks near the middle, types in turn."""
    kind = rng.choice(_REAL_TYPES)
    sticks = [min(4095, max(0, raw + rng.randrange(-400, 401))) for raw in _REAL_RAW]
    if kind == 0x13:
        tail = [rng.randrange(101), rng.randrange(40, 125), rng.choice((5, 6, 8, 10)), 20]
    else:
        tail = [rng.choice((24, 124, 125, 224)) for _ in range(4)]
    return control(kind, sticks, tail)


def wild_frame(rng: random.Random) -> bytes:
    """Any address, type, length and content, with the CRC that belongs to them."""
    kind = rng.choice((rng.randrange(256), rng.choice(CONTROL_TYPES), 0x20, 0x21, 0x22))
    address = rng.choice((FC, FC, rng.choice(_ADDRESSES)))
    return frame(address, kind, rng.randbytes(rng.choice((10, 10, rng.randrange(11)))))


def noise(rng: random.Random) -> bytes:
    """Random bytes."""
    return rng.randbytes(rng.randrange(1, 64))


def dense_noise(rng: random.Random) -> bytes:
    """Noise that is full of addresses and lengths: false starts in plenty."""
    kinds = (lambda: rng.choice(_ADDRESSES), lambda: rng.randrange(15), lambda: rng.randrange(256))
    return bytes(rng.choice(kinds)() for _ in range(rng.randrange(1, 40)))


def flipped(rng: random.Random) -> bytes:
    """Real traffic with one to eight wrong bits in a frame."""
    data = bytearray(real_traffic(rng))
    for bit in rng.sample(range(8 * len(data)), rng.randrange(1, 9)):
        data[bit // 8] ^= 1 << bit % 8
    return bytes(data)


def wrong_length(rng: random.Random) -> bytes:
    """A frame whose length byte is another one, half of them with a CRC for that length."""
    data = bytearray(real_traffic(rng))
    data[1] = rng.randrange(256)
    if rng.random() < 0.5 and 2 <= data[1] <= 12:
        data[data[1] + 1 :] = frame(FC, data[2], bytes(data[3 : data[1] + 1]))[-1:]
    return bytes(data)


def truncated(rng: random.Random) -> bytes:
    """The beginning, the end or the middle of a frame."""
    whole = rng.choice((real_traffic, wild_frame))(rng)
    first, last = sorted(rng.sample(range(len(whole) + 1), 2))
    return rng.choice((whole[:last], whole[first:], whole[first:last])) or whole[:1]


def repeated(rng: random.Random) -> bytes:
    """A frame that comes several times, or one byte of it that does."""
    data = real_traffic(rng)
    if rng.random() < 0.5:
        return data * rng.randrange(2, 6)
    at = rng.randrange(len(data))
    return data[:at] + data[at : at + 1] * rng.randrange(2, 20) + data[at:]


def msp_burst(rng: random.Random) -> bytes:
    """MSP frames, one behind the other: as many as may wait in a receiver, and more."""
    count = rng.choice((1, 2, 3, 8, 9, 12))
    return b"".join(frame(FC, rng.choice((0x21, 0x22)), rng.randbytes(10)) for _ in range(count))


KINDS: dict[str, Callable[[random.Random], bytes]] = {
    "random": noise,
    "false starts": dense_noise,
    "real traffic": real_traffic,
    "bit-flipped real traffic": flipped,
    "wrong lengths": wrong_length,
    "truncated": truncated,
    "repeated": repeated,
    "right CRC, wild content": wild_frame,
    "bursts of MSP": msp_burst,
}


def sentinel(rng: random.Random) -> bytes:
    """An intact control frame that has to be decoded whatever came before it."""
    return control(0x30, [rng.randrange(4096) for _ in range(4)], rng.randbytes(4))


def blocks(seed: int, total: int) -> Iterator[list[bytes]]:
    """Lists of pieces, of all kinds, of `total` bytes in all or a little more.

    The last piece of each list is a sentinel.
    """
    rng = random.Random(seed)
    makers = list(KINDS.values())
    made = 0
    while made < total:
        pieces = [rng.choice(makers)(rng) for _ in range(rng.randrange(1, 24))]
        pieces.append(sentinel(rng))
        made += sum(map(len, pieces))
        yield pieces
