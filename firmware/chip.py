"""Register addresses of the RP2040 and the RP2350 that the control path writes to itself.

Sources: RP2040 datasheet and RP2350 datasheet, chapters PWM, Timer, Watchdog, SIO, DMA, PIO,
UART, GPIO.
"""

import sys

import machine


class RP2040:
    """Addresses on the RP2040."""

    NAME = "rp2040"
    PWM = 0x40050000
    TIMER_RAW_LOW = 0x40054028
    WATCHDOG = 0x40058000
    # Erratum RP2040-E1: the counter loses two for every tick.
    WATCHDOG_COUNTS_PER_US = 2
    PIO_INTERRUPT = 7  # of PIO block 0; two a block
    DMA_CHANNELS = 12
    DMA_ABORT = 0x50000444
    DMA_BUSY = 1 << 24
    DMA_CHAIN_TO = 11  # lowest bit of the field
    GPIO_SET = 0xD0000014
    GPIO_CLEAR = 0xD0000018
    GPIO_CONTROL = 0x40014004
    UART = (0x40034000, 0x40038000)
    UART_INTERRUPT = 20  # of UART 0
    UART_PINS = 3  # these bits of a GPIO number: 0 is TX, 1 is RX


class RP2350:
    """Addresses on the RP2350, both architectures."""

    NAME = "rp2350"
    PWM = 0x400A8000
    TIMER_RAW_LOW = 0x400B0028
    WATCHDOG = 0x400D8000
    WATCHDOG_COUNTS_PER_US = 1
    PIO_INTERRUPT = 15
    DMA_CHANNELS = 16
    DMA_ABORT = 0x50000464
    DMA_BUSY = 1 << 26
    DMA_CHAIN_TO = 13
    GPIO_SET = 0xD0000018
    GPIO_CLEAR = 0xD0000020
    GPIO_CONTROL = 0x40028004
    UART = (0x40070000, 0x40078000)
    UART_INTERRUPT = 33
    UART_PINS = 1


# The same on both chips.
PWM_SLICE_SIZE = 0x14
PWM_CONTROL = 0x00
PWM_DIVIDER = 0x04
PWM_COUNTER = 0x08
PWM_COMPARE = 0x0C
PWM_TOP = 0x10
DMA = 0x50000000
DMA_CHANNEL_SIZE = 0x40
DMA_WRITE_ADDRESS = 0x04
DMA_CONTROL = 0x10  # the alias that starts nothing
DMA_COUNT_TRIGGER = 0x1C
DMA_ENABLE = 1
PIO = (0x50200000, 0x50300000)
PIO_SEND_FIFO = 0x10
PIO_FIFO = 0x20
PIO_IRQ = 0x30
PIO_IRQ_FORCE = 0x34
PIO_MACHINE_SIZE = 0x18
PIO_EXECCTRL = 0xCC
PIO_STATUS = 0x7F  # of EXECCTRL: source and limit of `status`; 0x1F would do on the RP2040
PIO_ADDRESS = 0xD4
GPIO_CONTROL_SIZE = 8
GPIO_RELEASED = 5  # function SIO: what `Pin` has made of it, an input
UART_CONTROL = 0x30
UART_RECEIVES = 0x201  # RXE, UARTEN
UART_LEVELS = 0x34
UART_THREE_QUARTERS = 0x18  # receive FIFO: the level of MicroPython's IRQ_RXIDLE
# Of the Arm cores: one bit, or one byte of priority, for each interrupt.
NVIC_ENABLE = 0xE000E100
NVIC_DISABLE = 0xE000E180
NVIC_PRIORITY = 0xE000E400
WATCHDOG_LOAD = 0x04
WATCHDOG_REASON = 0x08  # bit 0: time-out; bit 1: forced, as machine.reset() does
WATCHDOG_SCRATCH = 0x0C  # the first of eight
WATCHDOG_ENABLE = 1 << 30
CLEAR_BITS = 0x3000  # atomic alias of a peripheral register


def raise_priority(interrupt):
    """Puts an interrupt above everything that MicroPython uses: USB, timers, the tick.

    0x80 is the default, lower comes first, and the RP2040 has two bits of it.
    """
    register = NVIC_PRIORITY + (interrupt & ~3)
    shift = 8 * (interrupt & 3)
    value = machine.mem32[register] & ~(0xFF << shift)
    machine.mem32[register] = value | 0x40 << shift


def this_chip():
    """Returns `RP2040` or `RP2350`; raises `ValueError` on anything else."""
    machine = sys.implementation._machine
    for chip in (RP2040, RP2350):
        if chip.NAME in machine.lower():
            return chip
    raise ValueError("no RP2040 or RP2350: " + machine)
