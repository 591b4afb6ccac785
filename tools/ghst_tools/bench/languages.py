"""One algorithm, frame to CRC to eight pulses, in bytecode, native code, viper and C."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

from ghst import Receiver, crc8, encode  # type: ignore[import-not-found]
from ghst_tools import toolchain
from ghst_tools.bench.figures import Table
from ghst_tools.bench.rig import Rig
from ghst_tools.errors import GhstError
from ghst_tools.micropython_image import print_to_stderr

_SOURCE = Path(__file__).with_name("frame.c")
COMPILER = "arm-none-eabi-gcc"
_OPTIONS = ("-mcpu=cortex-m0plus", "-mthumb", "-O2", "-ffreestanding", "-nostdlib", "-Wall")
_CODE_BYTES = 512
_FRAME = encode.channels(0x30, (48, 4048, 1048, 3048), (3, 253, 64, 192))
_RETURN = 0x4770  # bx lr
_RUNS = 50

_DECODE = """
def {name}{arguments}:
    crc = 0
    at = 2
    while at < 13:
        crc = table[crc ^ frame[at]]
        at += 1
    if crc != frame[13]:
        return 0
    scale = 5
    base = 3520
    if frame[2] & 0x20:
        scale = 4
        base = 3952
    at = 0
    byte = 3
    while at < 4:
        bits = frame[byte] | (frame[byte + 1] << 8) | (frame[byte + 2] << 16)
        pulses[at] = (((bits & 0xFFF) * scale) >> 2) + base
        pulses[at + 1] = (((bits >> 12) * scale) >> 2) + base
        byte += 3
        at += 2
    scale = scale << 2
    while at < 8:
        pulses[at] = frame[byte] * scale + base
        at += 1
        byte += 1
    return 1
"""
_PLAIN = "(frame, table, pulses)"
_TYPED = "(frame: ptr8, table: ptr8, pulses: ptr16) -> int"

_PROGRAM = """
import micropython, time, uctypes
from array import array
table = bytes({table})
frame = bytes({frame})
pulses = array("H", [0] * 16)
{bytecode}
@micropython.native{native}
@micropython.viper{viper}
@micropython.asm_thumb
def in_c(r0, r1, r2, r3):
    data(2, 0x4798)  # blx r3
def no_bytecode(frame, table, pulses):
    return 0
@micropython.native
def no_native(frame, table, pulses):
    return 0
@micropython.viper
def no_viper(frame: ptr8, table: ptr8, pulses: ptr16) -> int:
    return 0
code = bytearray({code_bytes} + 8)
start = (uctypes.addressof(code) + 3) & ~3
print("code", start, "end")
def run(name, function, *arguments):
    for index in range(16):
        pulses[index] = 0
    begun = time.ticks_us()
    for again in range({runs}):
        function(*arguments)
    print(name, time.ticks_diff(time.ticks_us(), begun), *pulses[:8], "end")
def run_all():
    run("bytecode", in_bytecode, frame, table, pulses)
    run("native", in_native, frame, table, pulses)
    run("viper", in_viper, frame, table, pulses)
    addresses = [uctypes.addressof(each) for each in (frame, table, pulses)]
    run("c", in_c, *addresses, start | 1)
    run("no_bytecode", no_bytecode, frame, table, pulses)
    run("no_native", no_native, frame, table, pulses)
    run("no_viper", no_viper, frame, table, pulses)
    run("no_c", in_c, *addresses, start + {code_bytes} | 1)
print("measured")
go = bytearray(1)
print("go", uctypes.addressof(go), "end")
{ready}
while not go[0]:
    time.sleep_ms(1)
run_all()
print("languages measured")
time.sleep(60)
"""

_NAMES = {
    "bytecode": "bytecode",
    "native": "@micropython.native",
    "viper": "@micropython.viper",
    "c": f"C, {COMPILER} -O2",
}


def compiler_version() -> str:
    """Of the compiler of frame.c; GhstError if there is none and none can be installed."""
    toolchain.need(False, print_to_stderr)
    done = subprocess.run([COMPILER, "-dumpfullversion"], capture_output=True, text=True)
    return done.stdout.strip()


def compiled() -> bytes:
    """The machine code of frame.c; GhstError if there is no compiler and none can be installed."""
    toolchain.need(False, print_to_stderr)
    with tempfile.TemporaryDirectory() as name:
        elf, code = Path(name, "frame.elf"), Path(name, "frame.bin")
        commands: tuple[list[str | Path], ...] = (
            [COMPILER, *_OPTIONS, "-Wl,-Ttext=0,-e,decode", "-o", elf, _SOURCE],
            ["arm-none-eabi-objcopy", "-O", "binary", "-j", ".text", elf, code],
        )
        for command in commands:
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode:
                raise GhstError(f"{_SOURCE}: {(done.stderr.strip().splitlines() or ['?'])[-1]}")
        return code.read_bytes()


def languages(rig: Rig) -> tuple[Table, ...]:
    """How long a frame takes in each of them."""
    code = compiled()
    if len(code) > _CODE_BYTES:
        raise AssertionError(f"frame.c has {len(code)} bytes of code")
    running = rig.run(
        _PROGRAM.format(
            frame=list(_FRAME),
            table=[crc8(bytes([value]), 0, 1) for value in range(256)],
            bytecode=_DECODE.format(name="in_bytecode", arguments=_PLAIN),
            native=_DECODE.format(name="in_native", arguments=_PLAIN),
            viper=_DECODE.format(name="in_viper", arguments=_TYPED),
            code_bytes=_CODE_BYTES,
            runs=_RUNS,
            ready=rig.ready,
        )
    )
    board = running.board
    (start,) = running.numbers("code")
    for at in range(0, len(code), 4):
        board.write32(start + at, int.from_bytes(code[at : at + 4].ljust(4, b"\0"), "little"))
    board.write32(start + _CODE_BYTES, _RETURN)
    (go,) = running.numbers("go")
    board.write32(go, 1)
    board.run_until(lambda: b"languages measured" in board.console.output)
    receiver = Receiver()
    receiver.feed(_FRAME)
    rows = []
    for name, shown in _NAMES.items():
        taken, *pulses = running.numbers(name)
        if pulses != list(receiver.pulses[:8]):
            raise AssertionError(f"{shown} made {pulses} of a frame")
        us = (taken - running.numbers(f"no_{name}")[0]) / _RUNS
        rows.append((shown, f"{us:.2f}", f"{us * 125:.0f}", f"{taken / _RUNS:.2f}"))
    table = Table(
        "The same algorithm in four languages",
        f"From the 14 bytes of a frame to its CRC, by a table, and eight pulses, "
        f"straightforwardly: the same text as bytecode, native and viper, and "
        f"tools/ghst_tools/bench/frame.c ({len(code)} bytes of code, in RAM, called by its "
        f"address). Mean of {_RUNS} calls from MicroPython, less those of an empty function in "
        "the same language, and with them. The firmware's own decoder also searches the ring, "
        "counts, and keeps what is not channels.",
        ("language", "us", "cycles", "us with the call"),
        tuple(rows),
    )
    return (table,)
