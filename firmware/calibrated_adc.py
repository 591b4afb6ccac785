# only on esp32
"""An ADC input of the ESP32 family, linear and of 3.3 V as it is on other chips.

`read_uv` goes by what the chip's maker has measured and burnt into each of them; `read_u16` gives
a bent line (MicroPython, quick reference of the ESP32, ADC). With 11 dB of attenuation it reads up
to 2.45 V, 3.1 V on the S3; what is above reads as the end of the range.

Of a pin at 0 V, `read_uv` says up to 142 mV on an ESP32: it adds what its line begins with to no
step at all (ESP-IDF, line fitting of `esp_adc`). So at both ends the steps themselves are asked.
"""

import machine

_FULL_SCALE_MV = 3300
# No line begins above the one, none ends below the other.
_LOW_UV = 200_000
_HIGH_UV = 2_400_000


class CalibratedAdc:
    """`read_u16` of a `machine.ADC`, made of microvolts."""

    def __init__(self, pin):
        """`pin`: GPIO number of a pin of ADC 1; raises `ValueError` for another."""
        adc = machine.ADC(machine.Pin(pin), atten=machine.ADC.ATTN_11DB)
        self._read_uv = adc.read_uv
        self._read_steps = adc.read_u16

    def read_u16(self):
        """Returns the voltage as a 65535th of 3.3 V; 0 and 65535 at the ends of the range."""
        uv = self._read_uv()
        if not _LOW_UV < uv < _HIGH_UV:
            steps = self._read_steps()
            if steps == 0 or steps == 65535:
                return steps
        # It has whole millivolts only; of microvolts this were no small integer.
        value = uv // 1000 * 65535 // _FULL_SCALE_MV
        return value if value < 65535 else 65535
