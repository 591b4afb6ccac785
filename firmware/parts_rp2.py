# only on rp2
"""The hardware parts of an `Adapter` on the RP2040 and the RP2350."""

from firmware.control import Control
from firmware.outputs import ServoOutputs
from ghst import Receiver


def parts(wire, channels, outputs, control):
    """Returns (`Receiver`, `ServoOutputs`, `Control`), nothing of them started.

    `wire`: driver, pin, TX pin, baud rate, inversion; `channels`, `outputs`, `control`: the
    arguments of the last two.
    """
    driver, slot = _drivers(*wire)
    receiver = Receiver(driver.memory)
    servos = ServoOutputs(channels, receiver, **outputs)
    return receiver, servos, Control(driver, slot, receiver, servos, **control)


def _drivers(wire, wire_pin, tx_pin, baud_rate, inverted):
    # A board loads the driver that it needs.
    if wire == "uart":
        from firmware.slot_uart import UartSlot
        from firmware.wire_uart import UartWire

        driver = UartWire(wire_pin, tx_pin=tx_pin, baud_rate=baud_rate)
        return driver, UartSlot(driver, baud_rate=baud_rate)
    from firmware.slot_pio import PioSlot
    from firmware.wire_pio import PioWire

    return (
        PioWire(wire_pin, baud_rate=baud_rate, inverted=inverted),
        PioSlot(wire_pin, baud_rate=baud_rate, inverted=inverted),
    )
