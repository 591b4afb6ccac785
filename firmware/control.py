"""The control path: frame in, servo pulses out, failsafe; all of it in two hard interrupts.

Neither allocates, waits or looks at the main loop for anything but whether it is alive. The two
have the same priority, so they never interrupt each other.
"""

from array import array

import machine
import micropython
import rp2
import uctypes
from micropython import const
from rp2 import asm_pio

from firmware import chip
from ghst.decoder import HEAD, LINE_QUIET, TAIL, scan

# Pulse limits in quarter microseconds: 800 us and 2200 us.
MINIMUM = const(3200)
MAXIMUM = const(8800)

# Failsafe of an output; any other value is a pulse width in quarter microseconds.
NONE = const(0)
HOLD = const(-1)

SEARCHING = const(0)
LINKED = const(1)
FAILSAFE = const(2)

# Words of the control array that both interrupts work on.
_LINK = const(0)
_STAMP = const(1)  # microsecond clock at the last control frame
_FAILSAFE_US = const(2)
_FAILSAFES = const(3)
_TICKS = const(4)
_LOOPS = const(5)  # written by the main loop alone
_SEEN_LOOPS = const(6)
_IDLE_TICKS = const(7)
_STUCK = const(8)  # how often the main loop stood still
_UNREAD_TICKS = const(9)
_SEEN_TAIL = const(10)
_DRIVE = const(11)  # the tick wants the outputs written
_TABLE = const(12)  # in use: that of the channels or that of failsafe
_SOURCE = const(13)
_TABLE_BYTES = const(14)
_CLOCK_REGISTER = const(15)
_WRITE_REGISTER = const(16)
_ADDRESS_REGISTER = const(17)
_GAP_ADDRESS = const(18)
_HEAD = const(19)  # addresses of the decoder's words
_TAIL = const(20)
_LINE_QUIET = const(21)
_PULSES = const(22)
_FOLLOW_TABLE = const(23)
_FAILSAFE_TABLE = const(24)
_FAILSAFE_PULSES = const(25)
_FAILSAFE_RULES = const(26)
_OUTPUTS = const(27)
_FORCE_REGISTER = const(28)  # sets the interrupt flag of the wire's state machine
_FORCE_BIT = const(29)
_WATCHDOG_REGISTER = const(30)
_WATCHDOG_LOAD = const(31)  # 0 = no watchdog
_LED_ON = const(32)
_LED_OFF = const(33)
_LED_MASK = const(34)
_CHECKS_END = const(35)
_CHECKS = const(36)  # address and bit of each thing that must stay switched on

_TICK_MS = const(10)
# The main loop is stuck after two seconds, and worth a reset after five where no link is at stake.
_STUCK_TICKS = const(200)
_RESET_TICKS = const(500)
_FRAME_BYTES = const(14)
_UNREAD_LIMIT = const(3)
_WATCHDOG_MS = const(1000)

# One bit is eight ticks: a pattern of 16 bits takes 1.28 s.
_LED_SEARCHING = const(0x00FF)
_LED_LINKED = const(0xFFFF)
_LED_FAILSAFE = const(0x5555)
_LED_STUCK = const(0x0005)


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


def _frame_handler(context, memory, pulses, decode):
    """Returns the interrupt handler for the end of a frame or a gap.

    `context`: address of the control array. The outputs are written here and nowhere else; the
    tick raises this interrupt when failsafe begins. Global names cost a microsecond, and a
    closure over five variables would allocate on every call.
    """

    @micropython.viper
    def on_frame(_machine):
        c = ptr32(int(context))
        if ptr32(c[_ADDRESS_REGISTER])[0] == c[_GAP_ADDRESS]:
            ptr32(c[_LINE_QUIET])[0] = 1
        ptr32(c[_HEAD])[0] = ptr32(c[_WRITE_REGISTER])[0] & 255
        if int(decode(memory, pulses)):
            c[_STAMP] = ptr32(c[_CLOCK_REGISTER])[0]
            c[_LINK] = LINKED
            c[_TABLE] = c[_FOLLOW_TABLE]
            c[_SOURCE] = c[_PULSES]
            c[_DRIVE] = 1
        if c[_DRIVE]:
            c[_DRIVE] = 0
            at = c[_TABLE]
            end = at + c[_TABLE_BYTES]
            source = ptr16(c[_SOURCE])
            while at < end:
                slice = ptr32(at)
                low = source[slice[2]]
                high = source[slice[3]]
                # Zero, which stays "no pulses", and what is outside of the limits.
                if uint(low - MINIMUM) > uint(MAXIMUM - MINIMUM) and low:
                    low = MINIMUM if low < MINIMUM else MAXIMUM
                if uint(high - MINIMUM) > uint(MAXIMUM - MINIMUM) and high:
                    high = MINIMUM if high < MINIMUM else MAXIMUM
                low = (low * slice[1] + 0x8000) >> 16
                high = (high * slice[1] + 0x8000) >> 16
                ptr32(slice[0])[0] = (high << 16) | low
                at += 16

    return on_frame


