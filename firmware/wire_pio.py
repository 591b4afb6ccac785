# only on rp2
"""The Ghost wire on one pin: a PIO program receives, DMA fills the ring that the decoder reads.

The interrupt comes behind every 14th byte of a burst, which is the last byte of a frame unless
something stood before it, and again when a burst breaks off: 150 us without a start bit while
bytes are unaccounted for. Nothing polls, and a burst cannot overrun: DMA empties the FIFO whatever
the CPU does.
"""

from array import array

import machine
import rp2
import uctypes
from rp2 import PIO, asm_pio

from firmware import chip
from ghst.decoder import MEMORY_SIZE, RING, RING_SIZE

_CYCLES_PER_BIT = 16
# Bytes of one frame may be 100 us apart.
_GAP_US = 150
_WAIT_LOW = 0x2020  # wait(0, pin, 0)


# fmt: off
# ruff: noqa: F821
@asm_pio(in_shiftdir=PIO.SHIFT_RIGHT, autopush=True, push_thresh=8)
def _receive():
    # y: bytes left until the interrupt, minus one. osr: loops of a gap.
    set(y, 13)
    wait(0, pin, 0)             # parked between frames: no blind spot before a start bit
    label("idle")
    jmp(pin, "high")
    mov(x, osr)       [5]
    jmp(pin, "idle")            # not low in the middle of the start bit: a glitch
    nop()             [13]
    in_(pins, 1)      [15]
    in_(pins, 1)      [15]
    in_(pins, 1)      [15]
    in_(pins, 1)      [15]
    in_(pins, 1)      [15]
    in_(pins, 1)      [15]
    in_(pins, 1)      [15]
    in_(pins, 1)      [15]
    jmp(pin, "stop")
    wait(1, pin, 0)             # no stop bit: a break, or out of step; the line must rise first
    jmp("gap")
    label("high")
    jmp(x_dec, "idle")
    label("gap")
    irq(rel(0))
    set(y, 13)
    wait(0, pin, 0)             # parked behind a gap: the interrupt knows it by this address
    jmp("idle")
    label("stop")
    jmp(y_dec, "idle")
    irq(rel(0))
# fmt: on


