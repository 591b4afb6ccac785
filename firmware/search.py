"""`Search`: looks for the sensors that are not there yet, with little code and memory.

What measures is loaded when there is something to measure: a voltage, a byte, an I2C address that
answers.
"""

import errno

from micropython import const

# Of 65536: 26 mV at the pin, which is 0.3 V of a battery behind a divider of 11, or 0.6 A.
_LEVEL = const(512)
_FIRST_PAUSE_MS = const(100)
_LONGEST_PAUSE_MS = const(5000)
_TIME_MASK = const(0x3FFFFFFF)


class Search:
    """Sensors that have not answered.

    `waiting`: {name: (probe, arguments)} as `firmware.devices` has them. A probe is a list of ADC
    inputs, a UART, an I2C controller and addresses, or None for a sensor to be taken as there.
    `pause_ms`: doubles with each round, so it is 3.2 s or more once the search has lasted for 3 s.
    """

    def __init__(self, waiting):
        self.waiting = waiting
        self.bus = None  # an `I2cBus`, once that is loaded
        self._asked_ms = 0
        self.pause_ms = _FIRST_PAUSE_MS

    def update(self, now_ms):
        """Returns the name of a sensor that is there, None if there is none; takes 2 ms at most.

        I2C addresses are asked after 100 ms, 200 ms and so on up to 5 s.
        """
        asks = (now_ms - self._asked_ms) & _TIME_MASK >= self.pause_ms
        for name in self.waiting:
            probe = self.waiting[name][0]
            if probe is None:
                return name
            if type(probe) is list:
                for adc in probe:
                    if adc.read_u16() > _LEVEL:
                        return name
            elif type(probe) is not tuple:
                if probe.any():
                    return name
            elif asks and self._answers(now_ms, *probe):
                return name
        if asks:
            self._asked_ms = now_ms & _TIME_MASK
            self.pause_ms = min(2 * self.pause_ms, _LONGEST_PAUSE_MS)
        return None

    def _answers(self, now_ms, i2c, addresses):
        if self.bus and not self.bus.ready(now_ms):
            return False
        for address in addresses:
            try:
                # The register's number alone: to read one might take a measurement away.
                if i2c.writeto(address, b"\0"):
                    return True
            except OSError as error:
                # A bus that hangs is one with something on it, which the sensor will free.
                if error.errno == errno.ETIMEDOUT and not self.bus:
                    return True
        return False