def _tick_handler(context):
    """Returns the interrupt handler for the tick: failsafe, watchdog, LED."""

    @micropython.viper
    def on_tick(_machine):
        c = ptr32(int(context))
        ticks = c[_TICKS] + 1
        c[_TICKS] = ticks
        # The difference is right across the wrap of the clock, and it is looked at only while it
        # is small: failsafe holds until the next control frame.
        silence = ptr32(c[_CLOCK_REGISTER])[0] - c[_STAMP]
        if c[_LINK] == LINKED and silence > c[_FAILSAFE_US]:
            rules = ptr32(c[_FAILSAFE_RULES])
            targets = ptr16(c[_FAILSAFE_PULSES])
            last = ptr16(c[_PULSES])
            index = 0
            while index < c[_OUTPUTS]:
                pulse = rules[2 * index + 1]
                targets[index] = last[rules[2 * index]] if pulse == HOLD else pulse
                index += 1
            c[_LINK] = FAILSAFE
            c[_FAILSAFES] = c[_FAILSAFES] + 1
            c[_TABLE] = c[_FAILSAFE_TABLE]
            c[_SOURCE] = c[_FAILSAFE_PULSES]
            c[_DRIVE] = 1
            ptr32(c[_FORCE_REGISTER])[0] = c[_FORCE_BIT]
        link = c[_LINK]

        idle = 0
        if c[_LOOPS] == c[_SEEN_LOOPS]:
            idle = c[_IDLE_TICKS] + 1
            if idle == _STUCK_TICKS:
                c[_STUCK] = c[_STUCK] + 1
        c[_SEEN_LOOPS] = c[_LOOPS]
        c[_IDLE_TICKS] = idle

        # The frame interrupt never leaves as much as a frame unread: if it does, and its place in
        # the ring stands still, it is dead.
        tail = ptr32(c[_TAIL])[0]
        if tail != c[_SEEN_TAIL]:
            c[_SEEN_TAIL] = tail
            c[_UNREAD_TICKS] = 0
        elif (ptr32(c[_WRITE_REGISTER])[0] - tail) & 255 >= _FRAME_BYTES:
            c[_UNREAD_TICKS] = c[_UNREAD_TICKS] + 1
        healthy = c[_UNREAD_TICKS] < _UNREAD_LIMIT
        at = _CHECKS
        while at < c[_CHECKS_END]:
            if ptr32(c[at])[0] & c[at + 1] == 0:
                healthy = False
            at += 2
        if idle >= _RESET_TICKS and link != LINKED:
            healthy = False
        if healthy and c[_WATCHDOG_LOAD]:
            ptr32(c[_WATCHDOG_REGISTER])[0] = c[_WATCHDOG_LOAD]

        if c[_LED_MASK]:
            pattern = _LED_SEARCHING
            if idle >= _STUCK_TICKS:
                pattern = _LED_STUCK
            elif link == LINKED:
                pattern = _LED_LINKED
            elif link == FAILSAFE:
                pattern = _LED_FAILSAFE
            register = c[_LED_OFF]
            if (pattern >> ((ticks >> 3) & 15)) & 1:
                register = c[_LED_ON]
            ptr32(register)[0] = c[_LED_MASK]

    return on_tick


