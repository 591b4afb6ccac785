# only on esp32
"""An ADC input of the ESP32 family, linear and of 3.3 V as it is on other chips.

`read_uv` goes by what the chip's maker has measured and burnt into each of them; `read_u16` gives
a bent line (MicroPython, quick reference of the ESP32, ADC). With 11 dB of attenuation it reads up
to 2.45 V, 3.1 V on the S3; what is above reads as that.
"""

import machine

_FULL_SCALE_UV = 3_300_000


class CalibratedAdc:
    """`read_u16` of a `machine.ADC`, made of microvolts."""

    def __init__(self, pin):
        """`pin`: GPIO number of a pin of ADC 1; raises `ValueError` for another."""
        adc = machine.ADC(machine.Pin(pin), atten=machine.ADC.ATTN_11DB)
        self._read_uv = adc.read_uv

    def read_u16(self):
        """Returns the voltage as a 65535th of 3.3 V."""
        value = self._read_uv() // 100 * 65535 // (_FULL_SCALE_UV // 100)
        return value if value < 65535 else 65535
