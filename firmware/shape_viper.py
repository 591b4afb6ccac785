"""`shape` for cores without an assembler of ours: the pulses of `firmware.shapes`."""

import micropython

from firmware import shapes as word
from firmware.limits import SHAPES


# ruff: noqa: F821 - ptr16, ptr32 and uint are viper's own names
@micropython.viper
def shape(x: int):
    """Works out the pulses of all shapes from the channels, behind control frames.

    `x`: address of the frame interrupt's words. The first two variables stand in registers, all
    others in memory: so these two are what the loops use most.
    """
    s = ptr32(x)
    s = ptr32(s[SHAPES])
    context = s
    if s[word.LINK_WORDS]:
        link = ptr32(s[word.LINK_WORDS])
        # Nothing of it is known before the first link data.
        if link[0] | link[1] and (link[0] < s[word.MINIMUM_LQ] or link[1] > s[word.MAXIMUM_RSSI]):
            s[word.WEAK_FRAMES] = (s[word.WEAK_FRAMES] + s[word.CONTROLS]) & word.COUNTER_MASK
            s[word.CONTROLS] = 0
            if s[word.LINK_LOST]:
                # What failsafe has emptied stays that: nothing comes back with a value from here.
                s = ptr32(s[word.CHANNELS])
                x = 0
                while x < 8:
                    s[x] = 0
                    x += 1
            return
    x = ptr32(s[word.CLOCK])[0]
    elapsed = int(uint(x - s[word.STAMP]) >> 4)
    s[word.STAMP] = x
    if elapsed > word.LONGEST:
        elapsed = word.LONGEST
    if s[word.LINK_LOST]:
        # The way back begins at what failsafe gives, and nothing is armed.
        s[word.LINK_LOST] = 0
        s[word.ARM_STATE] = word.DISARMED
        elapsed = 0
        s = ptr32(s[word.SERVOS])
        while int(s):
            s[word.LAST] = ptr16(s[word.FAILSAFE_PULSE])[0] << 16
            s = ptr32(s[word.NEXT])
        s = context
    armed = word.DISARMED
    if s[word.ARM_CHANNEL]:
        x = ptr16(s[word.ARM_CHANNEL])[0]
        throttle = ptr16(s[word.THROTTLE])[0]
        if x and throttle:
            armed = s[word.ARM_STATE]
            if x <= s[word.ARM_ABOVE]:
                armed = word.READY
            elif armed == word.READY:
                armed = word.ARMED
            else:
                throttle = 0
            if throttle > s[word.THROTTLE_LOW]:
                armed = word.DISARMED
        s[word.ARM_STATE] = armed
    x = s[word.MOTORS]
    if x:
        if armed != word.ARMED:
            x = 0
        ptr32(s[word.MOTORS_LINK])[0] = x
        if x == 0:
            s = ptr32(s[word.MOTORS])
            while int(s):
                x = ptr16(s[word.SOURCE])[0]
                if x:
                    x = s[word.MINIMUM]
                    s[word.LAST] = x
                    x = x >> 16
                ptr16(s[word.TARGET])[0] = x
                s = ptr32(s[word.NEXT])
            s = context
    s = ptr32(s[word.SERVOS])
    while int(s):
        x = ptr16(s[word.SOURCE])[0]
        # Zero: not received, or not again since failsafe.
        if x:
            x -= word.MIDDLE
            if uint(x + s[word.DEADBAND]) <= uint(s[word.TWICE_DEADBAND]):
                x = s[word.CENTRE]
            elif x >> 31:
                x = x * s[word.GAIN_LOW] + s[word.OFFSET_LOW]
            else:
                x = x * s[word.GAIN_HIGH] + s[word.OFFSET_HIGH]
            if uint(x - s[word.MINIMUM]) > uint(s[word.RANGE]):
                limit = s[word.MINIMUM]
                if x > limit:
                    limit += s[word.RANGE]
                x = limit
            if s[word.SPEED]:
                if s[word.LAST]:
                    step = s[word.SPEED] * elapsed
                    x -= s[word.LAST]
                    if x > step:
                        x = step
                    elif x < 0 - step:
                        x = 0 - step
                    x += s[word.LAST]
                s[word.LAST] = x
            x = x >> 16
        ptr16(s[word.TARGET])[0] = x
        s = ptr32(s[word.NEXT])
    s = ptr32(context[word.SWITCHES])
    while int(s):
        x = ptr16(s[word.SOURCE])[0]
        if x:
            if x > s[word.ABOVE]:
                s[word.IS_ON] = 1
            elif x < s[word.BELOW]:
                s[word.IS_ON] = 0
            x = s[word.OFF_PULSE]
            if s[word.IS_ON]:
                x = s[word.ON_PULSE]
        ptr16(s[word.TARGET])[0] = x
        s = ptr32(s[word.NEXT])
