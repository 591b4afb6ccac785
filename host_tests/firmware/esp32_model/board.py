"""The chip, its time and its scheduler, and the half-duplex wire with a receiver on it."""

import heapq

BAUD = 420_000
BYTE_US = 10e6 / BAUD
_WRAP = 1 << 30
_QUEUE_LENGTH = 8  # MICROPY_SCHEDULER_DEPTH in ports/esp32/mpconfigport.h

CHIPS = {
    # groups, channels and timers of a group (quickref.rst, PWM), bits of a duty, timers, UARTs
    "esp32": (2, 8, 4, 20, 4, 3),
    "esp32s3": (1, 8, 4, 14, 4, 3),
    "esp32c3": (1, 6, 4, 14, 2, 2),
}


class ChipReset(BaseException):
    """What the watchdog does to the program."""


class Random:
    """The same numbers on both interpreters."""

    def __init__(self, seed):
        self._state = seed * 2654435761 & 0x7FFFFFFF | 1

    def random(self):
        self._state = self._state * 48271 % 0x7FFFFFFF
        return (self._state & 0xFFFFFF) / 0x1000000

    def uniform(self, low, high):
        return low + (high - low) * self.random()


class Board:
    """A chip and what is connected to it; `now_us` only moves in calls. Stands in for `time`.

    `pads`: by GPIO; they, LEDC, the memory of the RTC and the clock outlive `reset`.
    """

    def __init__(self, seed=1, chip="esp32"):
        self.chip = chip
        self.now_us = 1_000.0
        self.random = Random(seed)
        self.tied = True
        # Bytes on the wire: start, end, value, who sends. A garbled one is nobody's.
        self.sent = []
        self.collisions = []
        self.pads = {}
        self.ledc = None
        self.rtc_memory = b""
        self.voltages_uv = {}
        self.wire_pad = None
        self.resets = 0
        self.interrupt_us = None  # when Ctrl-C is pressed
        self._events = []
        self._number = 0
        self._power_up()

    def _power_up(self):
        self.uart = None
        self.timers = {}
        self.watchdog_us = None
        self._over = False
        self.fed_us = []
        self.lost_callbacks = 0
        self.scheduled = []
        self._in_callback = False
        for pad in self.pads.values():
            pad.handler = None

    def reset(self):
        """What a reset by the watchdog leaves: pads and LEDC go on."""
        self.resets += 1
        self.reset_us = self.now_us
        self._power_up()

    # -- time ---------------------------------------------------------------------------------

    def ticks_us(self):
        self.spend(1.0)
        return int(self.now_us) % _WRAP

    def ticks_ms(self):
        self.spend(1.0)
        return int(self.now_us // 1000) % _WRAP

    def ticks_diff(self, end, start):
        assert 0 <= end < _WRAP and 0 <= start < _WRAP
        return (end - start + _WRAP // 2) % _WRAP - _WRAP // 2

    def ticks_add(self, ticks, delta):
        assert 0 <= ticks < _WRAP
        return (ticks + delta) % _WRAP

    def sleep_us(self, us):
        self.spend(us)

    def sleep_ms(self, ms):
        self.spend(1000.0 * ms)

    def spend(self, us, collecting=False):
        """Let time pass; soft interrupts run meanwhile, unless memory is being collected."""
        if self._over:
            raise ChipReset
        end = self.now_us + us
        while True:
            if not collecting:
                self._run_scheduled()
            if not self._events or self._events[0][0] > end:
                break
            t_us, _, event = heapq.heappop(self._events)
            self.now_us = max(self.now_us, t_us)
            self._check_watchdog()
            event()
        self.now_us = max(self.now_us, end)
        self._check_watchdog()
        if (
            self.interrupt_us is not None
            and self.now_us >= self.interrupt_us
            and not self._in_callback
            and not collecting
        ):
            self.interrupt_us = None
            raise KeyboardInterrupt

    def at(self, t_us, event):
        self._number += 1
        heapq.heappush(self._events, (t_us, self._number, event))

    def schedule(self, callback, argument):
        if len(self.scheduled) == _QUEUE_LENGTH:
            self.lost_callbacks += 1
        else:
            self.scheduled.append((callback, argument))

    def _run_scheduled(self):
        while self.scheduled and not self._in_callback:
            callback, argument = self.scheduled.pop(0)
            self._in_callback = True
            try:
                self.spend(self.random.uniform(5.0, 40.0))
                callback(argument)
            except Exception as error:
                self.callback_failed(error)
            finally:
                self._in_callback = False

    def callback_failed(self, error):
        """The port prints what a callback raises, and goes on; most tests had rather know."""
        raise error

    def _check_watchdog(self):
        if self.watchdog_us is not None and self.now_us > self.watchdog_us:
            self._over = True
            raise ChipReset

    # -- the wire -----------------------------------------------------------------------------

    @property
    def level(self):
        """The wire: low while a bit is low."""
        for start, end, value, _ in self.sent[-3:]:
            if start <= self.now_us < end:
                bit = int((self.now_us - start) / (end - start) * 10)
                return (value | 0x100) << 1 >> bit & 1
        return 1

    def put(self, who, start_us, value):
        """Send a byte from `start_us` on; returns the end of its stop bit."""
        end = start_us + BYTE_US
        for index in range(len(self.sent) - 1, max(-1, len(self.sent) - 40), -1):
            other_start, other_end, other, other_who = self.sent[index]
            if other_who != who and other_start < end and start_us < other_end:
                self.collisions.append(start_us)
                self.sent[index] = (other_start, other_end, other & value, other_who)
                value &= other
        self.sent.append((start_us, end, value, who))
        entry = len(self.sent) - 1
        if who == "receiver" or self.tied:
            self.at(end, lambda: self._heard(entry))
            before = 1
            for bit in range(10):
                now = (value | 0x100) << 1 >> bit & 1
                if before > now:
                    self.at(start_us + bit * BYTE_US / 10, self._fall)
                before = now
        return end

    def _fall(self):
        pad = self.pads.get(self.wire_pad)
        if pad is not None and pad.handler is not None:
            pad.falling()

    def _heard(self, entry):
        if self.uart is not None:
            self.uart.receive(self.sent[entry][2])

    def send(self, data, at_us):
        """Have the receiver send `data`; returns its end."""
        for number, value in enumerate(data):
            start = at_us + number * BYTE_US
            self.at(start, lambda s=start, v=value: self.put("receiver", s, v))
        return at_us + len(data) * BYTE_US

    def starts(self):
        """When each frame of the board began."""
        times = [start for start, _, _, who in self.sent if who == "board"]
        return [t for i, t in enumerate(times) if not i or t - times[i - 1] > 1.5 * BYTE_US]
