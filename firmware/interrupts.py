# only on rp2
"""The two hard interrupts of the control path: frame in, servo pulses out, failsafe.

Neither allocates, waits or looks at the main loop for anything but whether it is alive. The frame
interrupt may interrupt the tick, as it may everything else on the chip; the tick masks it for the
few microseconds in which both would decide about the link.
"""

# ruff: noqa: F821 - ptr16, ptr32 and uint are viper's own names
import micropython
from micropython import const

from firmware.limits import FAILSAFE, HOLD, LINKED, MAXIMUM, MINIMUM, SHAPES
from ghst.decoder import (
    COUNTER_MASK,
    HEAD,
    LINE_QUIET,
    RF_PROTOCOL,
    RING,
    SKIPPED_BYTES,
    TAIL,
)

# Words of a PWM slice in the table of the outputs: address of its compare register; then for its
# outputs A and B the address of the pulse, PWM counts of a quarter microsecond times 65536, what
# is added to their product, and the address of the failsafe pulse.
SLICE_WORDS = const(9)
# Words of an output in the failsafe rules: address of its pulse, rule.
_RULE_WORDS = const(2)

# Words of the control array that both interrupts work on.
# What the frame interrupt needs comes first: a load from the first 32 words is one instruction.
LINK = const(0)
STAMP = const(1)  # microsecond clock at the last control frame
DRIVE = const(2)  # the tick wants the outputs written
TABLE = const(3)
TABLE_BYTES = const(4)
CLOCK_REGISTER = const(5)
WRITE_REGISTER = const(6)
ADDRESS_REGISTER = const(7)
GAP_ADDRESS = const(8)
UNFINISHED = const(9)  # microsecond clock when bytes were left in the ring, or 0
FAILSAFE_US = const(10)
TICKS = const(11)
LOOPS = const(12)  # written by the main loop alone
PULSES = const(13)
FAILSAFE_PULSES = const(14)
SENT_REGISTER = const(15)  # flag 4 of it: the slot's state machine has begun to send
SLOT = const(16)  # a frame waits for its slot; set by the main loop
SLOT_WORDS = const(17)  # address of what goes into the FIFO of the slot's state machine, and
SLOT_WORDS_END = const(18)
SLOT_FIFO = const(19)
SLOT_FRAME = const(20)  # address of the same as the 14 bytes that will be heard
RING_ADDRESS = const(21)
TELEMETRY_FRAMES = const(22)
COLLISIONS = const(23)
MEMORY = const(24)  # address of the decoder's memory
# 25 is SHAPES: address of what the shapes' function works on, or 0
SEEN_LOOPS = const(26)
IDLE_TICKS = const(27)
STUCK = const(28)  # how often the main loop stood still
UNREAD_TICKS = const(29)
SEEN_TAIL = const(30)
FAILSAFES = const(31)
DEAD = const(32)  # the frame interrupt does not answer: no pulses, and the watchdog starves
FAILSAFE_RULES = const(33)
FAILSAFE_RULES_END = const(34)
MASK_REGISTER = const(35)  # these mask and unmask it
UNMASK_REGISTER = const(36)
INTERRUPT_BIT = const(37)
FORCE_REGISTER = const(38)  # sets the interrupt flag of the wire's state machine
FORCE_BIT = const(39)
WATCHDOG_REGISTER = const(40)
WATCHDOG_LOAD = const(41)  # 0 = no watchdog
LED_OFF = const(42)
LED_ON = const(43)  # right behind it
LED_MASK = const(44)
BROKEN = const(45)  # the configuration is: for the LED
LOST = const(46)  # address of a word that is set when the link ends
CHECKS_END = const(47)
CHECKS = const(48)  # address and bits of each thing that must stay switched on

SENT_FLAG = const(16)

# The main loop is stuck after two seconds, and worth a reset after five where no link is at stake.
_STUCK_TICKS = const(200)
_RESET_TICKS = const(500)
_FRAME_BYTES = const(14)
_UNREAD_LIMIT = const(3)
# What was left at an interrupt may be completed by bytes up to 100 us apart, and a gap of 150 us
# before the next interrupt; not by a frame that comes 2 ms later, with fewer than 15 bytes.
_SLOWEST_BYTE_US = const(124)
_SLOWEST_END_US = const(180)
# Our echo is complete 1.35 ms after the control frame; were it cut short, the gap behind it would
# be noticed at 1.5 ms. The next frame of the receiver is not complete before 2 ms.
_ECHO_LIMIT_US = const(1700)
# Modes with a downlink: Normal (5), Race (6), Long Range (8), Race250 (10).
_BIDIRECTIONAL = const(0x560)
_TELEMETRY_REQUESTED = const(0x20)

# One bit is eight ticks: a pattern of 16 bits takes 1.28 s.
_LED_SEARCHING = const(0x00FF)
_LED_LINKED = const(0xFFFF)
_LED_FAILSAFE = const(0x5555)
_LED_STUCK = const(0x0005)
_LED_BROKEN = const(0x0015)


