"""Outputs that do not follow their channel as it is: end points, reverse, speed, motors, switches.

A function of `decoder`'s kind that the frame interrupt calls in its place: it decodes, and makes
of the channels the pulses of these outputs. A board whose outputs are all plain never loads it.
"""

from array import array

import micropython
import uctypes
from micropython import const

from firmware import chip
from firmware.output import OFF, ON
from ghst.decoder import LINK_QUALITY

# Words of the context.
_CLOCK = const(0)  # address of the microsecond clock
_STAMP = const(1)  # that clock at the last control frame
_ARM_CHANNEL = const(2)  # address of its pulse; 0: nothing is ever armed
_THROTTLE = const(3)
_ARM_ABOVE = const(4)
_THROTTLE_LOW = const(5)
_ARM_STATE = const(6)
_LINK = const(7)  # address of link quality and, behind it, RSSI with its sign inverted
_MINIMUM_LQ = const(8)
_MAXIMUM_RSSI = const(9)
_WEAK_FRAMES = const(10)
_END = const(11)
_LOST = const(12)  # 1: the tick has ended the link; 2: it is not back yet
_SHAPES = const(13)

_DISARMED = const(0)
_READY = const(1)  # the arm channel is low, and so is the throttle
_ARMED = const(2)

# Words of a shape.
_SOURCE = const(0)  # addresses: of the channel, of the pulse that comes out, of that in failsafe
_TARGET = const(1)
_FAILSAFE = const(2)
_KIND = const(3)
_DEADBAND = const(4)  # of a switch: above it, it goes on
_GAIN_LOW = const(5)  # of a switch: below it, it goes off
_GAIN_HIGH = const(6)
_CENTRE = const(7)
_MINIMUM = const(8)  # of a switch: the pulse that is off
_MAXIMUM = const(9)  # of a switch: the pulse that is on
_SPEED = const(10)  # 0: any
_LAST = const(11)  # the pulse times 256; of a switch: whether it is on
_WORDS = const(12)

_SERVO = const(0)
_SWITCH = const(1)
_MOTOR = const(2)

_MIDDLE = const(6000)
_ANY_RSSI = const(255)
# A pulse changes for this time at most in one step, 100 ms; the clock is taken in 16 us.
_LONGEST = const(6250)
_COUNTER_MASK = const(0x3FFFFFFF)