class Control:
    """Joins a wire, a receiver and outputs by the two interrupts, and shows what they found."""

    def __init__(self, wire, receiver, outputs, *, failsafe_ms=500, led=None, state_machine=7):
        """`wire`: a started-to-be wire driver; `led`: GPIO number or None.

        `failsafe_ms`: 50..10000, time without a valid control frame until failsafe.
        `state_machine`: the one that gives the tick. Raises `ValueError` out of these ranges.
        """
        if not 50 <= failsafe_ms <= 10_000:
            raise ValueError(f"failsafe_ms is {failsafe_ms}, must be 50..10000")
        self._wire = wire
        self._keep = (receiver, outputs)
        registers = chip.this_chip()
        checks = wire.enabled + outputs.enabled
        self._words = array("I", [0] * (_CHECKS + 2 * len(checks)))
        words = self._words
        address = uctypes.addressof
        words[_FAILSAFE_US] = failsafe_ms * 1000
        words[_CLOCK_REGISTER] = registers.TIMER_RAW_LOW
        words[_WRITE_REGISTER] = wire.write_register
        words[_ADDRESS_REGISTER] = wire.address_register
        words[_GAP_ADDRESS] = wire.gap_address
        words[_HEAD] = address(receiver.memory) + 4 * HEAD
        words[_TAIL] = address(receiver.memory) + 4 * TAIL
        words[_LINE_QUIET] = address(receiver.memory) + 4 * LINE_QUIET
        words[_PULSES] = address(receiver.pulses)
        words[_FOLLOW_TABLE] = address(outputs.table)
        words[_TABLE_BYTES] = 4 * len(outputs.table)
        words[_FAILSAFE_TABLE] = address(outputs.failsafe_table)
        words[_FAILSAFE_PULSES] = address(outputs.failsafe_pulses)
        words[_FAILSAFE_RULES] = address(outputs.failsafe_rules)
        words[_OUTPUTS] = len(outputs.failsafe_pulses)
        words[_FORCE_REGISTER], words[_FORCE_BIT] = wire.force_interrupt
        words[_WATCHDOG_REGISTER] = registers.WATCHDOG + chip.WATCHDOG_LOAD
        words[_CHECKS_END] = len(words)
        for index, (register, bit) in enumerate(checks):
            words[_CHECKS + 2 * index] = register
            words[_CHECKS + 2 * index + 1] = bit
        if led is not None:
            machine.Pin(led, machine.Pin.OUT, value=0)
            words[_LED_ON] = registers.GPIO_SET
            words[_LED_OFF] = registers.GPIO_CLEAR
            words[_LED_MASK] = 1 << led
        # The interrupts hold their address, so the handlers live as long as this object.
        self._on_frame = _frame_handler(address(words), receiver.memory, receiver.pulses, scan)
        self._on_tick = _tick_handler(address(words))
        self._led = led
        self._tick = rp2.StateMachine(state_machine, _tick_program, freq=1026 * 1000 // _TICK_MS)

    def start(self, *, watchdog=True):
        """Starts both interrupts, and the hardware watchdog that the tick feeds."""
        self._tick.irq(self._on_tick, hard=True)
        self._wire.start(self._on_frame)
        if watchdog:
            counts = chip.this_chip().WATCHDOG_COUNTS_PER_US
            self._words[_WATCHDOG_LOAD] = _WATCHDOG_MS * 1000 * counts
            machine.WDT(timeout=_WATCHDOG_MS)
        self._tick.active(1)

    def stop(self):
        """Stops both interrupts and pauses the watchdog, so that the REPL can be used in peace."""
        register = chip.this_chip().WATCHDOG
        machine.mem32[register + chip.CLEAR_BITS] = chip.WATCHDOG_ENABLE
        self._wire.stop()
        self._tick.active(0)
        self._tick.irq(None)
        if self._led is not None:
            machine.Pin(self._led, machine.Pin.OUT, value=0)

    def alive(self):
        """Tells the tick that the main loop runs; to be called at least once a second."""
        self._words[_LOOPS] = (self._words[_LOOPS] + 1) & 0xFFFF

    @property
    def link(self):
        """`SEARCHING` (no control frame yet), `LINKED` or `FAILSAFE`."""
        return self._words[_LINK]

    @property
    def failsafes(self):
        """How often the link was lost."""
        return self._words[_FAILSAFES]

    @property
    def ticks(self):
        """Ticks of 10 ms since the start."""
        return self._words[_TICKS]

    @property
    def stuck(self):
        """How often the main loop stood still for two seconds."""
        return self._words[_STUCK]