class PioWire:
    """Receives the Ghost wire into a ring by PIO and DMA.

    `memory` is for `ghst.Receiver(memory)`. `write_register`, `address_register` and
    `gap_address` are what the interrupt needs: where DMA will write next, and whether the line has
    gone quiet in the middle of a frame. `interrupt` is the number of the interrupt,
    `force_interrupt`, a register and a bit, raises it. `enabled` are registers and bits that must
    stay set.
    """

    def __init__(self, pin, *, baud_rate=420_000, inverted=False, state_machine=0):
        """`pin`: GPIO number; `state_machine`: 0..7 (rp2 numbering), any free one.

        `inverted`: whether the line is low while nobody talks.
        """
        # At 420 kBd, 415 are the middle of the 400..430 that receivers send at, so that the stop
        # bit is still hit at either end.
        baud_rate = baud_rate * 83 // 84
        self._chip = chip.this_chip()
        block, index = divmod(state_machine, 4)
        self._block = rp2.PIO(block)
        self._dreq = 8 * block + 4 + index
        self._release_stale_channels()
        # DMA wraps on an address that is a multiple of the ring's size.
        self._memory = bytearray(MEMORY_SIZE + RING_SIZE)
        address = (uctypes.addressof(self._memory) + RING_SIZE - 1) & ~(RING_SIZE - 1)
        self.memory = uctypes.bytearray_at(address, MEMORY_SIZE)
        pull = machine.Pin.PULL_DOWN if inverted else machine.Pin.PULL_UP
        number, pin = pin, machine.Pin(pin, machine.Pin.IN, pull)
        self._machine = rp2.StateMachine(
            state_machine,
            _receive,
            freq=_CYCLES_PER_BIT * baud_rate,
            in_base=pin,
            jmp_pin=pin,
        )
        if inverted:
            chip.invert(number)
        # The idle loop takes two cycles.
        self._machine.put(_GAP_US * _CYCLES_PER_BIT * baud_rate // 1_000_000 // 2)
        self._machine.exec("pull()")
        registers = chip.PIO[block] + chip.PIO_MACHINE_SIZE * index
        first = machine.mem32[registers + chip.PIO_EXECCTRL] >> 7 & 31
        parked = [at for at, word in enumerate(_receive[0]) if word == _WAIT_LOW]
        self.address_register = registers + chip.PIO_ADDRESS
        self.gap_address = (first + parked[1]) & 31
        self.enabled = ((chip.PIO[block], 1 << index),)
        self.interrupt = self._chip.PIO_INTERRUPT + 2 * block
        self.force_interrupt = (chip.PIO[block] + chip.PIO_IRQ_FORCE, 1 << index)
        self._start_dma(address + RING, chip.PIO[block] + chip.PIO_FIFO + 4 * index)

    def _release_stale_channels(self):
        # A soft reset leaves DMA channels running: one that still waits for this state machine
        # would write into memory that now belongs to somebody else.
        for channel in range(self._chip.DMA_CHANNELS):
            request = rp2.DMA.unpack_ctrl(machine.mem32[_control(channel)])
            if request["treq_sel"] == self._dreq and request["enable"]:
                self._abort((channel,))

    def _abort(self, channels):
        # Disabled and chained to nothing first, or an abort starts the next channel (errata
        # RP2040-E13, RP2350-E5).
        for channel in channels:
            machine.mem32[_control(channel)] = channel << self._chip.DMA_CHAIN_TO
        for channel in channels:
            machine.mem32[self._chip.DMA_ABORT] = 1 << channel
            while machine.mem32[_control(channel)] & self._chip.DMA_BUSY:
                pass

    def _start_dma(self, address, fifo):
        self._data = rp2.DMA()
        self._reload = rp2.DMA()
        self._numbers = (self._data.channel, self._reload.channel)
        self._abort(self._numbers)
        registers = chip.DMA + self._data.channel * chip.DMA_CHANNEL_SIZE
        self.write_register = registers + chip.DMA_WRITE_ADDRESS
        self.enabled += ((registers + chip.DMA_CONTROL, self._chip.DMA_BUSY | chip.DMA_ENABLE),)
        # A transfer count runs out one day. The second channel then writes it anew, which starts
        # the first one again where it stopped.
        self._count = array("I", [1 << 14])
        self._reload.config(
            read=self._count,
            write=registers + chip.DMA_COUNT_TRIGGER,
            count=1,
            # Every field that RP2350 has elsewhere is named: the defaults of MicroPython 1.25 put
            # them where the RP2040 has them.
            ctrl=self._reload.pack_ctrl(
                inc_read=False,
                inc_write=False,
                ring_sel=False,
                ring_size=0,
                chain_to=self._reload.channel,
            ),
        )
        self._data.config(
            read=fifo + 3,  # shifted in from the left: the byte is the top one of the word
            write=address,
            count=self._count[0],
            ctrl=self._data.pack_ctrl(
                size=0,
                inc_read=False,
                ring_sel=True,
                ring_size=8,
                treq_sel=self._dreq,
                chain_to=self._reload.channel,
                high_pri=True,
            ),
            trigger=True,
        )

    def start(self, handler):
        """Calls `handler(state_machine)` in a hard interrupt behind each frame or gap."""
        self._machine.irq(handler, hard=True)
        self._machine.active(1)

    def stop(self):
        """Stops receiving and gives the state machine and both DMA channels back."""
        self._machine.active(0)
        self._machine.irq(None)
        self._block.remove_program(_receive)  # it fills the block's memory
        self._abort(self._numbers)
        self._data.close()
        self._reload.close()


def _control(channel):
    return chip.DMA + channel * chip.DMA_CHANNEL_SIZE + chip.DMA_CONTROL
