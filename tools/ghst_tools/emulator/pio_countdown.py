"""Loops of PIO programs that do nothing but count x down, skipped instead of run.

A loop counts down if it is made of jumps alone: over the level of a pin, always, and exactly one
`jmp(x_dec, ...)` that is taken, with the same side-set throughout, which is what the pins show
already. Until x is zero or an input pin changes nobody can see it run, and a pin never changes
before the block has caught up.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ghst_tools.emulator.pio_quiet import Quiet, side_set_stays

_ALWAYS, _X_DECREMENT, _PIN = 0, 2, 6
_LONGEST = 4  # instructions
_NEVER = 1 << 62


class _Loop(NamedTuple):
    """A countdown: cycles of the state machine a round, side-set of its instructions."""

    cycles: int
    side: int


class Countdowns:
    """Knows for the state machines of one block whether they count down."""

    def __init__(self, mcu: Any, block: Any) -> None:
        self._gpio = mcu.gpio
        self._block = block
        self._quiet = Quiet(mcu, block)
        # By machine, program counter and level of its jump pin.
        self._loops: dict[tuple[int, int, bool], _Loop | None] = {}

    def forget(self) -> None:
        """A program or a setting may have changed."""
        self._loops.clear()
        self._quiet.forget()

    def skip(self, target_fp: int) -> None:
        """Take off the rounds that are complete before `target_fp`, but for the last one."""
        skipped = False
        for machine in self._block.enabled_machines:
            loop = self._loop(machine)
            if loop is None:
                continue
            round_fp = loop.cycles * machine.div_fp
            rounds = min((target_fp - machine.next_due_fp) // round_fp, machine.x - 1)
            if rounds > 0:
                machine.x -= rounds
                machine.next_due_fp += rounds * round_fp
                skipped = True
        if skipped:
            self._block.recompute_due()

    def next_due_fp(self) -> int:
        """When something that may be seen has to be run next."""
        later = False
        earliest = _NEVER
        for machine in self._block.enabled_machines:
            if machine.waiting:
                continue
            loop = self._loop(machine)
            if loop is not None:
                cycles = (machine.x - 1) * loop.cycles
            else:
                cycles = self._quiet.cycles(machine)
            at = machine.next_due_fp
            if cycles:
                at += cycles * machine.div_fp
                later = True
            if at < earliest:
                earliest = at
        return int(earliest if later else self._block.next_due_fp)

    def _loop(self, machine: Any) -> _Loop | None:
        if machine.waiting or machine.x < 2:
            return None
        level = self._gpio[machine.jmp_pin].input_value
        key = (machine.index, machine.pc, level)
        try:
            loop = self._loops[key]
        except KeyError:
            loop = self._loops[key] = self._find(machine, level)
        if loop is None or not side_set_stays(self._block, machine, loop.side):
            return None
        return loop

    def _find(self, machine: Any, level: bool) -> _Loop | None:
        side_bits = machine.sideset_count
        if side_bits > 1 or machine.exec_ctrl >> 30 & 1:
            return None  # more pins, or optional
        delay_mask = (1 << (5 - side_bits)) - 1
        pc, cycles, counted, sides = machine.pc, 0, 0, set()
        for _ in range(_LONGEST):
            opcode = self._block.instructions[pc]
            condition = opcode >> 5 & 7
            if opcode >> 13 or condition not in (_ALWAYS, _X_DECREMENT, _PIN):
                return None
            field = opcode >> 8 & 0x1F
            cycles += 1 + (field & delay_mask)
            sides.add(field >> (5 - side_bits))
            counted += condition == _X_DECREMENT
            taken = level if condition == _PIN else True
            if taken:
                pc = opcode & 0x1F
            elif pc == machine.wrap_top:
                pc = machine.wrap_bottom
            else:
                pc = (pc + 1) & 0x1F
            if pc == machine.pc:
                return _Loop(cycles, sides.pop()) if counted == len(sides) == 1 else None
        return None
