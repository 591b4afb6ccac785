"""Configuration files with errors in them, made from a seed."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable, Iterator
from typing import Any

from ghst_tools import boards

# A configuration with something of everything, as a user might have it.
FULL: dict[str, Any] = {
    "name": "Wing 7",
    "outputs": {
        "6": {"reverse": True, "failsafe": "hold", "minimum_us": 1000, "maximum_us": 2000},
        "7": {"minimum_us": 1100, "centre_us": 1480, "maximum_us": 1900, "failsafe": 1500},
        "8": {"motor": True, "minimum_us": 1000},
        "9": {"kind": "switch", "channel": 9, "threshold_us": 1600, "failsafe": "off"},
        "10": {"kind": "oneshot125", "frequency_hz": 250, "failsafe": 187.5},
        "11": {"kind": "oneshot125", "frequency_hz": 250, "slow_us_per_s": 200},
        "12": {"deadband_us": 8, "subtrim_us": -20},
    },
    "arming": {"channel": 5, "throttle_channel": 3, "threshold_us": 1700},
    "failsafe": {"time_ms": 300, "minimum_lq_percent": 20},
    "wire": {"pin": 2},
    "battery": {"enabled": True, "divider": 11.0},
    "gps": {"enabled": False},
}

_TOKEN = re.compile(r'"[^"]*"|-?\d+\.?\d*|true|false|null|[{}\[\],:]')
_VALUES = (
    *("0", "1", "-1", "2", "15", "16", "17", "22", "26", "29", "30", "799", "800", "2200", "2201"),
    *("1e3", "1e999", "-0.0", "1073741824", "99999999999999999999", "0.1", "1500.25"),
    *("true", "false", "null", '""', '"hold"', '"none"', '"on"', '"switch"', '"motor"', '"6"'),
    *("{}", "[]", "[[1]]", '{"a": 1}', "NaN", "Infinity", '"\\u0000"', '"\\ud800"', "[1, 2, 3]"),
)


def _bit(rng: random.Random, text: bytes) -> bytes:
    data = bytearray(text)
    for _ in range(rng.choice((1, 1, 1, 2, 8))):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(data)


def _byte(rng: random.Random, text: bytes) -> bytes:
    at = rng.randrange(len(text))
    new = rng.choice(
        (rng.randbytes(1), rng.choice(b'{}[]",:-.0123456789 \n\\').to_bytes(1, "big"))
    )
    return text[:at] + new + text[at + 1 :]


def _cut(rng: random.Random, text: bytes) -> bytes:
    return text[: rng.randrange(len(text))]


def _lost(rng: random.Random, text: bytes) -> bytes:
    at = rng.randrange(len(text))
    return text[:at] + text[at + rng.randrange(1, 40) :]


def _twice(rng: random.Random, text: bytes) -> bytes:
    at, to = rng.randrange(len(text)), rng.randrange(len(text))
    return text[:to] + text[at : at + rng.randrange(1, 60)] + text[to:]


def _sector(rng: random.Random, text: bytes) -> bytes:
    # What a flash has where nothing was written, or where it was erased half.
    at = rng.randrange(len(text))
    return text[:at] + rng.choice((b"\xff", b"\x00")) * rng.randrange(1, 200) + text[at + 64 :]


def _token(rng: random.Random, text: bytes) -> bytes:
    words = list(_TOKEN.finditer(text.decode()))
    word = rng.choice(words)
    new = rng.choice((rng.choice(_VALUES), rng.choice(words)[0])).encode()
    return text[: word.start()] + new + text[word.end() :]


def _tree(rng: random.Random, text: bytes) -> bytes:
    """Valid JSON: a value or a name somewhere is another one."""
    tree = json.loads(text)
    node: Any = tree
    while True:
        name = rng.choice(list(node))
        if not isinstance(node[name], dict) or not node[name] or rng.random() < 0.2:
            break
        node = node[name]
    if rng.random() < 0.25:
        node[rng.choice(("pin", "6", "06", "x", "", "channel", "0", "23", "-1"))] = node.pop(name)
    else:
        node[name] = "@"
    return json.dumps(tree).replace('"@"', rng.choice(_VALUES)).encode()


def _deep(rng: random.Random, text: bytes) -> bytes:
    at = rng.randrange(len(text))
    return text[:at] + rng.choice((b"[", b'{"a":', b"(")) * rng.randrange(10, 2000) + text[at:]


KINDS: dict[str, Callable[[random.Random, bytes], bytes]] = {
    "flipped bits": _bit,
    "wrong bytes": _byte,
    "cut off": _cut,
    "parts lost": _lost,
    "parts twice": _twice,
    "erased parts": _sector,
    "other words": _token,
    "other values": _tree,
    "nesting": _deep,
}
_OFTEN = (*KINDS, "other values", "other values", "other values", "other words", "other words")


def corrupted(seed: int, text: bytes, count: int) -> Iterator[bytes]:
    """`count` ways in which `text`, a JSON object, is wrong or at least different."""
    rng = random.Random(seed)
    for _ in range(count):
        yield KINDS[rng.choice(_OFTEN)](rng, text)


def user_file() -> bytes:
    """`ghst.json` with something of everything."""
    return json.dumps(FULL, indent=1).encode()


def board_file() -> bytes:
    """`board.json` as the default board gets it."""
    return boards.load(boards.DEFAULT_BOARD).definition
