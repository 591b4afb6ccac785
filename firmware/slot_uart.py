# only on rp2
"""The telemetry slot on a UART: a state machine that waits for 1 ms of quiet and tells the CPU.

It follows the line by itself, as the one in `slot_pio` does, and so the slot is where it is
however late the interrupts of the UART are. It cannot send: its interrupt lets the UART do that,
if the line is quiet still and the control frame was the last thing on it. A second one tells when
TX is to be released.
"""

from array import array

import machine
import rp2
import uctypes
from machine import Pin
from micropython import const
from rp2 import asm_pio

from firmware import chip
from firmware import uart_interrupts as word
from firmware.interrupts import SENT_FLAG

_CYCLES_PER_BIT = const(16)
# Two cycles each: 8 a bit, so 8000 * baud rate / 1e6 are 1000 us. The wait begins 9.4 bits behind
# the last start bit; the interrupt and `UART.write` take some microseconds.
_LOOPS_PER_BAUD = const(125)  # baud rate divided by this
_MORE_LOOPS = const(1)
_FRAME_BYTES = const(14)
_WAIT_LOW = const(0x2020)  # wait(0, pin, 0)
_CLOCK_HZ = const(1_000_000)


# fmt: off
# ruff: noqa: F821 - the words of asm_pio and of viper
@asm_pio()
def _watch():
    # isr: loops of the quiet time.
    label("restart")
    mov(x, isr)
    label("quiet")
    jmp(pin, "high")
    label("low")
    set(y, 6)          [6]
    jmp(pin, "dead")            # not low in the middle of the start bit: a glitch
    label("byte")
    nop()              [9]
    jmp(y_dec, "byte") [9]
    jmp("restart")              # the stop bit has begun
    label("high")
    jmp(x_dec, "quiet")
    irq(rel(0))
    wait(0, pin, 0)             # parked: the slot is open while it is at this address
    jmp("low")
    label("dead")
    wait(0, pin, 0)
    jmp("low")


@asm_pio()
def _count():
    pull(block)
    mov(x, osr)
    label("wait")
    jmp(x_dec, "wait")
    irq(rel(0))
# fmt: on


class UartSlot:
    """Sends one frame by the UART of a `UartWire` in the slot that the frame interrupt opens.

    The attributes are those of `PioSlot`: `frame`, the 14 bytes that go out; `words`, one that is
    written to `fifo_register` to open the slot; flag 4 of `sent_register`.
    """

    def __init__(self, wire, *, baud_rate=420_000, state_machine=0):
        """`wire`: a `UartWire`; `state_machine`: any but 3 and 7; the next one is taken, too.

        They have to be in the PIO block whose interrupt `wire` raises: it is the one above all.
        """
        self._wire = wire
        self.frame = bytearray(_FRAME_BYTES)
        self.words = array("I", [1])
        words = wire.words
        address = uctypes.addressof(words)
        self.fifo_register = address + 4 * word.OPEN
        self.sent_register = wire.sent_register
        pin = Pin(wire.pin)
        self._watch = rp2.StateMachine(
            state_machine, _watch, freq=_CYCLES_PER_BIT * baud_rate, in_base=pin, jmp_pin=pin
        )
        self._watch.put(baud_rate // _LOOPS_PER_BAUD + _MORE_LOOPS)
        self._watch.exec("pull()")
        self._watch.exec("mov(isr, osr)")
        self._count = rp2.StateMachine(state_machine + 1, _count, freq=_CLOCK_HZ)
        block, index = divmod(state_machine, 4)
        self._block = rp2.PIO(block)
        registers = chip.PIO[block] + chip.PIO_MACHINE_SIZE * index
        first = machine.mem32[registers + chip.PIO_EXECCTRL] >> 7 & 31
        parked = [at for at, opcode in enumerate(_watch[0]) if opcode == _WAIT_LOW]
        words[word.ADDRESS_REGISTER] = registers + chip.PIO_ADDRESS
        words[word.OPEN_ADDRESS] = (first + parked[0]) & 31
        words[word.COUNT_FIFO] = chip.PIO[block] + chip.PIO_SEND_FIFO + 4 * (index + 1)
        self._on_slot = word.slot_handler(address, wire.uart.write, self.frame)
        self._on_sent = word.sent_handler(address)

    def start(self):
        """Begins to follow the line."""
        machine.mem32[self.sent_register] = SENT_FLAG
        self._watch.irq(self._on_slot, hard=True)
        self._count.irq(self._on_sent, hard=True)
        self._watch.active(1)
        self._count.active(1)

    def stop(self):
        """Stops, in the middle of a frame if need be, and releases the wire."""
        self._watch.active(0)
        self._count.active(0)
        self._watch.irq(None)
        self._count.irq(None)
        machine.mem32[self._wire.words[word.TX_CONTROL]] = chip.GPIO_RELEASED
        # Beside them the program of `PioWire` has no room.
        self._block.remove_program(_watch)
        self._block.remove_program(_count)

    def fill(self, frame):
        """Takes the 14 bytes of `frame` for the next slot; not while the last are waiting."""
        if len(frame) != _FRAME_BYTES:
            raise ValueError(f"a telemetry frame has 14 bytes, not {len(frame)}")
        for index in range(_FRAME_BYTES):  # a slice would allocate
            self.frame[index] = frame[index]
