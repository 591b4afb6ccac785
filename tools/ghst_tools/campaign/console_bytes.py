"""Bytes on the board's console, run on MicroPython's unix port: which of them are commands.

The console is the firmware's own; its commands are recorders with the names of the documented
ones. What they are called with is compared with an independent reading of the same bytes.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import takewhile
from typing import IO

from ghst_tools import boards, micropython_image
from ghst_tools.campaign.again import EARLIER
from ghst_tools.campaign.verdict import Case, Row, Wrong

LONGEST = 80
_END = b"~~~"
_STRAY = 2048

# Typed lines in, one line out for each: the command with its arguments, or that there is none.
_PROGRAM = """
import gc, select, sys
from firmware.console import Console
poll = select.poll()
poll.register(sys.stdin, select.POLLIN)
console = Console(poll)
ended = False
def end(arguments):
    global ended
    ended = True
def recorder(name):
    return lambda arguments: print("{{}}|{{}}".format(name, arguments))
for name in {names}:
    console.add(name, recorder(name), "")
console.add({end!r}, end, "")
gc.collect()
before = gc.mem_alloc()
while not ended:
    console.update()
gc.collect()
# A collection of memory takes what stands on the stack by chance for references.
print("kept" if gc.mem_alloc() - before > {stray} else "free")
"""


class Reader:
    """What a console has to make of bytes: the lines of what it prints."""

    def __init__(self, names: Iterable[str]) -> None:
        self._names = set(names)
        self._typed = b""

    def lines(self, data: bytes) -> list[str]:
        """Take bytes; the answers to the lines that they end, but for those that are too long."""
        *ended, self._typed = (self._typed + data).replace(b"\n", b"\r").split(b"\r")
        return [answer for line in ended if (answer := self._answer(line))]

    def _answer(self, line: bytes) -> str:
        typed: list[int] = []
        for byte in line.rpartition(b"\x15")[2]:
            if byte not in b"\x08\x7f":
                typed.append(byte)
            elif len(typed) <= LONGEST:
                # A line that is too long stays that.
                del typed[-1:]
        if len(typed) > LONGEST:
            return ""
        text = "".join(chr(byte) if 32 <= byte <= 126 else "?" for byte in typed).strip(" ")
        name, _, arguments = text.partition(" ")
        if name in self._names:
            return f"{name}|{arguments.strip(' ')}"
        return f"no command {name!r}: type help"


def on_unix(
    batches: Iterable[bytes], names: Sequence[str], limit_s: float
) -> tuple[int, int, int]:
    """Type all of it; how many commands, empty and other lines were read. Raises Wrong."""
    reader = Reader(names)
    expected: list[tuple[str, int]] = []
    all_batches = list(batches)
    with tempfile.TemporaryFile() as file:
        for number, batch in enumerate(all_batches):
            file.write(batch)
            expected += [(line, number) for line in reader.lines(batch)]
        file.write(b"\x15" + _END + b"\r")
        file.seek(0)
        found, error = _run(file, names, limit_s)
    pairs = zip(found, expected, strict=False)
    right = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1][0], pairs))
    if right < len(expected):
        said = found[right] if right < len(found) else error
        line, number = expected[right]
        # A line may have begun in the batch before.
        lengths = (2, *(1 + length for length in EARLIER))
        case, *wider = (
            console_case(all_batches[max(0, number + 1 - length) : number + 1], names)
            for length in lengths
        )
        wrong = Wrong(f"unix port: {said!r}, must be {line!r}", case)
        wrong.wider = wider
        wrong.counts = {"console_bytes": sum(map(len, all_batches[: number + 1]))}
        raise wrong
    if found[right:] != ["free"]:
        raise Wrong(f"unix port: behind all lines: {found[right:]}, {error}")
    kinds = Counter(_kind(line) for line, _ in expected)
    return kinds["command"], kinds["empty"], kinds["other"]


def _kind(answer: str) -> str:
    if answer == "|":
        return "empty"
    return "other" if answer.startswith("no command ") else "command"


def _run(typed: IO[bytes], names: Sequence[str], limit_s: float) -> tuple[list[str], str]:
    """What the console prints, in lines, and what went wrong."""
    program = _PROGRAM.format(names=list(names), end=_END.decode(), stray=_STRAY)
    root = boards.checkout()
    with subprocess.Popen(
        [micropython_image.unix_micropython(), "-c", program],
        env={"MICROPYPATH": f"{root / 'lib'}:{root}:.frozen"},
        stdin=typed,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            out, error = process.communicate(timeout=limit_s)
        except subprocess.TimeoutExpired:
            process.kill()
            out, _ = process.communicate()
            error = f"no answer within {limit_s:.0f} s"
    return out.splitlines(), error.strip()


def console_case(pieces: Sequence[bytes], names: Sequence[str]) -> Case:
    """What was typed as a case that can be saved."""
    return {"kind": "console", "pieces": [piece.hex() for piece in pieces], "names": list(names)}


def replay(case: Case) -> None:
    """Type a saved case; raises Wrong."""
    on_unix([bytes.fromhex(piece) for piece in case["pieces"]], case["names"], 60)


def fuzz(batches: Sequence[bytes], names: Sequence[str], kinds: str) -> list[Row]:
    """Type all batches."""
    total = sum(map(len, batches))
    commands, empty, others = on_unix(batches, names, 60 + total / 2_000)
    return [
        Row(
            "console, unix port",
            f"{total:,} bytes: {kinds}",
            f"{commands} lines that are documented commands and {empty} empty lines, and nothing "
            "else, were handed to what answers them, with their arguments to the letter; "
            f"{others} lines told to be none; no "
            f"exception, at most {_STRAY} bytes of the heap kept",
        )
    ]
