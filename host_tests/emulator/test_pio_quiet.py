"""PIO programs of any kind, run when they are seen, against the same run step by step."""

import random
from collections import Counter

import pytest
from rp2040py.rp2040 import RP2040
from rp2040py.simulator import Simulator

from ghst_tools.emulator import pio, pwm
from ghst_tools.emulator.pins import Pin

CTRL, TXF0, RXF0, IRQ, INSTR_MEM, INTE0 = 0x000, 0x010, 0x020, 0x030, 0x048, 0x12C
SM0_CLKDIV, STRIDE = 0x0C8, 0x18
PINS = 8  # every other one is an output to begin with
FUNCTION_PIO0 = 6
# JMP, IN and MOV more often than what is seen at once.
KINDS = (0, 0, 0, 1, 2, 2, 2, 3, 4, 4, 5, 5, 5, 6, 7, 7)
PULL_NOBLOCK, NOP = 0x8080, 0xA042
DIVIDERS = (0x10000, 0x20000, 0x28000, 0x129A00)


def an_instruction(pick: random.Random) -> int:
    kind = pick.choice(KINDS)
    opcode = kind << 13 | pick.choice((0, 0, pick.getrandbits(5))) << 8 | pick.getrandbits(8)
    if kind == 1:  # wait for a pin that there is, or a flag
        return opcode & ~0x1F | pick.randrange(PINS)
    if kind == 4:
        return pick.choice((opcode & ~0x1F, PULL_NOBLOCK | opcode & 0x1F00))
    if kind == 6:
        return opcode & ~0x18
    executes = (kind == 3 and opcode >> 5 & 7 == 7) or (kind == 5 and opcode >> 5 & 7 == 4)
    return NOP if executes else opcode


class Bare:
    """A chip without a program but that of its PIO, and what can be seen of it."""

    def __init__(self, step_by_step: bool) -> None:
        self.mcu = RP2040()
        Simulator(rp2040=self.mcu)
        self.blocks = pio.install(self.mcu)
        pwm.install(self.mcu)
        self.block = self.blocks.by_index[0]
        self.seen: list[tuple[float, object, object]] = []
        self.pins = [Pin(self.mcu, self.blocks, number) for number in range(30)]
        for number in range(PINS):
            self.mcu.gpio[number].ctrl = FUNCTION_PIO0
            self.pins[number].watch(
                lambda t, level, n=number: self.seen.append((t, f"pin {n}", level))
            )
        # Every word that goes into a FIFO or out of it is told to DMA.
        self.mcu.dma.set_dreq = lambda dreq: self._note(f"DMA {dreq}", True)
        self.mcu.dma.clear_dreq = lambda dreq: self._note(f"DMA {dreq}", False)
        self._interrupts: dict[int, bool] = {}
        self.mcu.set_interrupt = self._interrupt
        self.wakings = 0
        due = self.block._due

        def count() -> None:
            self.wakings += 1
            due()

        self.block._alarm = self.mcu.clock.create_alarm(count)
        if step_by_step:
            self.block._countdowns._loop = lambda machine: None
            self.block._countdowns._quiet.cycles = lambda machine: 0

    def _interrupt(self, irq: int, value: bool) -> None:
        if self._interrupts.get(irq, False) is not value:
            self._interrupts[irq] = value
            self._note(f"interrupt {irq}", value)

    def _note(self, what: str, value: object) -> None:
        self.seen.append((self.mcu.clock.nanos, what, value))

    def write(self, offset: int, value: int) -> None:
        self.block.write_uint32_atomic(offset, value, 0)

    def look(self, offset: int) -> None:
        self._note(hex(offset), self.block.read_uint32(offset))

    def state(self) -> list[tuple[object, ...]]:
        self.blocks.catch_up()
        return [
            (
                *(m.enabled, m.waiting, m.pc, m.x, m.y, m.next_due_fp),
                *(m.input_shift_reg, m.input_shift_count, m.output_shift_reg),
                *(m.output_shift_count, m.rx_fifo.items, m.tx_fifo.items),
            )
            for m in self.block.machines
        ]


def act(chip: Bare, pick: random.Random) -> None:
    """What a CPU, its DMA and the world outside do to a block, at random."""
    choice, number = pick.randrange(8), pick.randrange(PINS)
    machine = pick.randrange(4)
    level = pick.choice((False, True, None))
    word = pick.getrandbits(32)
    if choice < 3:
        chip.pins[number].drive(level)
    elif choice == 3:
        chip.write(TXF0 + 4 * machine, word)
    elif choice == 4:
        chip.look(RXF0 + 4 * machine)
    elif choice == 5:
        chip.write(IRQ, word & 0xFF)
    elif choice == 6:
        chip.look(SM0_CLKDIV + STRIDE * machine + 0x0C)  # its address
    chip.mcu.clock.tick(pick.choice((8.0, 16.0, 40.0, 400.0, 3000.0)))


def set_up(chip: Bare, pick: random.Random) -> None:
    for address in range(32):
        chip.write(INSTR_MEM + 4 * address, an_instruction(pick))
    for machine in range(4):
        base = SM0_CLKDIV + STRIDE * machine
        chip.write(base, pick.choice(DIVIDERS))
        bottom = pick.randrange(28)
        wrap = pick.randrange(bottom + 1, 32) << 12 | bottom << 7
        side = pick.choice((0, 0, 1 << 29, 3 << 29, 1 << 30))
        chip.write(base + 0x04, side | pick.randrange(PINS) << 24 | wrap | pick.randrange(1, 4))
        chip.write(base + 0x08, pick.getrandbits(32) & ~(3 << 30))
        counts = (
            pick.choice((0, 1, 1, 2)) << 29 | pick.randrange(3) << 26 | pick.randrange(3) << 20
        )
        pins = sum(pick.randrange(PINS) << place for place in (0, 5, 10, 15))
        chip.write(base + 0x14, counts | pins)
    for pin in range(0, PINS, 2):
        chip.block.pin_directions |= 1 << pin
    chip.block.check_changed_pins()
    chip.write(INTE0, 0xFFF)
    chip.write(CTRL, pick.randrange(1, 16))


@pytest.mark.parametrize("part", range(2))
def test_nothing_outside_is_seen_earlier_or_later(part: int) -> None:
    wakings: Counter[bool] = Counter()
    events = 0
    for seed in range(100 * part, 100 * part + 100):
        chips = [Bare(step_by_step) for step_by_step in (False, True)]
        picks = [random.Random(seed) for _ in chips]
        for chip, pick in zip(chips, picks, strict=True):
            set_up(chip, pick)
        for step in range(40):
            for chip, pick in zip(chips, picks, strict=True):
                act(chip, pick)
            assert chips[0].seen == chips[1].seen, (seed, step)
            if step % 10 == 0:
                assert chips[0].state() == chips[1].state(), (seed, step)
        events += len(chips[0].seen)
        for lazy, chip in zip((True, False), chips, strict=True):
            wakings[lazy] += chip.wakings
    assert events > 4000
    assert wakings[True] < 0.9 * wakings[False]
