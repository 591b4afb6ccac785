"""`Output`: what one output makes of its channel.

All pulses are in quarter microseconds of a servo: those of a kind that is shorter (a 760 us servo
by two, OneShot125 by eight) are made shorter by the PWM alone.
"""

from micropython import const

from firmware.limits import HOLD, MAXIMUM, MINIMUM, NONE

# The middle and both ends of a stick: 1500, 988 and 2012 us.
_CENTRE = const(6000)
_LOW = const(3952)
_HIGH = const(8048)
_TRAVEL = const(2048)
# A switch is a pulse that is never or always high: what lies between them is lost.
OFF = MINIMUM
ON = MAXIMUM


class Output:
    """A servo, a motor or a switch on one pin."""

    def __init__(
        self,
        channel,
        *,
        failsafe=NONE,
        frequency_hz=50,
        shortened=1,
        low=_LOW,
        centre=_CENTRE,
        high=_HIGH,
        limits=(MINIMUM, MAXIMUM),
        reverse=False,
        deadband=0,
        slow_us_per_s=0,
        motor=False,
        switch=None,
    ):
        """`channel`: 1..16. `failsafe`: HOLD, NONE or a pulse. `shortened`: 1, 2 or 8.

        `low`, `centre`, `high`: pulses for the ends and the middle of the stick, rising;
        `limits`: the shortest and the longest; `reverse` turns the stick. `deadband`: travel
        around the middle that moves nothing, as pulses. `motor`: stays at the shortest pulse
        until armed. `switch`: None, or (on above, off below) in pulses: then the pin is high or
        low, and `failsafe` is ON, OFF, HOLD or NONE. Raises `ValueError` for what cannot be.
        """
        if not 1 <= channel <= 16:
            raise ValueError(f"channel is {channel}, must be 1..16")
        if failsafe not in (NONE, HOLD) and not MINIMUM <= failsafe <= MAXIMUM:
            raise ValueError(f"failsafe is {failsafe / 4} us, must be 800..2200")
        if not 50 <= frequency_hz <= 400:
            raise ValueError(f"frequency is {frequency_hz} Hz, must be 50..400")
        if shortened not in (1, 2, 8):
            raise ValueError(f"shortened is {shortened}, must be 1, 2 or 8")
        if not MINIMUM <= limits[0] <= limits[1] <= MAXIMUM or not low < centre < high:
            raise ValueError(f"pulses {low}, {centre}, {high} in {limits} are no travel")
        if not 0 <= deadband <= _TRAVEL // 2 or not 0 <= slow_us_per_s <= 80_000:
            raise ValueError(f"deadband {deadband} or speed {slow_us_per_s} cannot be")
        self.channel = channel
        self.failsafe = failsafe
        self.frequency_hz = frequency_hz
        self.shortened = shortened
        self.low = low
        self.centre = centre
        self.high = high
        self.limits = limits
        self.reverse = reverse
        self.deadband = deadband
        self.slow_us_per_s = slow_us_per_s
        self.motor = motor
        self.switch = switch
        self.shaped = False
        if motor and reverse:
            raise ValueError("a motor cannot be reversed: it would start at its maximum")
        if motor:
            self.failsafe = limits[0]
        elif switch and failsafe == NONE:
            self.failsafe = OFF

    @property
    def plain(self):
        """Whether the pulse is the channel's as it is."""
        return (
            (self.low, self.centre, self.high) == (_LOW, _CENTRE, _HIGH)
            and self.limits == (MINIMUM, MAXIMUM)
            and not (self.reverse or self.deadband or self.slow_us_per_s)
            and not (self.motor or self.switch)
        )

    @property
    def gains(self):
        """Pulse change per channel change below and above the middle, times 65536."""
        low, high = (self.high, self.low) if self.reverse else (self.low, self.high)
        travel = _TRAVEL - self.deadband
        return (
            round((self.centre - low) * 65536 / travel),
            round((high - self.centre) * 65536 / travel),
        )


def by_pin(channels, failsafe):
    """Returns {GPIO: `Output`} of {GPIO: `Output` or channel 1..16}; raises `ValueError`.

    `failsafe`: {GPIO: HOLD, NONE or a pulse} of those given as a channel.
    """
    for pin in failsafe:
        if pin not in channels:
            raise ValueError(f"failsafe names GP{pin}, which is no servo output")
    outputs = {}
    for pin, output in channels.items():
        if isinstance(output, int):
            try:
                output = Output(output, failsafe=failsafe.get(pin, 0))
            except ValueError as error:
                raise ValueError(f"GP{pin}: {error}") from None
        outputs[pin] = output
    return outputs


def shapes(outputs, receiver, clock, arming, link_limits):
    """Returns the `Shapes` for those of `outputs` that are not plain, None if there is no need.

    `outputs`: {GPIO: `Output`}; `clock`: address of a word that counts microseconds; `arming`,
    `link_limits`: None or the arguments of `Shapes.set_arming` and `Shapes.set_link_limits`. Sets
    `shaped` of each output: whether its pulse is to come from the shapes.
    """
    count = 0
    for output in outputs.values():
        # The channels have what weak frames brought as well; what comes out of the shapes has not.
        output.shaped = link_limits is not None or not output.plain
        count += output.shaped
    if not count and link_limits is None:
        return None
    from firmware.shapes import Shapes

    shapes = Shapes(receiver, count, clock)
    if arming:
        shapes.set_arming(*arming)
    if link_limits:
        shapes.set_link_limits(*link_limits)
    return shapes
