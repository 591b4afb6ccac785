# only on rp2
"""The telemetry slot on the Ghost wire: a state machine that waits for 1 ms of quiet and sends.

It follows the line by itself. A start bit begins the wait anew and throws away what was to be
sent; the frame interrupt hands over a frame right behind a valid control frame. So a frame leaves
1000 us after that, or not at all: not behind other bytes, not behind a glitch, and not late.
"""

from array import array

import machine
import micropython
import rp2
from machine import Pin
from micropython import const
from rp2 import PIO, asm_pio

from firmware import chip
from firmware.interrupts import SENT_FLAG

_CYCLES_PER_BIT = const(16)
# Two cycles each: 8 a bit, so 8000 * baud rate / 1e6 are 1000 us. The wait begins 9.4 bits behind
# the last start bit, and the first bit is two loops behind its end: measured at the pin, the start
# bit falls 1000 us after the last stop bit with one loop more.
_LOOPS_PER_BAUD = const(125)  # baud rate divided by this
_MORE_LOOPS = const(1)
_FRAME_BYTES = const(14)
_WORDS = const(7)


# fmt: off
# ruff: noqa: F821 - the words of asm_pio and of viper
@asm_pio(
    out_init=PIO.IN_HIGH, set_init=PIO.IN_HIGH, sideset_init=PIO.IN_HIGH, side_pindir=True,
    out_shiftdir=PIO.SHIFT_RIGHT, pull_thresh=19, fifo_join=PIO.JOIN_TX,
)
def _send():
    # isr: loops of the quiet time. Side-set: whether the wire is driven.
    label("restart")
    mov(x, isr)                 .side(0)
    label("quiet")
    jmp(pin, "high")            .side(0)
    label("low")
    set(y, 6)                   .side(0)    [6]
    jmp(pin, "dead")            .side(0)    # not low in the middle of the start bit: a glitch
    label("drain")
    pull(noblock)               .side(0)    [9]
    jmp(y_dec, "drain")         .side(0)    [9]
    jmp("restart")              .side(0)    # the stop bit has begun
    label("high")
    jmp(x_dec, "quiet")         .side(0)
    mov(x, status)              .side(0)    # zero: all words of a frame are there
    jmp(not_x, "send")          .side(0)
    label("dead")
    wait(0, pin, 0)             .side(0)
    jmp("low")                  .side(0)
    label("send")
    irq(4)                      .side(1)
    set(y, 6)                   .side(1)
    label("word")
    pull(block)                 .side(1)
    label("bit")
    out(pins, 1)                .side(1)    [14]
    jmp(not_osre, "bit")        .side(1)
    set(pins, 1)                .side(1)    [13]
    jmp(y_dec, "word")          .side(1)
# fmt: on


class PioSlot:
    """Sends one frame in the slot that the frame interrupt opens.

    `frame`: the 14 bytes that go out; `words`: the same as the state machine wants them, two
    bytes a word, with all start and stop bits but the last. `fifo_register` takes the words;
    flag 4 of `sent_register` is set when sending begins (flags 4-7 interrupt nobody).
    """

    def __init__(self, pin, *, baud_rate=420_000, inverted=False, state_machine=4):
        """`pin`: GPIO number, with its pull resistor on; `state_machine`: 0..7, any free one.

        `inverted`: whether the line is low while nobody talks.
        """
        block, index = divmod(state_machine, 4)
        self.frame = bytearray(_FRAME_BYTES)
        self.words = array("I", [0] * _WORDS)
        self._pin = pin
        self._pull = Pin.PULL_DOWN if inverted else Pin.PULL_UP
        self._block = rp2.PIO(block)
        pin = Pin(pin)
        self._machine = rp2.StateMachine(
            state_machine,
            _send,
            freq=_CYCLES_PER_BIT * baud_rate,
            in_base=pin,
            jmp_pin=pin,
            out_base=pin,
            set_base=pin,
            sideset_base=pin,
        )
        if inverted:
            chip.invert(self._pin)  # the state machine has given the pin its function anew
        registers = chip.PIO[block]
        self.fifo_register = registers + chip.PIO_SEND_FIFO + 4 * index
        self.sent_register = registers + chip.PIO_IRQ
        # asm_pio has no word for the source of `status`: here the send FIFO, with less than a
        # whole frame in it.
        control = registers + chip.PIO_MACHINE_SIZE * index + chip.PIO_EXECCTRL
        machine.mem32[control] = (machine.mem32[control] & ~chip.PIO_STATUS) | _WORDS
        self._machine.put(baud_rate // _LOOPS_PER_BAUD + _MORE_LOOPS)
        self._machine.exec("pull()")
        self._machine.exec("mov(isr, osr)")

    def start(self):
        """Begins to follow the line."""
        machine.mem32[self.sent_register] = SENT_FLAG
        self._machine.active(1)

    def stop(self):
        """Stops, in the middle of a frame if need be, and releases the wire."""
        self._machine.active(0)
        self._block.remove_program(_send)
        Pin(self._pin, Pin.IN, self._pull)

    def fill(self, frame):
        """Takes the 14 bytes of `frame` for the next slot; not while the last are waiting."""
        if len(frame) != _FRAME_BYTES:
            raise ValueError(f"a telemetry frame has 14 bytes, not {len(frame)}")
        _fill(self.words, self.frame, frame)


@micropython.viper
def _fill(words: ptr32, copy: ptr8, frame: ptr8):
    at = 0
    while at < _FRAME_BYTES:
        copy[at] = frame[at]
        copy[at + 1] = frame[at + 1]
        words[at >> 1] = (frame[at] << 1) | (1 << 9) | (frame[at + 1] << 11)
        at += 2
