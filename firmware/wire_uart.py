# only on rp2
"""The Ghost wire on a UART of the RP2040 or RP2350: TX and RX tied together, RX by interrupt.

Wiring: RX straight to the wire; TX to the wire through 1 kOhm, or through a Schottky diode with
its cathode at TX, which needs 2.2 kOhm from the wire to 3.3 V: nothing else raises the wire then.
Straight does as well, but then TX fights a receiver that sends while the board starts, or while
interrupts are off behind our frame. The hardware cannot put TX and RX on one pin. TX is an input
with a pull-up at all times but while a frame is sent.

The interrupt comes when the line has been idle for 32 bits, 76 us: so the servos follow a frame
that much later than with PIO, and a burst without a pause must not be longer than eleven frames.
"""

from array import array

import machine
import rp2
import uctypes
from machine import Pin
from micropython import const

from firmware import chip
from firmware import uart_interrupts as word
from ghst.decoder import MEMORY_SIZE, RING, SKIPPED_BYTES, TAIL

_BUFFER = const(128)  # as uart_interrupts has it


class UartWire:
    """Receives the Ghost wire into a ring by a UART's interrupt.

    The attributes are those of `PioWire`. The frame interrupt is one of PIO that no state machine
    raises: `force_interrupt` does. `pin`, `uart`, `words` and `sent_register` are for `UartSlot`.
    """

    def __init__(self, pin, *, tx_pin=None, baud_rate=420_000, state_machine=2):
        """`pin`: GPIO of RX; `tx_pin`: GPIO of TX, by default the one below.

        `state_machine`: 0..7, one whose interrupt nobody else uses. Raises `ValueError` for pins
        that are not RX and TX of one UART. TX is driven high for some microseconds in here.
        """
        here = chip.this_chip()
        if tx_pin is None:
            tx_pin = pin - 1
        number = (pin + 4) >> 3 & 1
        if pin & here.UART_PINS != 1:
            raise ValueError(f"GP{pin} is RX of no UART: take GP1, GP5, GP9 or so")
        if tx_pin & here.UART_PINS or (tx_pin + 4) >> 3 & 1 != number:
            raise ValueError(f"GP{tx_pin} is not TX of UART{number}, whose RX GP{pin} is")
        self.pin = pin
        self.memory = bytearray(MEMORY_SIZE)
        self.words = words = array("I", [0] * word.WORDS)
        address = uctypes.addressof(words)
        # At 420 kBd, 415 are the middle of the 400..430 that receivers send at; ours goes out at
        # the same rate.
        baud_rate = baud_rate * 83 // 84
        self._claim_pins(number, pin, tx_pin, baud_rate, here)
        block, index = divmod(state_machine, 4)
        # It has no program: only its interrupt is wanted.
        self._machine = rp2.StateMachine(state_machine)
        self.interrupt = here.PIO_INTERRUPT + 2 * block
        self.force_interrupt = (chip.PIO[block] + chip.PIO_IRQ_FORCE, 1 << index)
        self.sent_register = chip.PIO[block] + chip.PIO_IRQ
        self.write_register = address + 4 * word.WRITE
        # The frame interrupt need not look for gaps: that is done before it.
        self.address_register = address + 4 * word.ZERO
        self.gap_address = 1
        memory = uctypes.addressof(self.memory)
        words[word.CLOCK_REGISTER] = here.TIMER_RAW_LOW
        # A byte and a pause that made no interrupt, 42 bits, and what it takes to get there.
        words[word.BYTE_US] = 42_000_000 // baud_rate + 29
        # Our last stop bit is high, as the released wire is.
        words[word.FRAME_US] = 139_500_000 // baud_rate
        words[word.RING_ADDRESS] = memory + RING
        words[word.TAIL] = memory + 4 * TAIL
        words[word.SKIPPED_BYTES] = memory + 4 * SKIPPED_BYTES
        words[word.SENT_REGISTER] = self.sent_register
        words[word.FORCE_REGISTER], words[word.FORCE_BIT] = self.force_interrupt
        self._interrupt = here.UART_INTERRUPT + number
        registers = here.UART[number]
        self.enabled = (
            (registers + chip.UART_CONTROL, chip.UART_RECEIVES),
            # MicroPython takes these bits back when it has switched our handler off.
            (registers + chip.UART_LEVELS, chip.UART_THREE_QUARTERS),
            (chip.NVIC_ENABLE + (self._interrupt >> 5 << 2), 1 << (self._interrupt & 31)),
        )

    def _claim_pins(self, number, pin, tx_pin, baud_rate, here):
        Pin(pin, Pin.IN, Pin.PULL_UP)
        tx = Pin(tx_pin, Pin.IN, Pin.PULL_UP)
        control = here.GPIO_CONTROL + chip.GPIO_CONTROL_SIZE * tx_pin
        self.uart = machine.UART(number, baud_rate, tx=tx, rx=Pin(pin), rxbuf=_BUFFER, txbuf=32)
        self.words[word.TX_CONTROL] = control
        self.words[word.TX_UART] = machine.mem32[control]
        self.words[word.TX_RELEASED] = chip.GPIO_RELEASED
        machine.mem32[control] = chip.GPIO_RELEASED

    def start(self, handler):
        """Calls `handler(state_machine)` in a hard interrupt 76 us behind each burst of bytes."""
        self._machine.irq(handler, hard=True)
        while self.uart.any():
            self.uart.read()
        address = uctypes.addressof(self.words)
        on_idle = word.idle_handler(address, bytearray(_BUFFER), handler)
        self.uart.irq(on_idle, self.uart.IRQ_RXIDLE, hard=True)
        chip.raise_priority(self._interrupt)

    def stop(self):
        """Stops receiving and gives the UART back."""
        self.uart.irq(None)
        self.uart.deinit()
        self._machine.irq(None)
        Pin(self.pin, Pin.IN, Pin.PULL_UP)
