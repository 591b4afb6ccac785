# only on esp32
"""The hardware parts of an `Adapter` on the ESP32 family."""

import sys

import machine
from micropython import const

from firmware.control_esp32 import SoftControl
from firmware.ledc import LedcOutputs
from ghst import Receiver

# UART 0 is the console, UART 2 the one for a GPS; all pins can be connected to each of them.
_UART = const(1)


def parts(wire, channels, outputs, control):
    """Returns (`Receiver`, `LedcOutputs`, `SoftControl`), nothing of them started.

    `wire`: driver, pin, TX pin, baud rate, inversion; `channels`, `outputs`, `control`: the
    arguments of the last two.
    Raises `ValueError` for what this chip has not.
    """
    driver, wire_pin, tx_pin, baud_rate, _ = wire
    if driver != "uart":
        raise ValueError('wire is "pio", must be "uart" on an ESP32')
    most_bits = 20 if sys.implementation._machine.endswith(" with ESP32") else 14
    receiver = Receiver()
    try:
        servos = LedcOutputs(channels, receiver, most_bits=most_bits, **outputs)
        # At 420 kBd, 415 are the middle of the 400..430 that receivers send at; ours goes out at
        # the same rate. With timeout_char=1 the bytes of a frame come together, when it has ended.
        uart = machine.UART(
            _UART,
            baud_rate * 83 // 84,
            tx=tx_pin,
            rx=wire_pin,
            rxbuf=256,
            timeout=0,
            timeout_char=1,
        )
        return receiver, servos, SoftControl(uart, wire_pin, receiver, servos, **control)
    except OSError as error:
        raise ValueError(f"PWM or UART is taken by something else: {error}") from None
