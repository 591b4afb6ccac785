"""Other ways to write the control path, each measured on a board of its own."""

from __future__ import annotations

import re
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

from ghst_tools.bench.control_path import latencies_us
from ghst_tools.bench.echo import ECHO_WAYS, SHARE_HZ, cost
from ghst_tools.bench.figures import Effort, Findings, Spread, Table
from ghst_tools.bench.rig import Change, Rig
from ghst_tools.errors import GhstError

_DECODER, _INTERRUPTS = "ghst/decoder.py", "firmware/interrupts.py"

_CRC_ROUND = """\
            # Two bytes a round, or half of the time goes into the loop.
            crc = memory[CRC_TABLE + (crc ^ source[at])] ^ source[at + 1]
            crc = memory[CRC_TABLE + crc]
            at += 2
"""
_CRC_LOOP = "        while at < stop:\n" + _CRC_ROUND
_CRC_ODD = """\
        if (stop - at) & 1:
            crc = memory[CRC_TABLE + source[at]]
            at += 1
"""

_ROLLED = """\
            crc = memory[CRC_TABLE + (crc ^ source[at])]
            at += 1
"""
_TWO_BYTES = """\
            crc = memory[CRC_TABLE + (crc ^ source[at + {0}])] ^ source[at + {0} + 1]
            crc = memory[CRC_TABLE + crc]
"""
_UNROLLED = (
    "        if stop - at == 10:\n"
    + "".join(_TWO_BYTES.format(at) for at in range(0, 10, 2))
    + "            at = stop\n"
    + _CRC_LOOP
)

_NIBBLE = """\
            crc = crc ^ source[at]
            crc = ((crc << 4) & 0xFF) ^ memory[784 + (crc >> 4)]
            crc = ((crc << 4) & 0xFF) ^ memory[784 + (crc >> 4)]
            at += 1
"""
_NIBBLE_TABLE = """\
    index = 0
    while index < 16:
        crc = index << 4
        bit = 0
        while bit < 4:
            crc = crc << 1
            if crc & 0x100:
                crc = crc ^ 0x1D5
            bit += 1
        memory[784 + index] = crc
        index += 1


@micropython.viper
def scan("""

_THUMB = """\
@micropython.asm_thumb
def crc_thumb(r0, r1, r2):
    mov(r3, 0)
    b(TEST)
    label(BYTE)
    ldrb(r4, [r1, 0])
    eor(r3, r4)
    add(r4, r0, r3)
    ldrb(r3, [r4, 0])
    add(r1, 1)
    label(TEST)
    cmp(r1, r2)
    bne(BYTE)
    mov(r0, r3)


@micropython.viper
def scan("""
_THUMB_CALL = (
    "        crc = int(crc_thumb(int(memory) + 256, int(source) + at, int(source) + stop))\n"
)

# What makes room where the branches would reach too far, 2 kB: nothing that a control frame needs.
_CRC_OF_A_BUFFER = (
    (
        """\
        if words[CRC_ONLY]:
            source = channels
            at = tail
            stop = words[HEAD]
        else:
""",
        "        if True:\n",
    ),
    ("        if words[CRC_ONLY]:\n            return crc\n", ""),
)
_MSP = (
    (
        """\
        elif length == 12 and uint(kind - 0x21) < uint(2):
            counter = MSP_FRAMES
            kept = MSP_QUEUE | ((words[MSP_FRAMES] & (MSP_QUEUE_LENGTH - 1)) << 4)
""",
        "",
    ),
)
_ROOM = _CRC_OF_A_BUFFER + _MSP

_SCAN = "@micropython.viper\ndef scan("


def inlined(rig: Rig, room: Sequence[Change] = _ROOM) -> Sequence[Change]:
    """What puts the decoder's text into the frame interrupt, changed by `room`."""
    text = rig.sources[_DECODER].read_text(encoding="utf-8")
    names = re.findall(r"^([A-Z_]+) = const\((.*)\)", text, re.MULTILINE)
    start = text.index("    words = ptr32(memory)\n", text.index("def scan("))
    body = text[start : text.index("    return controls\n", start)]
    for old, new in room:
        body = body.replace(old, new)
    constants = ""
    for name, value in names:
        body = re.sub(rf"(?<!\w){name}\b", f"D{name}", body)
        constants += f"D{name} = const({value})\n"
    for name, _ in names:
        constants = re.sub(rf"(?<=[( ]){name}\b", f"D{name}", constants)
    lines = "".join(f"    {line}\n" if line else "\n" for line in body.splitlines())
    call = "        controls = int(scan(c[MEMORY], c[PULSES]))\n"
    memory = "        memory = ptr8(c[MEMORY])\n        channels = ptr8(c[PULSES])\n"
    return (
        ("SENT_FLAG = const(16)\n", f"{constants}SENT_FLAG = const(16)\n"),
        (call, memory + lines),
    )