class Shapes:
    """Words for the interrupt about all outputs that are not plain, and about arming.

    `pulses`: array of what comes out, one for each output, in the order of `add`.
    """

    def __init__(self, receiver, count):
        """`receiver`: a `ghst.Receiver`; `count`: how many outputs there will be."""
        self.pulses = array("H", [0] * count)
        self._receiver = receiver
        self._words = array("i", [0] * (_SHAPES + _WORDS * count))
        self._count = 0
        words = self._words
        words[_CLOCK] = chip.this_chip().TIMER_RAW_LOW
        words[_LINK] = uctypes.addressof(receiver.memory) + 4 * LINK_QUALITY
        words[_MAXIMUM_RSSI] = _ANY_RSSI

    def add(self, output, failsafe_address):
        """Adds an `Output`; returns the address of its pulse.

        `failsafe_address`: that of the halfword with its failsafe pulse.
        """
        words = self._words
        at = _SHAPES + _WORDS * self._count
        target = uctypes.addressof(self.pulses) + 2 * self._count
        self._count += 1
        words[at + _SOURCE] = self._channel(output.channel)
        words[at + _TARGET] = target
        words[at + _FAILSAFE] = failsafe_address
        if output.switch:
            words[at + _KIND] = _SWITCH
            words[at + _DEADBAND], words[at + _GAIN_LOW] = output.switch
            off_on = (ON, OFF) if output.reverse else (OFF, ON)
            words[at + _MINIMUM], words[at + _MAXIMUM] = off_on
        else:
            words[at + _KIND] = _MOTOR if output.motor else _SERVO
            words[at + _DEADBAND] = output.deadband
            words[at + _GAIN_LOW], words[at + _GAIN_HIGH] = output.gains
            words[at + _CENTRE] = output.centre
            words[at + _MINIMUM], words[at + _MAXIMUM] = output.limits
            # 256ths of a quarter microsecond in 16 us, times 256.
            words[at + _SPEED] = round(output.slow_us_per_s * 4 * 65536 * 16 / 1_000_000)
        words[_END] = uctypes.addressof(words) + 4 * (at + _WORDS)
        return target

    def set_arming(self, channel, throttle_channel, above, throttle_low):
        """Names the channels that arm the motors, and the pulses that decide."""
        self._words[_ARM_CHANNEL] = self._channel(channel)
        self._words[_THROTTLE] = self._channel(throttle_channel)
        self._words[_ARM_ABOVE] = above
        self._words[_THROTTLE_LOW] = throttle_low

    def set_link_limits(self, minimum_lq, minimum_rssi_dbm):
        """Has frames of a weaker link left out, as if they had not come; None: no limit."""
        self._words[_MINIMUM_LQ] = minimum_lq or 0
        self._words[_MAXIMUM_RSSI] = _ANY_RSSI if minimum_rssi_dbm is None else -minimum_rssi_dbm

    def _channel(self, channel):
        return uctypes.addressof(self._receiver.pulses) + 2 * (channel - 1)

    def decoder(self, scan):
        """Returns the function that decodes by `scan` and then works out the pulses."""
        words = self._words
        words[_END] = words[_END] or uctypes.addressof(words) + 4 * _SHAPES
        return _decoder(uctypes.addressof(words), scan, _shape)

    @property
    def lost_address(self):
        """Address of the word that the tick sets when it ends the link."""
        return uctypes.addressof(self._words) + 4 * _LOST

    @property
    def arming(self):
        """Whether there is a channel that arms."""
        return self._words[_ARM_CHANNEL] != 0

    @property
    def armed(self):
        """Whether the motors run."""
        return self._words[_ARM_STATE] == _ARMED

    @property
    def weak_frames(self):
        """Control frames that were left out for a weak link, modulo 2^30."""
        return self._words[_WEAK_FRAMES]


