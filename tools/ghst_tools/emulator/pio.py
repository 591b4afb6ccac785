"""PIO, exactly in time: the repair of rp2040py defects 3, 4 and 5.

rp2040py 0.3.6 runs at most one PIO instruction per CPU instruction and writes off what it could
not run, so PIO loses time whenever the CPU sleeps or an instruction takes long. Here a clock
alarm runs each state machine at the very cycle it does something, and every access from outside (a
register, an input pin) first brings the block up to the present.

Also repaired:

* `SHIFTCTRL.FJOIN` is honoured: eight entries one way, none the other, both FIFOs cleared.
* `pull(ifempty)` and `push(iffull)` obey their condition without autopull or autopush, too.
* An instruction forced through `SMx_INSTR` replaces the one the state machine is stalled in; the
  stalled one is tried again afterwards, from wherever the program counter then stands.

A loop that only counts down (`Countdowns`) is not run step by step: its rounds are taken off its
counter when somebody looks, which gives the same state at the same cycle. Nor is the block woken
for instructions that nobody can see (`Quiet`): they run at its next look, in one go.

Not modelled: the two-cycle input synchroniser (a state machine sees a pin 16 ns too early).
Source: RP2040 datasheet, chapter 3.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

from rp2040py.irq import IRQ
from rp2040py.peripherals.pio import RPPIO
from rp2040py.peripherals.pio_registers import WaitType
from rp2040py.utils.fifo import FIFO

from ghst_tools.emulator.pio_countdown import Countdowns

_CYCLE_NS = 8.0
_CTRL = 0x000
_INSTR_MEM, _INSTR_MEM_END = 0x048, 0x0C8
_SM_FIRST, _SM_STRIDE, _SM_END = 0x0C8, 0x18, 0x128
_SHIFTCTRL, _INSTR = 0x08, 0x10
_AUTOPUSH, _AUTOPULL = 1 << 16, 1 << 17
_TX_DEPTH = (4, 8, 0, 0)  # by FJOIN: none, TX, RX, both
_RX_DEPTH = (4, 0, 8, 0)
_NOP = 0xA042  # mov(y, y)
# Longest time between two looks at a block in which nothing is due; NEVER_DUE would overflow.
_FAR = 1 << 40


class Pio(RPPIO):  # type: ignore[misc]
    """One PIO block that runs by clock alarms of its own."""

    def __init__(self, mcu: Any, name: str, first_irq: int, index: int) -> None:
        self._clock = mcu.clock
        self._alarm = self._clock.create_alarm(self._due)
        self._synced_ns = 0.0
        self.running = False
        self._busy = False
        self.enabled_machines: tuple[Any, ...] = ()
        self._conditional: dict[int, int] = {}  # program address -> push/pull with a condition
        self._countdowns = Countdowns(mcu, self)

    def catch_up(self) -> None:
        """Run everything that is due up to the present emulated time."""
        if not self.running or self._busy:
            return
        cycles = int((self._clock.nanos - self._synced_ns) / _CYCLE_NS + 1e-4)
        if cycles <= 0:
            return
        self._busy = True
        self._synced_ns += cycles * _CYCLE_NS
        target = self.cycle_fp + (cycles << 8)
        self._countdowns.skip(target)
        due = self.next_due_fp
        while due <= target:
            ahead = due - self.cycle_fp
            patched = self._suppress_conditional(due) if self._conditional else None
            self.advance((ahead + 255) >> 8 if ahead > 0 else 0)
            if patched:
                for address, opcode in patched.items():
                    self.instructions[address] = opcode
            due = self.next_due_fp
        self.cycle_fp = target
        self._busy = False

    def arm(self) -> None:
        """Set the alarm for the next instruction that is due and may be seen."""
        if not self.running or self._busy:
            return
        ahead = self._countdowns.next_due_fp() - self.cycle_fp
        if ahead > _FAR:
            self._alarm.cancel()
            return
        # What became due just now (a machine was enabled or woken) runs in the next cycle.
        cycles = (ahead + 255) >> 8 if ahead > 0 else 1
        self._alarm.schedule(self._synced_ns + cycles * _CYCLE_NS - self._clock.nanos)

    def _due(self) -> None:
        self.catch_up()
        self.arm()

    def read_uint32(self, offset: int) -> int:
        self.catch_up()
        value: int = super().read_uint32(offset)
        self.arm()
        return value

    def write_uint32_atomic(self, offset: int, value: int, atomic_type: int) -> None:
        self.catch_up()
        machine: Any = None
        register = -1
        if offset >= _INSTR_MEM:
            self._countdowns.forget()
        if _SM_FIRST <= offset < _SM_END:
            number, register = divmod(offset - _SM_FIRST, _SM_STRIDE)
            machine = self.machines[number]
        if register == _INSTR:
            self._force(machine, value & 0xFFFF)
        elif register == _SHIFTCTRL:
            joined = machine.shift_ctrl >> 30
            super().write_uint32_atomic(offset, value, atomic_type)
            if machine.shift_ctrl >> 30 != joined:
                self._join(machine)
        else:
            super().write_uint32_atomic(offset, value, atomic_type)
            if offset == _CTRL:
                self._set_running()
            elif _INSTR_MEM <= offset < _INSTR_MEM_END:
                self._note_conditional((offset - _INSTR_MEM) >> 2)
        self.arm()

    def reset(self) -> None:
        super().reset()
        for machine in self.machines:
            self._join(machine)
        self.running = False
        self.enabled_machines = ()
        self._conditional.clear()
        self._countdowns.forget()
        self._alarm.cancel()

    def _set_running(self) -> None:
        self.enabled_machines = tuple(machine for machine in self.machines if machine.enabled)
        running = bool(self.enabled_machines)
        if running and not self.running:
            self._synced_ns = self._clock.nanos
        self.running = running
        if not running:
            self._alarm.cancel()

    def _join(self, machine: Any) -> None:
        joined = machine.shift_ctrl >> 30
        machine.tx_fifo = FIFO(_TX_DEPTH[joined])
        machine.rx_fifo = FIFO(_RX_DEPTH[joined])
        dma = self.rp2040.dma
        dma.clear_dreq(machine.dreq_rx)
        (dma.set_dreq if _TX_DEPTH[joined] else dma.clear_dreq)(machine.dreq_tx)

    def _note_conditional(self, address: int) -> None:
        opcode = self.instructions[address]
        if opcode & 0xE05F == 0x8040:  # push(iffull) or pull(ifempty)
            self._conditional[address] = opcode
        else:
            self._conditional.pop(address, None)

    def _suppress_conditional(self, due: int) -> dict[int, int]:
        """Turn conditional pushes and pulls that must do nothing now into plain delays."""
        patched: dict[int, int] = {}
        for machine in self.enabled_machines:
            opcode = self._conditional.get(machine.pc)
            if opcode is None or machine.waiting:
                continue
            if machine.next_due_fp <= due and _condition_false(machine, opcode):
                patched[machine.pc] = opcode
                self.instructions[machine.pc] = _NOP | opcode & 0x1F00
        return patched

    def _force(self, machine: Any, opcode: int) -> None:
        """Execute an instruction written to SMx_INSTR (datasheet 3.5.7)."""
        stalled = machine.waiting
        if stalled:
            if machine.wait_type == WaitType.OUT:
                machine.output_shift_count = 32  # the stalled autopull has not happened
            elif machine.wait_type == WaitType.RX_FIFO:
                machine.input_shift_reg = machine.wait_index
                machine.input_shift_count = machine.push_threshold
            machine.waiting = False
        if opcode & 0xE05F != 0x8040 or not _condition_false(machine, opcode):
            machine.execute_instruction(opcode)
        if stalled and not machine.waiting:
            machine.next_due_fp = self.cycle_fp + machine.div_fp
        self.recompute_due()
        self.check_changed_pins()


def _condition_false(machine: Any, opcode: int) -> bool:
    if opcode & 0x80:
        return bool(machine.output_shift_count < machine.pull_threshold)
    return bool(machine.input_shift_count < machine.push_threshold)


class _Blocks(tuple[Pio, ...]):
    """Both blocks, empty to those who walk them.

    rp2040py's pins walk the blocks to wake machines; `PioBlocks.input_changed` does that here.
    """

    def __iter__(self) -> Iterator[Pio]:
        return iter(())


class PioBlocks:
    """Both PIO blocks of the chip, and `by_index` what rp2040py's pins take for them.

    rp2040py walks the blocks of its chip after every CPU instruction to advance them. There is
    nothing for it to do here, so the chip has none, but while it is `in_reach` of them.
    """

    def __init__(self, mcu: Any) -> None:
        self._mcu = mcu
        self._blocks = (
            Pio(mcu, "PIO0", IRQ.PIO0_IRQ0, 0),
            Pio(mcu, "PIO1", IRQ.PIO1_IRQ0, 1),
        )
        self.by_index = _Blocks(self._blocks)
        mcu.pio = ()
        mcu.peripherals[0x50200], mcu.peripherals[0x50300] = self._blocks

    @contextlib.contextmanager
    def in_reach(self) -> Iterator[None]:
        """Let the chip find its blocks, to reset them."""
        self._mcu.pio = self.by_index
        yield
        self._mcu.pio = ()

    def catch_up(self) -> None:
        """Bring both blocks up to the present, before an input changes."""
        self._blocks[0].catch_up()
        self._blocks[1].catch_up()

    def input_changed(self, pin: int) -> None:
        """Wake the state machines that wait for `pin`, after it has changed."""
        for block in self._blocks:
            if not block.running:
                continue
            for machine in block.enabled_machines:
                waits = machine.waiting and machine.wait_type == WaitType.PIN
                if waits and machine.wait_index == pin:
                    machine.check_wait()
            block.arm()


def install(mcu: Any) -> PioBlocks:
    """Replace the PIO blocks of `mcu`; to be done before the chip runs."""
    return PioBlocks(mcu)
