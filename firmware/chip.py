# only on rp2
"""Register addresses of the RP2040 and the RP2350 that the control path writes to itself.

Sources: RP2040 datasheet and RP2350 datasheet, chapters PWM, Timer, Watchdog, SIO, DMA, PIO,
UART, GPIO.
"""

import sys

import machine
from micropython import const

# What is the same on both chips; the rest is in `firmware.rp2040` and `firmware.rp2350`.
PWM_SLICE_SIZE = const(0x14)
PWM_CONTROL = const(0x00)
PWM_DIVIDER = const(0x04)
PWM_COUNTER = const(0x08)
PWM_COMPARE = const(0x0C)
PWM_TOP = const(0x10)
DMA = 0x50000000
DMA_CHANNEL_SIZE = const(0x40)
DMA_WRITE_ADDRESS = const(0x04)
DMA_CONTROL = const(0x10)  # the alias that starts nothing
DMA_COUNT_TRIGGER = const(0x1C)
DMA_ENABLE = const(1)
PIO = (0x50200000, 0x50300000)
PIO_SEND_FIFO = const(0x10)
PIO_FIFO = const(0x20)
PIO_IRQ = const(0x30)
PIO_IRQ_FORCE = const(0x34)
PIO_MACHINE_SIZE = const(0x18)
PIO_EXECCTRL = const(0xCC)
PIO_STATUS = const(0x7F)  # of EXECCTRL: source and limit of `status`; 0x1F would do on the RP2040
PIO_ADDRESS = const(0xD4)
GPIO_CONTROL_SIZE = const(8)
GPIO_INVERT_INPUT = const(1 << 16)  # INOVER: for everything inside the chip
GPIO_RELEASED = const(5)  # function SIO: what `Pin` has made of it, an input
UART_CONTROL = const(0x30)
UART_RECEIVES = const(0x201)  # RXE, UARTEN
UART_LEVELS = const(0x34)
UART_THREE_QUARTERS = const(0x18)  # receive FIFO: the level of MicroPython's IRQ_RXIDLE
# Of the Arm cores: one bit, or one byte of priority, for each interrupt.
NVIC_ENABLE = 0xE000E100
NVIC_DISABLE = 0xE000E180
NVIC_PRIORITY = 0xE000E400
WATCHDOG_LOAD = const(0x04)
WATCHDOG_REASON = const(0x08)  # bit 0: time-out; bit 1: forced, as machine.reset() does
WATCHDOG_SCRATCH = const(0x0C)  # the first of eight
WATCHDOG_ENABLE = 1 << 30
CLEAR_BITS = const(0x3000)  # atomic alias of a peripheral register


def raise_priority(interrupt):
    """Puts an interrupt above everything that MicroPython uses: USB, timers, the tick.

    0x80 is the default, lower comes first, and the RP2040 has two bits of it.
    """
    register = NVIC_PRIORITY + (interrupt & ~3)
    shift = 8 * (interrupt & 3)
    value = machine.mem32[register] & ~(0xFF << shift)
    machine.mem32[register] = value | 0x40 << shift


def invert(pin):
    """Turns the levels of a GPIO round, in and out, until something gives it its function anew."""
    chip = this_chip()
    register = chip.GPIO_CONTROL + GPIO_CONTROL_SIZE * pin
    machine.mem32[register] |= GPIO_INVERT_INPUT | chip.GPIO_INVERT_OUTPUT


def this_chip():
    """Returns `firmware.rp2040` or `firmware.rp2350`; raises `ValueError` on anything else."""
    here = sys.implementation._machine
    if "RP2040" in here:
        from firmware import rp2040 as chip
    elif "RP2350" in here:
        from firmware import rp2350 as chip
    else:
        raise ValueError("no RP2040 or RP2350: " + here)
    return chip
