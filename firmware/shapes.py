"""Outputs that do not follow their channel as it is: end points, reverse, speed, motors, switches.

The frame interrupt calls a function `shape` behind the decoder, which makes of the channels the
pulses of these outputs: that of `firmware.shape_thumb` on Arm cores, else that of
`firmware.shape_viper`. A board whose outputs are all plain loads none of it.
"""

from array import array

import uctypes
from micropython import const

from firmware.output import OFF, ON
from ghst.decoder import LINK_QUALITY

# Words of the context.
CONTROLS = const(0)  # control frames just decoded; none are left of those of a weak link
CLOCK = const(1)  # address of the microsecond clock
STAMP = const(2)  # that clock at the last control frame
LINK_LOST = const(3)  # set by the tick when it ends the link
SERVOS = const(4)  # addresses: of the first servo, or of the first motor while armed;
SWITCHES = const(5)  # of the first switch,
MOTORS = const(6)  # of the first motor,
MOTORS_LINK = const(7)  # and of the word that leads to the motors from the servos
ARM_CHANNEL = const(8)  # address of its pulse; 0: nothing is ever armed
THROTTLE = const(9)
ARM_ABOVE = const(10)
THROTTLE_LOW = const(11)
ARM_STATE = const(12)
LINK_WORDS = const(13)  # address of link quality and, behind it, RSSI with its sign inverted; or 0
MINIMUM_LQ = const(14)
MAXIMUM_RSSI = const(15)
WEAK_FRAMES = const(16)
CHANNELS = const(17)  # address of the pulses of all channels
FIRST_SHAPE = const(18)

DISARMED = const(0)
READY = const(1)  # the arm channel is low, and so is the throttle
ARMED = const(2)

# Words of a shape. Pulses but the centre's are times 65536, what the gains make of them.
NEXT = const(0)  # addresses: of the next of its kind, or 0; of the channel, of the pulse that
SOURCE = const(1)  # comes out, of that in failsafe
TARGET = const(2)
FAILSAFE_PULSE = const(3)
GAIN_HIGH = const(4)  # pulse = channel, less the middle, times gain, plus offset
OFFSET_HIGH = const(5)
GAIN_LOW = const(6)  # the same below the middle
OFFSET_LOW = const(7)
DEADBAND = const(8)
TWICE_DEADBAND = const(9)
CENTRE = const(10)
MINIMUM = const(11)
RANGE = const(12)
SPEED = const(13)  # in 16 us; 0: any
LAST = const(14)  # the pulse; 0: none yet
SHAPE_WORDS = const(15)
# Words of a switch.
IS_ON = const(4)  # whether it is on
ABOVE = const(5)  # above it, it goes on
BELOW = const(6)  # below it, it goes off
OFF_PULSE = const(7)
ON_PULSE = const(8)

MIDDLE = const(6000)
_HALF = const(0x8000)
_ANY_RSSI = const(255)
# A pulse changes for this time at most in one step, 100 ms; the clock is taken in 16 us.
LONGEST = const(6250)
COUNTER_MASK = const(0x3FFFFFFF)