def frame_handler(context, scan, shape):
    """Returns the interrupt handler for the end of a frame or a gap.

    `context`: address of the control array. `scan`: the decoder's; `shape`: of `firmware.shapes`,
    or None. The outputs are written here and nowhere else; the tick raises this interrupt when
    failsafe begins. Global names cost time, and a closure over five variables would allocate on
    every call.

    Behind a control frame a telemetry frame that waits is handed to the slot's state machine. What
    is heard after that one has begun to send is our echo: compared, and never decoded.
    """

    @micropython.viper
    def on_frame(_machine):
        c = ptr32(int(context))
        words = ptr32(c[MEMORY])
        index = c[UNFINISHED]
        if index and uint(ptr32(c[CLOCK_REGISTER])[0] - index) > uint(
            ((ptr32(c[WRITE_REGISTER])[0] - words[HEAD]) & 255) * _SLOWEST_BYTE_US
            + _SLOWEST_END_US
        ):
            # A burst ended as frames do, and left what no later one completes.
            index = words[SKIPPED_BYTES] + ((words[HEAD] - words[TAIL]) & 255)
            words[SKIPPED_BYTES] = index & COUNTER_MASK
            words[TAIL] = RING | words[HEAD]
        if ptr32(c[ADDRESS_REGISTER])[0] == c[GAP_ADDRESS]:
            words[LINE_QUIET] = 1
        words[HEAD] = ptr32(c[WRITE_REGISTER])[0] & 255
        if ptr32(c[SENT_REGISTER])[0] & SENT_FLAG:
            ptr32(c[SENT_REGISTER])[0] = SENT_FLAG
            c[SLOT] = 0
            c[TELEMETRY_FRAMES] = (c[TELEMETRY_FRAMES] + 1) & COUNTER_MASK
            index = 0
            if uint(ptr32(c[CLOCK_REGISTER])[0] - c[STAMP]) < uint(_ECHO_LIMIT_US):
                tail = words[TAIL]
                head = words[HEAD]
                if (head - tail) & 255 == _FRAME_BYTES:
                    ring = ptr8(c[RING_ADDRESS])
                    frame = ptr8(c[SLOT_FRAME])
                    while index < _FRAME_BYTES and ring[(tail + index) & 255] == frame[index]:
                        index += 1
                words[TAIL] = RING | head
                words[LINE_QUIET] = 0
            if index != _FRAME_BYTES:
                c[COLLISIONS] = (c[COLLISIONS] + 1) & COUNTER_MASK
        controls = int(scan(c[MEMORY], c[PULSES]))
        if controls and c[SHAPES]:
            # In memory, because each argument and each result cost half a microsecond.
            ptr32(c[SHAPES])[0] = controls
            shape(context)
            controls = ptr32(c[SHAPES])[0]
        if controls:
            c[STAMP] = ptr32(c[CLOCK_REGISTER])[0]
            c[LINK] = LINKED
            c[DRIVE] = 1
        if c[DRIVE]:
            c[DRIVE] = 0
            at = c[TABLE]
            end = at + c[TABLE_BYTES]
            while at < end:
                slice = ptr32(at)
                low = ptr16(slice[1])[0]
                high = ptr16(slice[5])[0]
                # Zero is a channel that has not come, or not come back after failsafe; the rest
                # is outside of the limits.
                if uint(low - MINIMUM) > uint(MAXIMUM - MINIMUM):
                    if low == 0:
                        low = ptr16(slice[4])[0]
                    if low > MAXIMUM:
                        low = MAXIMUM
                    elif low < MINIMUM and low != 0:
                        low = MINIMUM
                if uint(high - MINIMUM) > uint(MAXIMUM - MINIMUM):
                    if high == 0:
                        high = ptr16(slice[8])[0]
                    if high > MAXIMUM:
                        high = MAXIMUM
                    elif high < MINIMUM and high != 0:
                        high = MINIMUM
                # Unsigned: a switch that is on counts beyond the whole period.
                low = int(uint(low * slice[2] + slice[3]) >> 16)
                high = int(uint(high * slice[6] + slice[7]) >> 16)
                ptr32(slice[0])[0] = (high << 16) | low
                at += 4 * SLICE_WORDS
        if controls and c[SLOT]:
            protocol = words[RF_PROTOCOL]
            ring = ptr8(c[RING_ADDRESS])
            head = ptr32(c[WRITE_REGISTER])[0]
            # Not if other bytes stand behind the control frame, even a frame: the slot is lost.
            if (
                (protocol & _TELEMETRY_REQUESTED) | ((_BIDIRECTIONAL >> (protocol & 31)) & 1)
                and head & 255 == words[HEAD]
                and ring[(head - _FRAME_BYTES) & 255] == 0x82
                and ring[(head - _FRAME_BYTES + 2) & 255] & 0xD0 == 0x10
            ):
                at = c[SLOT_WORDS]
                while at < c[SLOT_WORDS_END]:
                    ptr32(c[SLOT_FIFO])[0] = ptr32(at)[0]
                    at += 4
        c[UNFINISHED] = 0
        if (words[HEAD] ^ words[TAIL]) & 255:
            c[UNFINISHED] = ptr32(c[CLOCK_REGISTER])[0]

    return on_frame


