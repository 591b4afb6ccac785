"""The module `machine`, on a board of the model."""

from esp32_model.board import CHIPS
from esp32_model.ledc import PWM
from esp32_model.pins import ADC, Pin, make_pad
from esp32_model.timers import WDT, Timer
from esp32_model.uart import UART


class SoftI2C:
    """`SoftI2C(scl, sda, *, freq=400000, timeout=50000)` (machine.I2C.rst). Nobody
    answers on it.
    """

    board = None

    def __init__(self, scl, sda, *, freq=400_000, timeout=50_000):
        if self.board.pad(scl).input_only or self.board.pad(sda).input_only:
            raise ValueError("pin can only be input")
        self.board.pad(scl).take("i2c")
        self.board.pad(sda).take("i2c")

    def writeto(self, addr, buf, stop=True):
        self.board.spend(30.0)
        raise OSError(19)  # ENODEV

    def readfrom_into(self, addr, buf, stop=True):
        self.board.spend(30.0)
        raise OSError(19)


class RTC:
    """`memory([data])` alone (machine.RTC.rst): "persistent across restarts"."""

    board = None

    def memory(self, *data):
        if not data:
            return self.board.rtc_memory
        if len(data[0]) > 2048:
            raise ValueError("buffer too long")
        self.board.rtc_memory = bytes(data[0])
        return None


class Machine:
    """`machine` as far as the firmware uses it; all else is an AttributeError."""

    PWRON_RESET = 1
    HARD_RESET = 2
    WDT_RESET = 3

    def __init__(self, board):
        assert board.chip in CHIPS
        self._board = board
        board.pad = lambda pin: make_pad(board, pin)
        for base in (ADC, PWM, RTC, WDT, Pin, SoftI2C, Timer, UART):
            setattr(self, base.__name__, type(base.__name__, (base,), {"board": board}))

    def reset_cause(self):
        return self.WDT_RESET if self._board.resets else self.PWRON_RESET

    def unique_id(self):
        return b"\x24\x0a\xc4\x00\x01\x02"
