"""How long a state machine of the PIO runs before anybody outside can see what it does.

Shifting bits in, counting and jumping change nothing but the machine's own registers, and whoever
looks at those, or changes a pin, first brings the block up to the present. So the block need not
be woken for each such instruction: it runs them later, in one go, as if each had run at its time.

What is not known to be quiet counts as seen. Too early a look costs time and nothing else.
Source: RP2040 datasheet, section 3.4 (instruction set).
"""

from __future__ import annotations

from typing import Any

_JMP, _IN, _PUSH_PULL, _MOV, _SET = 0b000, 0b010, 0b100, 0b101, 0b111
_PULL_IF_THERE_IS = 0x80  # pull(noblock): without a word it is mov(osr, x)
_X, _Y, _ISR, _OSR = 1, 2, 6, 7  # destinations
_AUTOPUSH, _AUTOPULL = 1 << 16, 1 << 17
_SIDE_OPTIONAL = 1 << 30
_LONGEST = 40  # instructions
_MANY = _LONGEST + 1  # no counter that stands here runs out within them

_Key = tuple[int, int, bool, int, int, int, bool]


class Quiet:
    """Knows for the state machines of one block how long they will not be seen."""

    def __init__(self, mcu: Any, block: Any) -> None:
        self._gpio = mcu.gpio
        self._block = block
        # By what it depends on: cycles of the machine, and side-set of the instructions.
        self._runs: dict[_Key, tuple[int, int]] = {}

    def forget(self) -> None:
        """A program or a setting may have changed."""
        self._runs.clear()

    def cycles(self, machine: Any) -> int:
        """Cycles of `machine` from its next instruction to the first that may be seen."""
        x, y = machine.x, machine.y
        key = (
            machine.index,
            machine.pc,
            self._gpio[machine.jmp_pin].input_value,
            x if x < _MANY else _MANY,
            y if y < _MANY else _MANY,
            machine.input_shift_count,
            machine.tx_fifo.empty,
        )
        try:
            cycles, side = self._runs[key]
        except KeyError:
            cycles, side = self._runs[key] = self._walk(machine, *key[2:])
        if cycles and not side_set_stays(self._block, machine, side):
            return 0
        return cycles

    def _walk(
        self,
        machine: Any,
        level: bool,
        x: int | None,
        y: int | None,
        shifted_in: int,
        tx_empty: bool,
    ) -> tuple[int, int]:
        side_bits = machine.sideset_count
        if side_bits > 1 or machine.exec_ctrl & _SIDE_OPTIONAL:
            return 0, 0
        delay_bits = 5 - side_bits
        instructions = self._block.instructions
        settings = machine.shift_ctrl
        pc, cycles = machine.pc, 0
        first_side = instructions[pc] >> 8 + delay_bits & side_bits
        for _ in range(_LONGEST):
            opcode = instructions[pc]
            kind, what, data = opcode >> 13, opcode >> 5 & 7, opcode & 0x1F
            if opcode >> 8 + delay_bits & side_bits != first_side:
                break
            taken: bool | None = False
            if kind == _JMP:
                taken, x, y = _jump(what, level, x, y)
                if taken is None:
                    break
            elif kind == _IN:
                shifted_in = min(shifted_in + (data or 32), 32)
                if settings & _AUTOPUSH and shifted_in >= machine.push_threshold:
                    break
            elif kind == _PUSH_PULL:
                if opcode & 0xFF != _PULL_IF_THERE_IS or not tx_empty or settings & _AUTOPULL:
                    break
            elif kind == _MOV and what in (_X, _Y, _ISR, _OSR):
                if opcode & 0x1F != what:  # not nop(): what it makes of x or y is not followed
                    x = None if what == _X else x
                    y = None if what == _Y else y
                shifted_in = 0 if what == _ISR else shifted_in
            elif kind == _SET and what == _X:
                x = data
            elif kind == _SET and what == _Y:
                y = data
            else:
                break
            cycles += 1 + (opcode >> 8 & (1 << delay_bits) - 1)
            if taken:
                pc = data
            elif pc == machine.wrap_top:
                pc = machine.wrap_bottom
            else:
                pc = pc + 1 & 0x1F
        return cycles, first_side


def _jump(
    condition: int, level: bool, x: int | None, y: int | None
) -> tuple[bool | None, int | None, int | None]:
    """Whether the jump is taken (None: not known), and x and y behind it."""
    if condition == 0:
        return True, x, y
    if condition == 6:
        return level, x, y
    if condition in (1, 2) and x is not None:
        if condition == 1:
            return x == 0, x, y
        return x != 0, x - 1 if x else None, y
    if condition in (3, 4) and y is not None:
        if condition == 3:
            return y == 0, x, y
        return y != 0, x, y - 1 if y else None
    return None, x, y


def side_set_stays(block: Any, machine: Any, side: int) -> bool:
    """Whether the pins show already what a side-set of one bit would make of them."""
    if not machine.sideset_count:
        return True
    pins = block.pin_directions if machine.exec_ctrl >> 29 & 1 else block.pin_values
    return bool(pins >> machine.sideset_base & 1 == side)