# ruff: noqa: F821 - the words of viper and of the assembler
# fmt: off
@micropython.asm_thumb
def _shape(r0, r1, r2):
    """Works out the pulses of all shapes. r0: the context, r1: time in 16 us, r2: arm state."""
    # By hand, because viper keeps three variables in registers and the rest in memory.
    # r3: the pulse; r6: the end of the shapes; r7: the shape; r0, r4, r5: whatever is needed.
    ldr(r6, [r0, 4 * _END])
    mov(r7, r0)
    add(r7, 4 * _SHAPES)
    label(NEXT)
    cmp(r7, r6)
    bcs(END)
    ldr(r3, [r7, 4 * _SOURCE])
    ldrh(r3, [r3, 0])
    cmp(r3, 0)                      # not received, or not again since failsafe
    beq(STORE)
    ldr(r4, [r7, 4 * _KIND])
    cmp(r4, _SWITCH)
    beq(SWITCH)

    mov(r5, _MIDDLE // 32)
    lsl(r5, r5, 5)
    add(r5, _MIDDLE % 32)
    sub(r3, r3, r5)
    ldr(r5, [r7, 4 * _DEADBAND])
    cmp(r3, 0)
    blt(BELOW)
    ldr(r4, [r7, 4 * _GAIN_HIGH])
    sub(r3, r3, r5)
    bge(SCALE)
    mov(r3, 0)
    b(SCALE)
    label(BELOW)
    ldr(r4, [r7, 4 * _GAIN_LOW])
    add(r3, r3, r5)
    cmp(r3, 0)
    ble(SCALE)
    mov(r3, 0)
    label(SCALE)
    mul(r3, r4)
    mov(r5, 1)
    lsl(r5, r5, 15)
    add(r3, r3, r5)
    asr(r3, r3, 16)
    ldr(r5, [r7, 4 * _CENTRE])
    add(r3, r3, r5)
    ldr(r5, [r7, 4 * _MINIMUM])
    cmp(r3, r5)
    bge(NOT_SHORT)
    mov(r3, r5)
    label(NOT_SHORT)
    ldr(r5, [r7, 4 * _MAXIMUM])
    cmp(r3, r5)
    ble(NOT_LONG)
    mov(r3, r5)
    label(NOT_LONG)

    ldr(r5, [r7, 4 * _SPEED])
    cmp(r5, 0)
    beq(MOTOR)
    mul(r5, r1)
    lsr(r5, r5, 8)
    lsl(r3, r3, 8)
    ldr(r4, [r7, 4 * _LAST])
    cmp(r4, 0)
    beq(REACHED)
    add(r0, r4, r5)
    cmp(r3, r0)
    bgt(TOO_FAST)
    sub(r0, r4, r5)
    cmp(r3, r0)
    bge(REACHED)
    label(TOO_FAST)
    mov(r3, r0)
    label(REACHED)
    str(r3, [r7, 4 * _LAST])
    add(r3, 128)
    lsr(r3, r3, 8)

    label(MOTOR)
    ldr(r4, [r7, 4 * _KIND])
    cmp(r4, _MOTOR)
    bne(STORE)
    cmp(r2, _ARMED)
    beq(STORE)
    ldr(r3, [r7, 4 * _MINIMUM])
    lsl(r5, r3, 8)
    str(r5, [r7, 4 * _LAST])
    b(STORE)

    label(SWITCH)
    ldr(r4, [r7, 4 * _LAST])
    ldr(r5, [r7, 4 * _DEADBAND])
    cmp(r3, r5)
    ble(NOT_ON)
    mov(r4, 1)
    label(NOT_ON)
    ldr(r5, [r7, 4 * _GAIN_LOW])
    cmp(r3, r5)
    bge(NOT_OFF)
    mov(r4, 0)
    label(NOT_OFF)
    str(r4, [r7, 4 * _LAST])
    ldr(r3, [r7, 4 * _MINIMUM])
    cmp(r4, 0)
    beq(STORE)
    ldr(r3, [r7, 4 * _MAXIMUM])

    label(STORE)
    ldr(r5, [r7, 4 * _TARGET])
    strh(r3, [r5, 0])
    add(r7, 4 * _WORDS)
    b(NEXT)
    label(END)
# fmt: on


def _decoder(context, scan, shape):
    @micropython.viper
    def decode(memory, pulses) -> int:
        controls = int(scan(memory, pulses))
        c = ptr32(int(context))
        link = ptr32(c[_LINK])
        # Nothing of it is known before the first link data.
        if link[0] | link[1] and (link[0] < c[_MINIMUM_LQ] or link[1] > c[_MAXIMUM_RSSI]):
            c[_WEAK_FRAMES] = (c[_WEAK_FRAMES] + controls) & _COUNTER_MASK
            controls = 0
        if c[_LOST] == 1:
            # The way back begins at what failsafe gives, and nothing is armed.
            c[_LOST] = 2
            c[_ARM_STATE] = _DISARMED
            at = int(context) + 4 * _SHAPES
            while at < c[_END]:
                s = ptr32(at)
                at += 4 * _WORDS
                if s[_KIND] != _SWITCH:
                    s[_LAST] = ptr16(s[_FAILSAFE])[0] << 8
        if controls:
            now = ptr32(c[_CLOCK])[0]
            elapsed = int(uint(now - c[_STAMP]) >> 4)
            c[_STAMP] = now
            if elapsed > _LONGEST:
                elapsed = _LONGEST
            if c[_LOST]:
                c[_LOST] = 0
                elapsed = 0
            armed = _DISARMED
            if c[_ARM_CHANNEL]:
                armed = c[_ARM_STATE]
                pulse = ptr16(c[_ARM_CHANNEL])[0]
                throttle = ptr16(c[_THROTTLE])[0]
                if pulse == 0 or throttle == 0:
                    armed = _DISARMED
                elif pulse <= c[_ARM_ABOVE]:
                    armed = _READY
                    if throttle > c[_THROTTLE_LOW]:
                        armed = _DISARMED
                elif armed == _READY:
                    armed = _ARMED
                    if throttle > c[_THROTTLE_LOW]:
                        armed = _DISARMED
                c[_ARM_STATE] = armed
            shape(int(context), elapsed, armed)
        return controls

    return decode
