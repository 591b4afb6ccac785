"""Stopping the UART driver, what it refuses, and the driver for soft interrupts on this chip."""

from __future__ import annotations

from pathlib import Path

import pytest
from uart_rig import (
    RACE,
    SETUP,
    UartPico,
    fly,
    new_pico,
    slots_us,
)

from forked import forked
from ghst_tools import boards, device_files

REFUSED = """
def refused(*arguments, **options):
    try:
        Adapter(*arguments, **options)
        print("taken")
    except ValueError as error:
        print("refused:", error)
adapter.stop()
refused(2, {6: 1}, wire="uart")
refused(21, {6: 1}, wire="uart", tx_pin=16)
refused(21, {6: 1}, wire="uart", tx_pin=22)
refused(21, {20: 1}, wire="uart")
refused(21, {6: 1}, wire="uart", led=20)
refused(21, {6: 1}, wire="i2c")
adapter = Adapter(21, {6: 1}, wire="uart", tx_pin=8)
adapter.start(watchdog=False)
adapter.stop()
adapter = Adapter(2, {6: 1})
adapter.start(watchdog=False)
adapter.stop()
adapter = Adapter(21, {6: 1}, led=25, wire="uart")
adapter.start(watchdog=False)
"""


# The driver for soft interrupts on this chip, whose UART is made to hand over whole frames as the
# ESP32's does: in the slot or not at all, and nothing allocated once everything has been used.
SOFT_LINK = """
import gc, time
from machine import UART, Pin, Timer
from firmware.uart_link import UartLink
from ghst import Receiver, telemetry
class HandsOver:
    IRQ_RX = UART.IRQ_RXIDLE
    def __init__(self, uart):
        self._any = uart.any
        self.irq = uart.irq
        self.readinto = uart.readinto
        self.write = uart.write
    def any(self):
        count = self._any()
        return count if count >= 14 else 0
receiver = Receiver()
rx = Pin(21, Pin.IN, Pin.PULL_UP)
uart = UART(1, 415000, tx=Pin(20), rx=rx, rxbuf=256, timeout=0, timeout_char=1)
link = UartLink(HandsOver(uart), rx, Timer(-1), receiver)
link.start()
frame = bytearray(14)
telemetry.pack_status(frame, 0, 0, 0, True)
print("listening")
began = time.ticks_ms()
before = 0
while time.ticks_diff(time.ticks_ms(), began) < 80:
    link.poll(500)
    if link.slot_free:
        link.send(frame)
    if link.telemetry_frames == 1 and not before:
        gc.collect()
        gc.disable()
        before = gc.mem_alloc()
allocated = gc.mem_alloc() - before
gc.enable()
link.stop()
print(receiver.frames, link.telemetry_frames, link.collisions, allocated)
"""

# Told to, it stops while a frame of its own goes out.
STOP = """
    if chosen[0]:
        while not machine.mem32[0x50200030] & 16:
            pass
        time.sleep_us(100)
        adapter.stop()
        raise SystemExit
    time.sleep_ms(1)"""


@pytest.fixture(scope="module")
def started_again(micropython_image: Path, firmware_files: dict[str, bytes]) -> UartPico:
    """A Pico whose fourth adapter runs; for forked tests only."""
    # Boards with this chip do not get the driver for soft interrupts.
    board = boards.load("rpi_pico")
    modules = device_files.sources(board=board)
    modules["firmware/uart_link.py"] = boards.checkout() / "firmware/uart_link.py"
    compiled = device_files.compile_modules(modules, board.mpy_arch)
    path = "/lib/firmware/uart_link.mpy"
    pico = new_pico(micropython_image, firmware_files | {path: compiled[path]})
    pico.run(f"adapter.poll(); refill(){STOP}", options='wire="uart"', setup=REFUSED + SETUP)
    pico.driven.clear()
    return pico


@forked
def test_what_is_refused(started_again: UartPico) -> None:
    output = started_again.board.console.output.decode().splitlines()
    assert [line for line in output if line.startswith(("refused", "taken"))] == [
        "refused: GP2 is RX of no UART: take GP1, GP5, GP9 or so",
        "refused: GP16 is not TX of UART1, whose RX GP21 is",
        "refused: GP22 is not TX of UART1, whose RX GP21 is",
        "refused: GP20 is TX of the Ghost wire and something else",
        "refused: GP20 is TX of the Ghost wire and something else",
        'refused: wire is \'i2c\', must be "pio" or "uart"',
    ]


@forked
def test_an_adapter_behind_others_works(started_again: UartPico) -> None:
    assert len(fly(started_again, 250, 4).downlink) == 4


@forked
def test_stopped_in_the_middle_of_our_frame(started_again: UartPico) -> None:
    pico = started_again
    pico.load(1)
    pico.board.run_for(2e6)
    end = pico.wire.send(RACE, pico.at(1e6))
    pico.board.run_for(5e6)
    assert [driving for _, driving in pico.driven] == [True, False]
    assert 1000e3 < pico.driven[0][0] - end < 1030e3
    assert 100e3 < pico.driven[1][0] - pico.driven[0][0] < 300e3
    assert pico.wire.level


@forked
def test_the_driver_for_soft_interrupts(started_again: UartPico) -> None:
    pico = started_again
    pico.pins.diode = True
    pico.board.start(f"adapter.stop(){SOFT_LINK}")
    pico.board.run_until(lambda: "listening" in pico.board.printed)
    receiver = fly(pico, 250.7, 14)
    frames, sent, collisions, allocated = pico.board.result().split()[-4:]
    assert (frames, collisions) == ("14", "0")
    assert int(sent) == len(receiver.downlink) >= 8
    assert all(1000.0 <= slot <= 1300.0 for slot in slots_us(receiver))
    assert pico.wire.contention == []
    assert allocated == "0"
