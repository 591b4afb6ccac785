"""Plays the Ghost receiver on a pin that is tied to the wire: talks, and records the line."""

import time
from array import array

import machine
import rp2
from machine import Pin
from micropython import const
from rp2 import PIO, asm_pio

from firmware import chip

_BAUD_RATE = const(420_000)
_CYCLES_PER_BIT = const(16)
_CYCLES_PER_SAMPLE = const(32)
# State machines of block 1 that the firmware leaves free, and the DMA request of the second.
_TALK = const(5)
_LISTEN = const(6)
_LISTEN_REQUEST = const(14)
_LISTEN_FIFO = const(0x28)
_POLL_US = const(200)
# Of a recording: control frame, slot and telemetry take 1.72 ms.
_SHARE_OF_A_SECOND = const(500)


# fmt: off
# ruff: noqa: F821 - the words of asm_pio
@asm_pio(
    out_init=PIO.IN_HIGH, sideset_init=PIO.IN_HIGH, side_pindir=True,
    out_shiftdir=PIO.SHIFT_RIGHT, autopull=True, pull_thresh=32, fifo_join=PIO.JOIN_TX,
)
def _talk():
    # First the number of bits, minus one; then the bits, driven both ways. Side-set: whether.
    out(x, 32)                  .side(0)
    label("bit")
    out(pins, 1)                .side(1)    [14]
    jmp(x_dec, "bit")           .side(1)


@asm_pio(
    in_shiftdir=PIO.SHIFT_RIGHT, autopush=True, push_thresh=32, fifo_join=PIO.JOIN_RX,
)
def _listen():
    in_(pins, 1)
# fmt: on


class Player:
    """Sends transmissions on a pin and records what is on it.

    A transmission is an `array('I')`: the number of its bits minus one, a multiple of 32 minus
    one, and then the bits, the lowest first. The pin is driven as long as they last.
    """

    def __init__(self, pin):
        """`pin`: GPIO number; it is an input with a pull-up while nothing is sent."""
        self._number = pin
        pin = Pin(pin, Pin.IN, Pin.PULL_UP)
        self._talk = rp2.StateMachine(
            _TALK,
            _talk,
            freq=_CYCLES_PER_BIT * _BAUD_RATE,
            out_base=pin,
            sideset_base=pin,
        )
        # A whole divider: all samples are equally far apart.
        self._listen = rp2.StateMachine(
            _LISTEN, _listen, freq=machine.freq() // _CYCLES_PER_SAMPLE, in_base=pin
        )
        samples = machine.freq() // _CYCLES_PER_SAMPLE // _SHARE_OF_A_SECOND
        self._samples = array("I", [0] * (samples // 32 + 1))
        self._dma = rp2.DMA()
        self._control = self._dma.pack_ctrl(
            size=2,
            inc_read=False,
            ring_sel=False,
            ring_size=0,
            treq_sel=_LISTEN_REQUEST,
            chain_to=self._dma.channel,
        )
        self._talk.active(1)

    def send(self, transmission):
        """Sends; returns when all of it is on its way."""
        self._talk.put(transmission)

    def record(self, transmission):
        """Sends, and returns the level of the pin from then on: `bytes`, 8 samples in each.

        The first sample is in the lowest bit. Samples are 32 cycles of the chip's clock apart.
        """
        self._listen.active(0)
        self._listen.restart()
        while self._listen.rx_fifo():
            self._listen.get()
        self._dma.config(
            read=chip.PIO[1] + _LISTEN_FIFO,
            write=self._samples,
            count=len(self._samples),
            ctrl=self._control,
            trigger=True,
        )
        self._listen.active(1)
        self.send(transmission)
        while self._dma.active():
            time.sleep_us(_POLL_US)
        self._listen.active(0)
        return bytes(self._samples)

    def stop(self):
        """Gives pin, state machines and DMA back."""
        time.sleep_ms(1)
        self._talk.active(0)
        self._listen.active(0)
        Pin(self._number, Pin.IN, Pin.PULL_UP)
        self._dma.active(0)
        self._dma.close()
        for program in (_talk, _listen):
            rp2.PIO(1).remove_program(program)
