"""`machine.Timer` and `machine.WDT` of the ESP32 port."""

from esp32_model.board import CHIPS


class Timer:
    """A hardware timer; its callback is soft.

    "The ESP32 port has four hardware timers ... with a timer ID from 0 to 3 (inclusive) ...
    Virtual timers are not currently supported on this port" (quickref.rst); the C3 has two.
    """

    board = None
    ONE_SHOT = 0
    PERIODIC = 1

    def __init__(self, id, **settings):
        if not 0 <= id < CHIPS[self.board.chip][4]:
            raise ValueError("invalid Timer number")
        self._id = id
        self.board.timers.setdefault(id, 0)
        if settings:
            self.init(**settings)

    def init(self, *, mode=PERIODIC, callback=None, period=None, tick_hz=1000, freq=None):
        board = self.board
        if mode not in (self.ONE_SHOT, self.PERIODIC) or callback is None:
            raise ValueError("a mode and a callback")
        if (freq is None) is (period is None):
            raise ValueError("either freq or period")
        delay_us = 1e6 / freq if freq is not None else 1e6 * period / tick_hz
        board.spend(board.random.uniform(10.0, 30.0))
        board.timers[self._id] += 1
        generation = board.timers[self._id], board.resets
        repeat_us = delay_us if mode == self.PERIODIC else 0.0
        due = board.now_us + delay_us
        board.at(due, lambda: self._expired(generation, callback, due, repeat_us))

    def _expired(self, generation, callback, due_us, repeat_us):
        board = self.board
        if generation != (board.timers.get(self._id), board.resets):
            return
        board.schedule(callback, self)
        if repeat_us:
            due = due_us + repeat_us
            board.at(due, lambda: self._expired(generation, callback, due, repeat_us))

    def deinit(self):
        self.board.spend(5.0)
        self.board.timers[self._id] += 1


class WDT:
    """The task watchdog.

    "Once it is running the timeout cannot be changed and the WDT cannot be stopped either"
    (machine.WDT.rst) is not true of this port: made anew, it has the new time, since
    ports/esp32/machine_wdt.c calls `esp_task_wdt_reconfigure`. It cannot be stopped.
    """

    board = None

    def __init__(self, id=0, timeout=5000):
        if id != 0:
            raise ValueError
        # "The timeout must be given in milliseconds"; ESP-IDF counts it in four bytes of 250 us.
        if not 0 < timeout < 1 << 30:
            raise ValueError("WDT timeout too short")
        self.board.spend(20.0)
        self.timeout_ms = timeout
        self._feed()

    def _feed(self):
        self.board.watchdog_us = self.board.now_us + 1000.0 * self.timeout_ms

    def feed(self):
        self.board.spend(2.0)
        self.board.fed_us.append(self.board.now_us)
        self._feed()
