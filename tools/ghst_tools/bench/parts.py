"""What the parts of the frame interrupt cost, instruction by instruction."""

from __future__ import annotations

from ghst import encode  # type: ignore[import-not-found]
from ghst_tools.bench.figures import Table
from ghst_tools.bench.interrupts import FRAME_EXCEPTION, exception_ns
from ghst_tools.bench.rig import CLOCK_HZ, Rig, Running
from ghst_tools.demo.probes import decoder_memory

_FRAME = encode.channels(0x30, (48, 4048, 1048, 3048), (3, 253, 64, 192))
_LEAD_NS = 1e6
_CYCLE_NS = 1e9 / CLOCK_HZ
_RAM = 0x20000000
_CRC_TABLE = range(256, 512)  # in the decoder's memory
_PWM = range(0x40050000, 0x40051000)
_SLICES = 4

# The decoder without scaling: what it saves is what scaling costs.
_UNSCALED = (
    ("(((crc & 0xFFF) * scale) >> 2) + base", "crc & 0xFFF"),
    ("(((crc >> 12) * scale) >> 2) + base", "crc >> 12"),
    ("memory[stop] * scale + base", "memory[stop]"),
    ("memory[stop + 1] * scale + base", "memory[stop + 1]"),
    ("memory[stop + 2] * scale + base", "memory[stop + 2]"),
    ("memory[stop + 3] * scale + base", "memory[stop + 3]"),
)


def _marks(running: Running) -> dict[str, list[int]]:
    """Cycles since the exception at which the interrupt does what tells its parts apart."""
    board, core = running.board, running.board.mcu.core
    memory = decoder_memory(board)
    assert memory is not None
    table = range(memory + _CRC_TABLE.start, memory + _CRC_TABLE.stop)
    end_ns = running.wire.send(_FRAME, board.now_ns + _LEAD_NS)
    running.run_until(end_ns - 2e3)
    exception_ns(running, FRAME_EXCEPTION, 100e3)
    first = board.cycles
    marks: dict[str, list[int]] = {"handler": [], "crc": [], "pulse": [], "compare": []}
    while core.ipsr == FRAME_EXCEPTION:
        kind = ""
        if core.pc >= _RAM:
            if not marks["handler"]:
                marks["handler"].append(board.cycles - first)
            opcode = board.mcu.read_uint16(core.pc)
            base = core.registers[opcode >> 3 & 7] & 0xFFFFFFFF
            # Viper adds index to address first.
            if opcode & 0xFFC0 == 0x7800 and base in table:
                kind = "crc"  # ldrb
            elif opcode & 0xFFC0 == 0x8000:
                kind = "pulse"  # strh
            elif opcode & 0xFFC0 == 0x6000 and base in _PWM:
                kind = "compare"  # str
        board.run_for(_CYCLE_NS)
        if kind:
            marks[kind].append(board.cycles - first)
    marks["end"] = [board.cycles - first]
    return marks


def parts(rig: Rig) -> tuple[Table, ...]:
    """What each part of the interrupt of one frame costs."""
    running = rig.asleep
    marks = _marks(running)
    crc, pulse, compare = marks["crc"], marks["pulse"], marks["compare"]
    if len(pulse) != 8 or len(compare) != _SLICES:
        raise AssertionError(f"{len(pulse)} pulses and {len(compare)} compare registers written")
    a_slice = (compare[-1] - compare[0]) / (_SLICES - 1)
    to_table = compare[-1] - round(_SLICES * a_slice)
    unscaled = rig.variant({"ghst/decoder.py": _UNSCALED})
    other = _marks(unscaled.asleep)
    unpacking = other["pulse"][-1] - other["crc"][-1]
    rows = (
        ("MicroPython: from the exception to the handler", marks["handler"][0]),
        ("handler, call of the decoder, header", crc[0] - marks["handler"][0]),
        ("CRC of 11 bytes", crc[-1] - crc[0]),
        ("unpacking 4 x 12 and 4 x 8 bits", unpacking),
        ("scaling 8 channels", pulse[-1] - crc[-1] - unpacking),
        ("counters, return to the handler", to_table - pulse[-1]),
        ("PWM: limits, product, 4 compare registers", compare[-1] - to_table),
        ("behind the last compare register", marks["end"][0] - compare[-1]),
        ("the whole interrupt", marks["end"][0]),
    )
    table = Table(
        "Parts of the frame interrupt",
        f"One frame of type 0x{_FRAME[2]:02x}, run instruction by instruction: the CRC lasts from "
        "the first to the last access to its table, unpacking to the last pulse written, the PWM "
        "part is four times what lies between two compare registers. Scaling stands in the same "
        "expressions as unpacking, which is measured alone in a decoder of the same text without "
        "the products and sums.",
        ("part", "cycles", "us at 125 MHz"),
        tuple((name, f"{count}", f"{count * 1e6 / CLOCK_HZ:.2f}") for name, count in rows),
    )
    return (table,)
