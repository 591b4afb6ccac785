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
        return _decoder(uctypes.addressof(words), scan)

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


def _decoder(context, scan):
    # fmt: off
    # ruff: noqa: F821 - ptr16, ptr32 and uint are viper's own names
    @micropython.viper
    def decode(memory, pulses) -> int:
        # fmt: on
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
            at = int(context) + 4 * _SHAPES
            while at < c[_END]:
                s = ptr32(at)
                at += 4 * _WORDS
                pulse = ptr16(s[_SOURCE])[0]
                if pulse == 0:
                    pass  # not received, or not again since failsafe
                elif s[_KIND] == _SWITCH:
                    if pulse > s[_DEADBAND]:
                        s[_LAST] = 1
                    elif pulse < s[_GAIN_LOW]:
                        s[_LAST] = 0
                    pulse = s[_MINIMUM]
                    if s[_LAST]:
                        pulse = s[_MAXIMUM]
                else:
                    pulse -= _MIDDLE
                    if pulse < 0:
                        pulse += s[_DEADBAND]
                        if pulse > 0:
                            pulse = 0
                        pulse = pulse * s[_GAIN_LOW]
                    else:
                        pulse -= s[_DEADBAND]
                        if pulse < 0:
                            pulse = 0
                        pulse = pulse * s[_GAIN_HIGH]
                    pulse = ((pulse + 0x8000) >> 16) + s[_CENTRE]
                    if pulse < s[_MINIMUM]:
                        pulse = s[_MINIMUM]
                    elif pulse > s[_MAXIMUM]:
                        pulse = s[_MAXIMUM]
                    if s[_SPEED]:
                        pulse = pulse << 8
                        step = (s[_SPEED] * elapsed) >> 8
                        if s[_LAST]:
                            if pulse > s[_LAST] + step:
                                pulse = s[_LAST] + step
                            elif pulse < s[_LAST] - step:
                                pulse = s[_LAST] - step
                        s[_LAST] = pulse
                        pulse = (pulse + 128) >> 8
                    if s[_KIND] == _MOTOR and armed != _ARMED:
                        pulse = s[_MINIMUM]
                        s[_LAST] = pulse << 8
                ptr16(s[_TARGET])[0] = pulse
        return controls

    return decode
