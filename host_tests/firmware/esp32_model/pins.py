"""`machine.Pin` and `machine.ADC` of the ESP32 port, and the pads behind them."""

# What there is of GPIOs (ESP-IDF, GPIO & RTC GPIO), input-only, and on ADC 1.
_MISSING = {"esp32": (20, 24, 28, 29, 30, 31), "esp32s3": (22, 23, 24, 25), "esp32c3": ()}
_LAST = {"esp32": 39, "esp32s3": 48, "esp32c3": 21}
_ADC1 = {"esp32": range(32, 40), "esp32s3": range(1, 11), "esp32c3": range(5)}


class Pad:
    """One pad: what can be seen there.

    `history`: (time in us, what) of each change, what being "input", a level 0 or 1, or
    ("pulses", width in us, period in us).
    """

    def __init__(self, board, number):
        self._board = board
        self.number = number
        self.input_only = board.chip == "esp32" and number >= 34
        self.handler = None
        self.channel = None  # of LEDC
        self.output = 0
        self.driven = False
        self.held = False
        self.use = None
        self.history = [(0.0, "input")]

    def take(self, use):
        """Connects the pad to something else than LEDC or its output register."""
        self.use = use
        self.channel = None

    def show(self):
        """Notes what the pad shows now; while it is held that does not change."""
        if self.held:
            return
        what = self.output if self.driven else "input"
        if self.channel is not None:
            what = self.channel.shows()
        if what != self.history[-1][1]:
            self.history.append((self._board.now_us, what))

    def falling(self):
        self._board.schedule(self.handler, self)

    def since(self, t_us):
        """Everything that was seen from `t_us` on."""
        seen = [what for t, what in self.history if t <= t_us][-1:]
        return seen + [what for t, what in self.history if t > t_us]

    @property
    def now(self):
        return self.history[-1][1]


class Pin:
    """`Pin(id, mode=-1, pull=-1, *, value=None, drive=0, alt=-1)`, says machine.Pin.rst; this port
    has `hold` and no `alt`.
    """

    board = None
    IN = 1
    OUT = 3
    OPEN_DRAIN = 7
    PULL_DOWN = 1
    PULL_UP = 2
    IRQ_RISING = 1
    IRQ_FALLING = 2

    def __init__(self, id, *arguments, **settings):
        self.pad = self.board.pad(id)
        if arguments or settings:
            self.init(*arguments, **settings)

    def init(self, mode=None, pull=-1, *, value=None, drive=None, hold=None):
        pad = self.pad
        self.board.spend(5.0)
        if value is not None:
            pad.output = 1 if value else 0
        if mode is not None:
            if mode not in (self.IN, self.OUT, self.OPEN_DRAIN):
                raise ValueError("invalid mode")
            if pad.input_only and mode != self.IN:
                raise ValueError("pin can only be input")
            pad.take("gpio")
            pad.driven = mode == self.OUT
        if pull not in (-1, None, self.PULL_DOWN, self.PULL_UP) or drive not in (
            None,
            0,
            1,
            2,
            3,
        ):
            raise ValueError("invalid pull or drive")
        # "Setting hold=False will immediately apply any outstanding pin configuration changes
        # and release the pin" (quickref.rst).
        if hold is not None and not pad.input_only:
            pad.held = False
            pad.show()
            pad.held = bool(hold)
        pad.show()

    def value(self, *values):
        board, pad = self.board, self.pad
        if not values:
            board.spend(1.0)
            return board.level if pad.number == board.wire_pad else pad.output
        (value,) = values
        pad.output = 1 if value else 0
        pad.show()
        board.spend(1.0)
        return None

    def irq(self, handler=None, trigger=IRQ_RISING | IRQ_FALLING, wake=None):
        if trigger not in (1, 2, 3) or wake is not None:
            raise ValueError("bad trigger or wake value")
        board = self.board
        board.spend(board.random.uniform(5.0, 15.0))
        self.pad.handler = handler if trigger & self.IRQ_FALLING else None


class ADC:
    """`ADC(pin, *, atten)` (quickref.rst); up to 2.45 V with 11 dB.

    What `read_uv` makes of no step at all (ESP-IDF, "ADC Calibration": line fitting of chips of
    which only the reference is known, curve fitting of the later ones) is its lowest value.
    """

    board = None
    ATTN_0DB = 0
    ATTN_2_5DB = 1
    ATTN_6DB = 2
    ATTN_11DB = 3
    _LIMIT_UV = (950_000, 1_250_000, 1_750_000, 2_450_000)
    _LOWEST_UV = (75_000, 78_000, 107_000, 142_000)

    def __init__(self, pin, *, atten=ATTN_0DB):
        pad = self.board.pad(pin)
        if pad.number not in _ADC1[self.board.chip]:
            raise ValueError("invalid pin")
        self._number = pad.number
        self._limit_uv = self._LIMIT_UV[atten]
        self._lowest_uv = self._LOWEST_UV[atten] if self.board.chip == "esp32" else 0

    def _uv(self):
        self.board.spend(40.0)
        uv = self.board.voltages_uv.get(self._number, 0)
        return min(max(uv, self._lowest_uv), self._limit_uv)

    def read_u16(self):
        range_mv = (self._limit_uv - self._lowest_uv) // 1000
        raw = (self._uv() - self._lowest_uv) // 1000 * 4095 // range_mv
        return raw << 4 | raw >> 8

    def read_uv(self):
        # "will always be a multiple of 1000 microvolts"
        return self._uv() // 1000 * 1000


def make_pad(board, pin):
    """The pad of a GPIO number or a `Pin`."""
    number = pin.pad.number if isinstance(pin, Pin) else pin
    if (
        not isinstance(number, int)
        or not 0 <= number <= _LAST[board.chip]
        or number in _MISSING[board.chip]
    ):
        raise ValueError("invalid pin")
    if number not in board.pads:
        board.pads[number] = Pad(board, number)
    return board.pads[number]
