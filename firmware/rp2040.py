# only on rp2
"""Addresses on the RP2040.

Source: RP2040 datasheet; see `firmware.chip`.
"""

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
GPIO_INVERT_OUTPUT = 1 << 8  # OUTOVER
UART = (0x40034000, 0x40038000)
UART_INTERRUPT = 20  # of UART 0
UART_PINS = 3  # these bits of a GPIO number: 0 is TX, 1 is RX
