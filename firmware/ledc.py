# only on esp32
"""Servo outputs on the ESP32 family: pulses by LEDC, the chip's PWM, through `machine.PWM`.

LEDC takes a new duty over at the end of a period, so a pulse is never cut short or doubled. It
divides 80 MHz by 256ths and counts a power of two of steps in a period: 2^20 at most on the ESP32,
2^14 on the others (ESP-IDF, LED Control; `ledc_find_suitable_duty_resolution`). The period is not
quite 1/frequency therefore, but a pulse is counted in the steps that there really are. MicroPython
takes a duty of 16 bits: at 50 Hz a step is 0.31 us on the ESP32, 1.22 us on the S3 and the C3.
"""

import time
from array import array

import machine
import micropython
import uctypes
from micropython import const

from firmware.limits import HOLD, MAXIMUM, MINIMUM, SHAPES
from firmware.output import by_pin, shapes

_CLOCK_HZ = 80_000_000
# Clocks in a quarter microsecond, times 256.
_CLOCKS = const(5120)
_MIDDLE = const(6000)
# Two periods of 50 Hz: until a new duty is at the pin.
_SETTLE_MS = const(41)


class LedcOutputs:
    """The outputs of a board, what each of them follows, and what it does in failsafe.

    `pins`: the GPIO numbers, rising; `shown`: what each of them was given, as a pulse of a servo.
    `shapes`: `Shapes` if there are outputs that are not plain, else None. A switch is a plain pin
    and takes no channel of LEDC, which could not give a level without a notch in each period.
    """

    def __init__(
        self, channels, receiver, *, most_bits, failsafe=None, arming=None, link_limits=None
    ):
        """Drives the pins low, whatever was on them before: a reset leaves LEDC running.

        `most_bits`: 20 on the ESP32, else 14. The rest is as `firmware.outputs.ServoOutputs` has
        it. Raises `ValueError` for what LEDC has no channels or timers for. Takes 40 ms.
        """
        outputs = by_pin(channels, failsafe or {})
        self.pins = sorted(outputs)
        # Held: a new `PWM` gives 50 % for a period, whatever duty it is made with.
        held = [machine.Pin(pin, machine.Pin.OUT, value=0, hold=True) for pin in self.pins]
        self._clock = array("I", [0])
        self._ticks_us = time.ticks_us()
        clock = uctypes.addressof(self._clock)
        self.shapes = shapes(outputs, receiver, clock, arming, link_limits)
        if self.shapes:
            from firmware.shape_viper import shape

            self._shape = shape
            # As much of the frame interrupt's words as `shape` looks at.
            self._context = array("i", [0] * (SHAPES + 1))
            self._context[SHAPES] = self.shapes.address
            self._context_address = uctypes.addressof(self._context)
        self._failsafe = array("H", [0] * len(held))
        self.shown = array("H", [0] * len(held))
        self._pwm = []
        self._rows = []
        self._rules = []
        try:
            for index, pin in enumerate(self.pins):
                self._add(outputs[pin], index, held[index], receiver, most_bits)
        finally:
            if self._pwm:
                time.sleep_ms(_SETTLE_MS)
            for pin in held:
                pin.init(hold=False)

    def _add(self, output, index, pin, receiver, most_bits):
        pulses, at = receiver.pulses, output.channel - 1
        self._rules.append((pulses, at, output.failsafe))
        if output.shaped:
            failsafe = uctypes.addressof(self._failsafe) + 2 * index
            target = self.shapes.add(output, failsafe)
            pulses = self.shapes.pulses
            at = (target - uctypes.addressof(pulses)) // 2
            self._rules[-1] = (pulses, at, output.failsafe)
        if output.switch:
            # Off before its channel has come: zero would be no known level.
            self._failsafe[index] = self.shown[index] = MINIMUM
            self._rows.append((pulses, at, pin.value, 0, 0))
            return
        unit, shift = _unit(output.frequency_hz, most_bits)
        pwm = machine.PWM(pin, freq=output.frequency_hz, duty_u16=0)
        self._pwm.append(pwm)
        self._rows.append((pulses, at, pwm.duty_u16, unit * output.shortened, shift))

    def shape(self, frames):
        """Works the shaped outputs out behind `frames` control frames; returns how many count."""
        if not self.shapes:
            return frames
        # `ticks_us` wraps at 2^30, the clock of the shapes at 2^32.
        now_us = time.ticks_us()
        elapsed_us = time.ticks_diff(now_us, self._ticks_us)
        self._ticks_us = now_us
        advance(self._clock, elapsed_us)
        return self.shapes.run(self._shape, self._context_address, frames)

    @property
    def armed(self):
        """Whether motors run, where something arms them; else always."""
        return self.shapes is None or not self.shapes.arming or self.shapes.armed

    def write(self):
        """Gives each output the pulse of its channel, or of failsafe while that has not come."""
        failsafe = self._failsafe
        shown = self.shown
        index = -1
        # Without `enumerate`, which takes memory: there may be none left.
        for row in self._rows:
            index += 1
            pulses, at, give, unit, shift = row
            pulse = pulses[at]
            if pulse == 0:
                pulse = failsafe[index]
            if pulse > MAXIMUM:
                pulse = MAXIMUM
            elif pulse < MINIMUM and pulse != 0:
                pulse = MINIMUM
            if pulse != shown[index]:
                if unit:
                    give((pulse * _CLOCKS + (unit >> 1)) // unit << shift)
                else:
                    give(pulse > _MIDDLE)
                shown[index] = pulse

    def lose(self):
        """Has each output do what its failsafe says, until its channel has come again."""
        failsafe = self._failsafe
        index = -1
        for row in self._rules:
            index += 1
            pulses, at, rule = row
            failsafe[index] = (pulses[at] or failsafe[index]) if rule == HOLD else rule
        # Behind all of them: two outputs may follow one channel.
        for row in self._rules:
            pulses, at, rule = row
            pulses[at] = 0
        if self.shapes:
            self.shapes.lose()

    def off(self):
        """Ends the pulses, a running one is finished; switches go off."""
        for row in self._rows:
            try:
                row[2](0)
            except RuntimeError:
                continue  # somebody has switched this one off already

    def stop(self):
        """Ends the pulses and drives the pins low; may be called again."""
        if self._pwm:
            self.off()
            time.sleep_ms(_SETTLE_MS)
        # Held: a pin that `deinit` has let go of is driven by nobody.
        for pin in self.pins:
            machine.Pin(pin, machine.Pin.OUT, value=0, hold=True)
        while self._pwm:
            self._pwm.pop().deinit()
        for pin in self.pins:
            machine.Pin(pin, machine.Pin.OUT, value=0, hold=False)


@micropython.viper
def advance(clock: ptr32, elapsed_us: int):  # noqa: F821 - viper's own name
    """Adds to the word in an array; it wraps at 32 bits, and no number beyond 30 takes memory."""
    clock[0] += elapsed_us


def _unit(hertz, most_bits):
    """Returns clocks in a step of the duty, times 256, and the bits of a duty that are left out.

    The divider and the number of steps are those that the ESP-IDF chooses for a frequency.
    """
    bits = 0
    while bits < most_bits and (_CLOCK_HZ + hertz // 2) // hertz >> bits + 1:
        bits += 1
    steps = hertz << bits
    divider = ((_CLOCK_HZ << 8) + steps // 2) // steps
    return divider << max(0, bits - 16), max(0, 16 - bits)
