# only on rp2
"""Joins a wire, a receiver and outputs by the interrupts, and shows what these found."""

import time
from array import array

import machine
import rp2
import uctypes
from rp2 import asm_pio

from firmware import chip
from firmware import interrupts as word
from firmware.interrupts import frame_handler, tick_handler
from firmware.limits import SHAPES
from ghst.decoder import RING, scan

_TICK_MS = 10
_WATCHDOG_MS = 1000


# fmt: off
# ruff: noqa: F821
@asm_pio()
def _tick_program():
    # 1026 cycles a round. A state machine instead of machine.Timer, whose interrupts are soft
    # on the RP2 before MicroPython 1.26.
    set(x, 31)
    label("wait")
    jmp(x_dec, "wait")  [31]
    irq(rel(0))
# fmt: on


class Control:
    """Joins a wire, a receiver and outputs by the two interrupts, and shows what they found."""

    def __init__(
        self,
        wire,
        slot,
        receiver,
        outputs,
        *,
        failsafe_ms=500,
        led=None,
        led_active_low=False,
        broken=False,
        state_machine=7,
    ):
        """`wire` and `slot`: drivers that were not started; `led`: GPIO number or None.

        `failsafe_ms`: time without a valid control frame until failsafe. `broken`: whether the
        LED shows that the configuration is. `state_machine`: the one that gives the tick.
        """
        self._slot = slot
        self._wire = wire
        self._keep = (receiver, outputs)
        registers = chip.this_chip()
        checks = wire.enabled + outputs.enabled
        self._words = array("I", [0] * (word.CHECKS + 2 * len(checks)))
        words = self._words
        address = uctypes.addressof
        words[word.FAILSAFE_US] = failsafe_ms * 1000
        words[word.CLOCK_REGISTER] = registers.TIMER_RAW_LOW
        words[word.WRITE_REGISTER] = wire.write_register
        words[word.ADDRESS_REGISTER] = wire.address_register
        words[word.GAP_ADDRESS] = wire.gap_address
        words[word.MEMORY] = address(receiver.memory)
        words[word.PULSES] = address(receiver.pulses)
        words[SHAPES] = outputs.shapes.address if outputs.shapes else 0
        words[word.BROKEN] = broken
        words[word.LOST] = outputs.lost_address
        words[word.TABLE] = address(outputs.table)
        words[word.TABLE_BYTES] = 4 * len(outputs.table)
        words[word.FAILSAFE_PULSES] = address(outputs.failsafe_pulses)
        words[word.FAILSAFE_RULES] = address(outputs.failsafe_rules)
        words[word.FAILSAFE_RULES_END] = address(outputs.failsafe_rules) + 4 * len(
            outputs.failsafe_rules
        )
        words[word.MASK_REGISTER] = chip.NVIC_DISABLE
        words[word.UNMASK_REGISTER] = chip.NVIC_ENABLE
        words[word.INTERRUPT_BIT] = 1 << wire.interrupt
        words[word.FORCE_REGISTER], words[word.FORCE_BIT] = wire.force_interrupt
        words[word.WATCHDOG_REGISTER] = registers.WATCHDOG + chip.WATCHDOG_LOAD
        words[word.SLOT_WORDS] = address(slot.words)
        words[word.SLOT_WORDS_END] = address(slot.words) + 4 * len(slot.words)
        words[word.SLOT_FRAME] = address(slot.frame)
        words[word.SLOT_FIFO] = slot.fifo_register
        words[word.SENT_REGISTER] = slot.sent_register
        words[word.RING_ADDRESS] = address(receiver.memory) + RING
        words[word.CHECKS_END] = len(words)
        for index, (register, bit) in enumerate(checks):
            words[word.CHECKS + 2 * index] = register
            words[word.CHECKS + 2 * index + 1] = bit
        if led is not None:
            machine.Pin(led, machine.Pin.OUT, value=led_active_low)
            levels = (registers.GPIO_SET, registers.GPIO_CLEAR)
            words[word.LED_ON] = levels[led_active_low]
            words[word.LED_OFF] = levels[not led_active_low]
            words[word.LED_MASK] = 1 << led
        # The interrupts know all of this by address alone: whoever starts them keeps this object.
        self._on_frame = frame_handler(address(words), scan, outputs.shape)
        self._on_tick = tick_handler(address(words))
        self._led = led
        self._led_off = led_active_low
        self._block = rp2.PIO(state_machine // 4)
        self._tick = rp2.StateMachine(state_machine, _tick_program, freq=1026 * 1000 // _TICK_MS)

    def start(self, *, watchdog=True):
        """Starts both interrupts, and the hardware watchdog that the tick feeds."""
        self._tick.irq(self._on_tick, hard=True)
        self._slot.start()
        self._wire.start(self._on_frame)
        # Neither USB nor the tick delays a pulse.
        chip.raise_priority(self._wire.interrupt)
        if watchdog:
            counts = chip.this_chip().WATCHDOG_COUNTS_PER_US
            self._words[word.WATCHDOG_LOAD] = _WATCHDOG_MS * 1000 * counts
            machine.WDT(timeout=_WATCHDOG_MS)
        self._tick.active(1)

    def stop(self):
        """Stops both interrupts and pauses the watchdog, so that the REPL can be used in peace."""
        self._slot.stop()
        register = chip.this_chip().WATCHDOG
        machine.mem32[register + chip.CLEAR_BITS] = chip.WATCHDOG_ENABLE
        self._wire.stop()
        self._tick.active(0)
        self._tick.irq(None)
        self._block.remove_program(_tick_program)
        if self._led is not None:
            machine.Pin(self._led, machine.Pin.OUT, value=self._led_off)

    def rest(self, ms):
        """Passes the time of the main loop."""
        time.sleep_ms(ms)

    @property
    def restarted(self):
        """Whether the watchdog has restarted the chip."""
        # reset_cause() cannot tell a time-out from machine.reset(), which uses it too.
        register = chip.this_chip().WATCHDOG + chip.WATCHDOG_REASON
        return machine.mem32[register] & 1 != 0

    def alive(self):
        """Tells the tick that the main loop runs; to be called at least once a second."""
        self._words[word.LOOPS] = (self._words[word.LOOPS] + 1) & 0xFFFF

    @property
    def slot_free(self):
        """Whether no telemetry frame waits for its slot."""
        return not self._words[word.SLOT]

    def send(self, frame):
        """Has the 14 bytes of `frame` sent in the next slot; only while the slot is free."""
        self._slot.fill(frame)
        self._words[word.SLOT] = 1

    def discard(self):
        """Forgets a frame that waits; one that is on its way goes on."""
        self._words[word.SLOT] = 0

    @property
    def telemetry_frames(self):
        """Frames sent, modulo 2^30."""
        return self._words[word.TELEMETRY_FRAMES]

    @property
    def collisions(self):
        """Frames sent whose echo was missing or not the same, modulo 2^30."""
        return self._words[word.COLLISIONS]

    @property
    def link(self):
        """`SEARCHING` (no control frame yet), `LINKED` or `FAILSAFE`."""
        return self._words[word.LINK]

    @property
    def failsafes(self):
        """How often the link was lost."""
        return self._words[word.FAILSAFES]

    @property
    def stuck(self):
        """How often the main loop stood still for two seconds."""
        return self._words[word.STUCK]