class Shapes:
    """Words for the interrupt about all outputs that are not plain, and about arming.

    `pulses`: array of what comes out, one for each output, in the order of `add`. `address`: of
    the words, for the frame interrupt.
    """

    def __init__(self, receiver, count, clock):
        """`receiver`: a `ghst.Receiver`; `count`: how many outputs there will be; `clock`: address
        of a word that counts microseconds.
        """
        self.pulses = array("H", [0] * count)
        self._receiver = receiver
        self._words = array("i", [0] * (FIRST_SHAPE + SHAPE_WORDS * count))
        self._count = 0
        self.address = uctypes.addressof(self._words)
        self._words[CLOCK] = clock
        # Until the first frame there is no link either.
        self._words[LINK_LOST] = 1
        self._words[CHANNELS] = self._channel(1)
        self._words[MOTORS_LINK] = self.address + 4 * SERVOS

    def add(self, output, failsafe_address):
        """Adds an `Output`; returns the address of its pulse.

        `failsafe_address`: that of the halfword with its failsafe pulse.
        """
        words = self._words
        at = FIRST_SHAPE + SHAPE_WORDS * self._count
        target = uctypes.addressof(self.pulses) + 2 * self._count
        self._count += 1
        words[at + SOURCE] = self._channel(output.channel)
        words[at + TARGET] = target
        if output.switch:
            self._link(SWITCHES, at)
            words[at + ABOVE], words[at + BELOW] = output.switch
            off_on = (ON, OFF) if output.reverse else (OFF, ON)
            words[at + OFF_PULSE], words[at + ON_PULSE] = off_on
            return target
        if output.motor:
            self._link(MOTORS, at)
        else:
            if not words[SERVOS]:
                words[MOTORS_LINK] = self.address + 4 * (at + NEXT)
            self._link(SERVOS, at)
        words[at + FAILSAFE_PULSE] = failsafe_address
        low, high = output.gains
        centre = (output.centre << 16) + _HALF
        words[at + GAIN_HIGH] = high
        words[at + OFFSET_HIGH] = centre - output.deadband * high
        words[at + GAIN_LOW] = low
        words[at + OFFSET_LOW] = centre + output.deadband * low
        words[at + DEADBAND] = output.deadband
        words[at + TWICE_DEADBAND] = 2 * output.deadband
        words[at + CENTRE] = centre
        shortest, longest = output.limits
        words[at + MINIMUM] = shortest << 16
        words[at + RANGE] = (longest - shortest) << 16
        words[at + SPEED] = round(output.slow_us_per_s * 4 * 65536 * 16 / 1_000_000)
        return target

    def _link(self, head, at):
        """Puts the shape at word `at` in front of the others of its kind."""
        self._words[at + NEXT] = self._words[head]
        self._words[head] = self.address + 4 * at

    def set_arming(self, channel, throttle_channel, above, throttle_low):
        """Names the channels that arm the motors, and the pulses that decide."""
        self._words[ARM_CHANNEL] = self._channel(channel)
        self._words[THROTTLE] = self._channel(throttle_channel)
        self._words[ARM_ABOVE] = above
        self._words[THROTTLE_LOW] = throttle_low

    def set_link_limits(self, minimum_lq, minimum_rssi_dbm):
        """Has frames of a weaker link left out, as if they had not come; None: no limit."""
        words = self._words
        words[LINK_WORDS] = uctypes.addressof(self._receiver.memory) + 4 * LINK_QUALITY
        words[MINIMUM_LQ] = minimum_lq or 0
        words[MAXIMUM_RSSI] = _ANY_RSSI if minimum_rssi_dbm is None else -minimum_rssi_dbm

    def _channel(self, channel):
        return uctypes.addressof(self._receiver.pulses) + 2 * (channel - 1)

    def run(self, shape, context, frames):
        """Has the function `shape` work behind `frames` control frames, as the frame interrupt
        does; returns how many of them count. `context`: what `shape` takes.
        """
        self._words[CONTROLS] = frames
        shape(context)
        return self._words[CONTROLS]

    def lose(self):
        """Ends the link, as the tick does by `lost_address`."""
        self._words[LINK_LOST] = 1

    @property
    def lost_address(self):
        """Address of the word that the tick sets when it ends the link."""
        return self.address + 4 * LINK_LOST

    @property
    def arming(self):
        """Whether there is a channel that arms."""
        return self._words[ARM_CHANNEL] != 0

    @property
    def armed(self):
        """Whether the motors run."""
        return self._words[ARM_STATE] == ARMED and not self._words[LINK_LOST]

    @property
    def weak_frames(self):
        """Control frames that were left out for a weak link, modulo 2^30."""
        return self._words[WEAK_FRAMES]
