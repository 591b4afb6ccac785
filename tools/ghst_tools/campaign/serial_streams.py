"""What is typed into the console by the campaign: nonsense, near misses, and pushes gone wrong."""

from __future__ import annotations

import binascii
import hashlib
import random
from collections.abc import Callable, Iterator, Sequence

from ghst_tools.campaign.console_bytes import Reader

BATCH = 1500
# Ctrl-C and Ctrl-D stop the application, as documented: they are tried by the firmware's tests.
_STOPPING = b"\x03\x04"
_FILE_PIECE = 42  # bytes, in base64 as many as a line has room for
_GOOD_FILE = b'{"name": "Pushed", "outputs": {"6": {"channel": 9}}, "failsafe": {"time_ms": 200}}'
_BAD_FILE = b'{"name": "Pushed", "outputs": {"6": {"channel": 17}}}'


def _binary(rng: random.Random, names: Sequence[bytes]) -> bytes:
    return rng.randbytes(rng.randrange(1, 60))


def _text(rng: random.Random, names: Sequence[bytes]) -> bytes:
    return bytes(rng.randrange(32, 127) for _ in range(rng.randrange(1, 70))) + b"\r"


def _nearly(rng: random.Random, names: Sequence[bytes]) -> bytes:
    """The name of a command with a letter wrong, missing or twice."""
    name = bytearray(rng.choice(names))
    at = rng.randrange(len(name))
    name[at : at + 1] = rng.choice((b"", b"#", bytes(name[at : at + 1]) * 2))
    return bytes(name) + rng.choice((b"\r", b"\n", b" 1\r", b"\r\n"))


def _arguments(rng: random.Random, names: Sequence[bytes]) -> bytes:
    """A command with arguments that mean nothing."""
    words = [bytes(rng.choice(b"abcz0189-._{}\"',") for _ in range(rng.randrange(1, 12)))]
    known = (b"0", b"-1", b"99999999999", b"on", b"begin", b"put", b"read", b"save", b"restart")
    words += rng.choices(known, k=2)
    rng.shuffle(words)
    return b" ".join([rng.choice(names), *words]) + b"\r"


def _documented(rng: random.Random, names: Sequence[bytes]) -> bytes:
    """A command as it is documented; none of these changes anything on the board."""
    forms = {
        b"config": (b"", b" read 0", b" read 30", b" begin 200", b" restart"),
        b"status": (b"", b" 1000", b" off", b" off"),
        b"calibrate": (b"", b" cancel"),
    }
    name = rng.choice(names)
    return name + rng.choice(forms.get(name, (b"",))) + b"\r"


def _long(rng: random.Random, names: Sequence[bytes]) -> bytes:
    line = rng.choice(names) + bytes([rng.randrange(33, 127)]) * rng.randrange(60, 400)
    return line + b"\x7f" * rng.randrange(3) + b"\r"


def _editing(rng: random.Random, names: Sequence[bytes]) -> bytes:
    """Backspaces, escape sequences and the control characters of terminals and of the REPL."""
    return bytes(
        rng.choice(b"\x01\x02\x03\x04\x05\x06\x08\x0e\x15\x1b\x7f[AB\r") for _ in range(20)
    )


def _python(rng: random.Random, names: Sequence[bytes]) -> bytes:
    return rng.choice(
        (
            b"import machine; machine.reset()\r",
            b"from machine import Pin, PWM; PWM(Pin(6)).duty_u16(5000)\r",
            b"adapter.stop()\r",
            b"main()\r",
            b'{"ghst": "config"}\r',
        )
    )


def push(file: bytes) -> list[bytes]:
    """The lines that give a file to the board, without those that save it."""
    lines = [b"config begin %d" % len(file)]
    for at in range(0, len(file), _FILE_PIECE):
        data = binascii.b2a_base64(file[at : at + _FILE_PIECE], newline=False)
        lines.append(b"config put %d %s" % (at, data))
    digest = hashlib.sha256(file).hexdigest()[:16].encode()
    return [*lines, b"config check " + digest, b"config save"]


def _pushed_wrongly(rng: random.Random, names: Sequence[bytes]) -> bytes:
    """A new file with one thing wrong: the board must not take it."""
    lines = push(_GOOD_FILE)
    fault = rng.randrange(8)
    if fault == 0:
        lines = push(_BAD_FILE)
    elif fault == 1:
        del lines[rng.randrange(len(lines) - 1)]
    elif fault == 2:
        lines[0] = b"config begin %d" % rng.choice((0, 1, len(_GOOD_FILE) - 1, 20_000))
    elif fault == 3:
        at = rng.randrange(1, len(lines) - 2)
        lines[at], lines[at + 1] = lines[at + 1], lines[at]
    elif fault == 4:
        lines[-2] = lines[-2][:-1] + (b"0" if lines[-2][-1:] != b"0" else b"1")
    elif fault == 5:
        lines[0] += b" 0123456789abcdef"
    elif fault == 6:
        lines.insert(-1, lines[1])
    else:
        lines[-1] += b" forced"
    # What an earlier push has left is no help to this one.
    return b"\x15" + b"\r".join([b"config begin 1", *lines]) + b"\r"


def pushed(rng: random.Random, names: Sequence[bytes]) -> bytes:
    """A new file with nothing wrong: only a link that is up has the board refuse it."""
    return b"\x15" + b"\r".join(push(_GOOD_FILE)) + b"\r"


Maker = Callable[[random.Random, Sequence[bytes]], bytes]
KINDS: dict[str, Maker] = {
    "random bytes": _binary,
    "text": _text,
    "misspelt commands": _nearly,
    "commands as documented": _documented,
    "commands with senseless arguments": _arguments,
    "lines beyond their limit": _long,
    "control characters": _editing,
    "Python": _python,
    "configurations pushed with a fault": _pushed_wrongly,
}
WITH_LINK = KINDS | {"configurations pushed": pushed}
"""What is refused while the link is up."""


def restarts(typed: bytes, names: Sequence[bytes], linked: bool) -> bool:
    """Whether a line of it has the board begin anew, as documented."""
    if b"restart" not in typed:
        return False
    for line in Reader(name.decode() for name in names).lines(typed + b"\r"):
        name, _, arguments = line.partition("|")
        if name == "config" and arguments.split() in (
            [["restart", "force"]] if linked else [["restart"], ["restart", "force"]]
        ):
            return True
    return False


def everything(seed: int, total: int, names: Sequence[bytes]) -> Iterator[bytes]:
    """Batches for a console whose commands do nothing: nothing is left out."""
    return _batches(seed, total, names, WITH_LINK, b"", lambda batch: False)


def batches(seed: int, total: int, names: Sequence[bytes], linked: bool) -> Iterator[bytes]:
    """Pieces of about `BATCH` bytes, `total` in all; none stops or restarts the application."""
    kinds = WITH_LINK if linked else KINDS
    return _batches(
        seed, total, names, kinds, _STOPPING, lambda typed: restarts(typed, names, linked)
    )


def _batches(
    seed: int,
    total: int,
    names: Sequence[bytes],
    kinds: dict[str, Maker],
    without: bytes,
    left_out: Callable[[bytes], bool],
) -> Iterator[bytes]:
    rng = random.Random(seed)
    makers = list(kinds.values())
    made = 0
    while made < total:
        batch = b""
        while len(batch) < BATCH:
            longer = batch + rng.choice(makers)(rng, names).translate(None, without)
            if not left_out(longer):
                batch = longer
        made += len(batch)
        yield batch
