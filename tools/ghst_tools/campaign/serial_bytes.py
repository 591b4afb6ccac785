"""Bytes on the USB console of the running application: nothing of it moves an output."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

from ghst_tools.campaign import console_bytes
from ghst_tools.campaign.line import CENTRE
from ghst_tools.campaign.pico import NO_SENSORS, PERIOD_NS, SERVOS, Pico
from ghst_tools.campaign.picos import Picos, forked, no_exception
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Row, Trial, equal, expect

# Ctrl-C and Ctrl-D stop the application, as documented: they are tried by the firmware's tests.
_STOPPING = b"\x03\x04"
_NAME = re.compile(rb"^\(?(\w+)\)?", re.MULTILINE)
_RATE_HZ = 100
_SLICES = 4
_BATCH = 1500
_CONFIGURATION = NO_SENSORS | {"name": "Campaign"}
# What a documented command does to the board, and must not by accident.
_RESTARTING = re.compile(rb"\b(restart|save|force)\b")


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
    words += rng.choices((b"0", b"-1", b"99999999999", b"on", b"begin", b"put", b"read"), k=2)
    rng.shuffle(words)
    return b" ".join([rng.choice(names), *words]) + b"\r"


def _long(rng: random.Random, names: Sequence[bytes]) -> bytes:
    line = rng.choice(names) + bytes([rng.randrange(33, 127)]) * rng.randrange(60, 400)
    return line + b"\x7f" * rng.randrange(3) + b"\r"


def _editing(rng: random.Random, names: Sequence[bytes]) -> bytes:
    """Backspaces, escape sequences and the control characters of terminals and of the REPL."""
    return bytes(rng.choice(b"\x01\x02\x05\x06\x08\x0e\x15\x1b\x7f[AB\r") for _ in range(20))


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


KINDS: dict[str, Callable[[random.Random, Sequence[bytes]], bytes]] = {
    "random bytes": _binary,
    "text": _text,
    "misspelt commands": _nearly,
    "commands with senseless arguments": _arguments,
    "lines beyond their limit": _long,
    "control characters": _editing,
    "Python": _python,
}


def batches(seed: int, total: int, names: Sequence[bytes]) -> Iterator[bytes]:
    """Pieces of about `_BATCH` bytes, `total` in all; none stops or restarts the application."""
    rng = random.Random(seed)
    makers = list(KINDS.values())
    made = 0
    while made < total:
        batch = b""
        while len(batch) < _BATCH:
            piece = rng.choice(makers)(rng, names)
            if not _RESTARTING.search(piece):
                batch += piece.translate(None, _STOPPING)
        made += len(batch)
        yield batch


def documented(pico: Pico) -> list[bytes]:
    """The names of the commands that `help` lists."""
    start = len(pico.board.console.output)
    pico.board.console.write(b"help\r~\r")
    pico.board.run_until(lambda: b"no command '~'" in pico.board.console.output[start:])
    lines = bytes(pico.board.console.output[start:]).splitlines()
    names = [found[1] for line in lines if b":" in line and (found := _NAME.match(line))]
    names = [name for name in names if name not in (b"Enter", b"no")]
    expect(b"help" in names, f"the commands are {names}")
    return names


def type_in(pico: Pico, batch: bytes, number: int) -> None:
    """Type a batch and wait until the application has taken all of it."""
    mark = f"~{number}"
    start = len(pico.board.console.output)
    pico.board.console.write(batch + b"\x15\r" + mark.encode() + b"\r")
    answer = f"no command '{mark}'".encode()
    case = serial_case([batch])
    try:
        pico.board.run_until(lambda: answer in pico.board.console.output[start:], 20e9, 2e6)
    except TimeoutError as error:
        expect(False, f"the console does not answer: {error}", case)
    no_exception(pico, case)


def check_still(pico: Pico, case: dict[str, Any]) -> None:
    """No output has moved, and no compare register was written."""
    equal(pico.compares, [], "compare writes without a link", case)
    for pin in SERVOS:
        equal(pico.meter.pulses[pin], [], f"pulses on GP{pin} without a link", case)


def fuzz_console(pico: Pico, seed: int, total: int, flying: bool) -> tuple[int, int]:
    """`total` bytes; how many, and how many control frames came meanwhile."""
    names = documented(pico)
    before = pico.board.flash_filesystem()
    receiver = pico.fly(lambda index, t: CENTRE, _RATE_HZ) if flying else None
    if receiver:
        pico.board.run_for(100e6)
    count = frames = 0
    for number, batch in enumerate(batches(seed, total, names)):
        type_in(pico, batch, number)
        count += len(batch)
        case = serial_case([batch])
        if receiver is None:
            check_still(pico, case)
            continue
        # The last frame may be on its way.
        frames += len(receiver.sent)
        missing = _SLICES * len(receiver.sent) - len(pico.compares)
        expect(abs(missing) <= _SLICES, f"{missing} compare writes are missing", case)
        equal({write.value for write in pico.compares}, {_BOTH_CENTRED}, "compare values", case)
        for pin in SERVOS:
            pulses = pico.meter.pulses[pin]
            widths = {round(pulse.width_ns) for pulse in pulses}
            equal(widths - {1_500_000}, set(), f"other pulses on GP{pin}", case)
            if len(pulses) > 1:
                mean = (pulses[-1].rise_ns - pulses[0].rise_ns) / (len(pulses) - 1)
                equal(round(mean / 1e3), round(PERIOD_NS / 1e3), f"period on GP{pin}", case)
            pulses.clear()
        receiver.trim()
        pico.compares.clear()
        pico.wire.edges.clear()
        pico.board.console.output.clear()
    equal(pico.board.flash_filesystem() == before, True, "the file system is as it was")
    expect("stood still 0 times" in pico.reply_to_enter(), "the main loop stood still")
    expect(not pico.board.resets, "the watchdog has reset the board")
    return count, frames


_BOTH_CENTRED = 4800 << 16 | 4800  # counts of 0.3125 us


def serial_case(pieces: Sequence[bytes]) -> dict[str, Any]:
    """What was typed as a case that can be saved."""
    return {"kind": "serial", "pieces": [piece.hex() for piece in pieces]}


def replay(case: dict[str, Any], picos: Picos) -> None:
    """Type a saved case into a started board; raises Wrong."""
    pico = picos.boot(_CONFIGURATION)

    def trial() -> None:
        pico.board.run_for(300e6)
        for number, piece in enumerate(case["pieces"]):
            type_in(pico, bytes.fromhex(piece), number)
            check_still(pico, case)

    forked(trial)


def fuzz(setting: Setting, flying: bool) -> list[Row]:
    """Bytes on the console, with or without a link."""
    pico = setting.picos.boot(_CONFIGURATION)
    total = setting.effort.serial_bytes // 2
    seed = setting.seed + flying

    def trial() -> tuple[int, int]:
        pico.board.run_for(300e6)
        return fuzz_console(pico, seed, total, flying)

    count, frames = forked(trial)
    done = f"{count:,} bytes: {', '.join(KINDS)}"
    happened = (
        "no file changed, no fault of the main loop, which answered after each batch; no reset"
    )
    if flying:
        happened = (
            f"each of {frames} control frames written to the outputs meanwhile, and nothing else; "
            f"no pulse missing or different; {happened}"
        )
        return [Row("USB console, link up", done, happened)]
    return [Row("USB console, no link", done, f"no output moved; {happened}")]


def fuzz_reading(setting: Setting) -> list[Row]:
    """Bytes on the console as the unix port runs it: which lines are commands."""
    names = forked(lambda: documented(setting.picos.boot(_CONFIGURATION)))
    made = list(batches(setting.seed, setting.effort.console_bytes, names))
    commands = ["", *(name.decode() for name in names)]
    return console_bytes.fuzz(made, commands, ", ".join(KINDS))


def trials(setting: Setting) -> Iterator[tuple[str, Trial]]:
    """The trials, by name."""
    yield "unix port", partial(fuzz_reading, setting)
    yield "no link", partial(fuzz, setting, False)
    yield "link up", partial(fuzz, setting, True)