def tick_handler(context):
    """Returns the interrupt handler for the tick: failsafe, watchdog, LED.

    Failsafe empties the channels, so that after it each output leaves its failsafe value only when
    its own channel has come again. It forgets the RF mode: nothing is sent until it is known.
    """

    @micropython.viper
    def on_tick(_machine):
        c = ptr32(int(context))
        ticks = c[TICKS] + 1
        c[TICKS] = ticks
        if c[DRIVE]:
            # Raised a tick ago, and the frame interrupt did not come: nobody else writes the
            # outputs, so they are switched off from here.
            c[DEAD] = 1
            at = c[TABLE]
            while at < c[TABLE] + c[TABLE_BYTES]:
                ptr32(ptr32(at)[0])[0] = 0
                at += 4 * SLICE_WORDS
        # The difference is right across the wrap of the clock, and it is looked at only while it
        # is small: failsafe holds until the next control frame.
        if c[LINK] == LINKED and ptr32(c[CLOCK_REGISTER])[0] - c[STAMP] > c[FAILSAFE_US]:
            ptr32(c[MASK_REGISTER])[0] = c[INTERRUPT_BIT]
            # A frame may have come until now.
            if ptr32(c[CLOCK_REGISTER])[0] - c[STAMP] > c[FAILSAFE_US]:
                channels = ptr16(c[PULSES])
                target = c[FAILSAFE_PULSES]
                at = c[FAILSAFE_RULES]
                while at < c[FAILSAFE_RULES_END]:
                    pulse = ptr32(at)[1]
                    if pulse == HOLD:
                        pulse = ptr16(ptr32(at)[0])[0]
                        if pulse == 0:
                            pulse = ptr16(target)[0]
                    ptr16(target)[0] = pulse
                    target += 2
                    at += 4 * _RULE_WORDS
                # Behind all of them: two outputs may follow one channel.
                at = c[FAILSAFE_RULES]
                while at < c[FAILSAFE_RULES_END]:
                    ptr16(ptr32(at)[0])[0] = 0
                    at += 4 * _RULE_WORDS
                index = 0
                while index < 16:
                    channels[index] = 0
                    index += 1
                ptr32(c[MEMORY])[RF_PROTOCOL] = 0
                ptr32(c[LOST])[0] = 1
                c[LINK] = FAILSAFE
                c[FAILSAFES] = c[FAILSAFES] + 1
                c[DRIVE] = 1
                ptr32(c[FORCE_REGISTER])[0] = c[FORCE_BIT]
            ptr32(c[UNMASK_REGISTER])[0] = c[INTERRUPT_BIT]
        link = c[LINK]

        idle = 0
        if c[LOOPS] == c[SEEN_LOOPS]:
            idle = c[IDLE_TICKS] + 1
            if idle == _STUCK_TICKS:
                c[STUCK] = c[STUCK] + 1
        c[SEEN_LOOPS] = c[LOOPS]
        c[IDLE_TICKS] = idle

        # The frame interrupt never leaves as much as a frame unread: if it does, and its place in
        # the ring stands still, it is dead.
        tail = ptr32(c[MEMORY])[TAIL]
        if tail != c[SEEN_TAIL]:
            c[SEEN_TAIL] = tail
            c[UNREAD_TICKS] = 0
        elif (ptr32(c[WRITE_REGISTER])[0] - tail) & 255 >= _FRAME_BYTES:
            c[UNREAD_TICKS] = c[UNREAD_TICKS] + 1
            if c[UNREAD_TICKS] == _UNREAD_LIMIT:
                c[DEAD] = 1
        load = c[WATCHDOG_LOAD]
        if c[DEAD]:
            load = 0
        at = CHECKS
        while at < c[CHECKS_END]:
            if ptr32(c[at])[0] & c[at + 1] != c[at + 1]:
                load = 0
            at += 2
        if idle >= _RESET_TICKS and link != LINKED:
            load = 0
        if load:
            ptr32(c[WATCHDOG_REGISTER])[0] = load

        if c[LED_MASK]:
            pattern = _LED_SEARCHING
            if c[BROKEN]:
                pattern = _LED_BROKEN
            elif idle >= _STUCK_TICKS:
                pattern = _LED_STUCK
            elif link == LINKED:
                pattern = _LED_LINKED
            elif link == FAILSAFE:
                pattern = _LED_FAILSAFE
            ptr32(c[LED_OFF + ((pattern >> ((ticks >> 3) & 15)) & 1)])[0] = c[LED_MASK]

    return on_tick