def others(rig: Rig) -> dict[str, dict[str, Sequence[Change]]]:
    return {
        "as it is": {},
        "CRC: one byte a round": {_DECODER: ((_CRC_ROUND, _ROLLED),)},
        "CRC: ten bytes without a loop (1)": {_DECODER: (*_ROOM, (_CRC_LOOP, _UNROLLED))},
        "CRC: table of 16 nibbles": {
            _DECODER: (
                ("MEMORY_SIZE = const(784)", "MEMORY_SIZE = const(800)"),
                (f"\n\n{_SCAN}", _NIBBLE_TABLE),
                (_CRC_ODD, ""),
                (_CRC_ROUND, _NIBBLE),
            )
        },
        "CRC: assembler, called by the decoder": {
            _DECODER: ((_SCAN, _THUMB), (_CRC_ODD + _CRC_LOOP, _THUMB_CALL))
        },
        "decoder within the handler (1)": {_INTERRUPTS: inlined(rig)},
        "decoder within the handler, with MSP": {_INTERRUPTS: inlined(rig, _CRC_OF_A_BUFFER)},
        **ECHO_WAYS,
    }


def _measured(
    rig: Rig, effort: Effort, name: str, changes: dict[str, Sequence[Change]]
) -> tuple[tuple[str, ...], float | None]:
    """The row of one of them, and its share of the CPU if its echo is measured."""
    try:
        variant = rig.variant(changes) if changes else rig
    except GhstError as error:
        # What the compiler says stands behind the name of the file.
        return (name, str(error).rpartition(": ")[2], *4 * ("",)), None
    found, lost = latencies_us(variant.asleep, effort.variant_frames)
    if lost:
        raise AssertionError(f"{name}: {lost} frames lost")
    spread = Spread.of(found)
    echo = taken = ""
    percent = None
    if not changes or name in ECHO_WAYS:
        cycles, percent = cost(variant, effort)
        echo, taken = f"{cycles}", f"{percent:.2f} %"
    more = f"{_size(variant) - _size(rig):+d}" if changes else ""
    row = (name, f"{spread.mean:.2f}", f"{spread.maximum:.2f}", echo, taken, more)
    return row, percent


def variants(rig: Rig, effort: Effort, findings: Findings) -> tuple[Table, ...]:
    """How late the registers are with each of them, and what an echo costs."""
    ways = others(rig)
    rows = []
    with ProcessPoolExecutor(mp_context=get_context("fork")) as pool:
        for row, percent in pool.map(partial(_measured, rig, effort), ways, ways.values()):
            rows.append(row)
            if percent is not None and row[0] in ECHO_WAYS:
                findings.ways_percent[row[0]] = percent
    table = Table(
        "Other ways that were tried",
        "Last stop bit to last compare register, in microseconds, with an idle main loop and "
        f"{effort.variant_frames} frames; for the ways to take our echo, the CPU cycles of its "
        f"interrupt, and the share of the CPU at {SHARE_HZ} Hz with telemetry behind each frame, "
        "measured as it is below; and what the .mpy files of decoder and interrupts grow "
        "by, in bytes. Each change is made to the text of the firmware in "
        "tools/ghst_tools/bench (variants.py, echo.py) and put on a board of its own. A function "
        "of viper is too big where a branch in it would reach farther than 2 kB. (1): without MSP "
        "and without the CRC of a buffer, to make room. Length and CRC byte only: a damaged echo "
        "whose CRC byte is right is taken for a whole one and its collision not counted, which a "
        "test forbids. Why none of them is flown: design.md.",
        ("control path", "mean", "max", "echo, cycles", "share", "bytes more"),
        tuple(rows),
    )
    return (table,)


def _size(rig: Rig) -> int:
    return sum(
        len(rig.files[f"/lib/{name.removesuffix('.py')}.mpy"]) for name in (_DECODER, _INTERRUPTS)
    )
