"""`machine.PWM` of the ESP32 port, and LEDC behind it (ports/esp32/machine_pwm.c of 1.25).

LEDC divides its clock of 80 MHz by a number in 256ths, and counts 2^resolution steps in a period;
MicroPython has the ESP-IDF choose both (components/driver/ledc). A new duty counts from the next
period on. It goes on through every reset but power-on, until something else takes the pin.
"""

from esp32_model.board import CHIPS

_CLOCK_HZ = 80_000_000


class LedcTimer:
    """A timer of LEDC, running."""

    def __init__(self, board, hertz, most_bits):
        self.hertz = hertz
        quotient = (_CLOCK_HZ + hertz // 2) // hertz
        self.bits = 0
        while 2 << self.bits <= quotient and self.bits < most_bits:
            self.bits += 1
        steps = hertz * (1 << self.bits)
        divider = (2 * 256 * _CLOCK_HZ + steps) // (2 * steps)
        assert 256 <= divider <= 0x3FFFF
        self.step_us = divider / 256 / (_CLOCK_HZ / 1e6)
        self.period_us = self.step_us * (1 << self.bits)
        self._began_us = board.now_us
        self._board = board

    def next_period_us(self):
        gone = int((self._board.now_us - self._began_us) / self.period_us) + 1
        return self._began_us + gone * self.period_us


class Channel:
    """A channel of LEDC and the pad that it drives."""

    def __init__(self, board, pad, timer):
        self._board = board
        self._pad = pad
        self.timer = timer
        self._wanted = self.duty = (1 << timer.bits) // 2
        pad.channel = self
        pad.use = "ledc"
        pad.driven = True
        pad.show()

    def set(self, duty):
        self._wanted = duty
        self._board.at(self.timer.next_period_us(), self._take_over)

    def _take_over(self):
        self.duty = self._wanted
        if self._pad.channel is self:
            self._pad.show()

    def shows(self):
        if self.duty == 0:
            return 0
        return ("pulses", self.duty * self.timer.step_us, self.timer.period_us)

    def stop(self):
        if self._pad.channel is self:
            # `oen_inv` of the GPIO matrix: nothing drives the pad any more.
            self._pad.channel = None
            self._pad.driven = False
            self._pad.show()


class Ledc:
    """Which pin has which channel, and which frequency which timer: MicroPython's own books."""

    def __init__(self, chip):
        groups, channels, timers, self.most_bits, _, _ = CHIPS[chip]
        self.channels = [None] * (groups * channels)  # (GPIO, timer index)
        self.timers = [None] * (groups * timers)
        self.in_group = channels
        self.timers_in_group = timers

    def find_timer(self, hertz, group=None):
        free = None
        for index, timer in enumerate(self.timers):
            if group is not None and index // self.timers_in_group != group:
                continue
            if timer is not None and timer.hertz == hertz:
                return index
            if timer is None and free is None:
                free = index
        return free

    def find_channel(self, number, group=None):
        free = None
        for index, channel in enumerate(self.channels):
            if group is not None and index // self.in_group != group:
                continue
            if channel is not None and channel[0] == number:
                return index
            if channel is None and free is None:
                free = index
        return free


class PWM:
    """`PWM(dest, *, freq, duty_u16, duty_ns, invert=False)`, says machine.PWM.rst; this
    port has no `invert`.
    """

    board = None

    def __init__(self, dest, freq=None, *, duty=None, duty_u16=None, duty_ns=None):
        board = self.board
        pad = board.pad(dest)
        if pad.input_only:
            raise ValueError("PWM not supported on Pin")
        if board.ledc is None:
            board.ledc = Ledc(board.chip)
        books = board.ledc
        if [duty, duty_u16, duty_ns].count(None) < 2:
            raise ValueError("only one of parameters 'duty', 'duty_u16' or 'duty_ns' is allowed")
        freq = 5000 if freq is None else freq
        if type(freq) is not int or not 0 < freq <= 40_000_000:
            raise ValueError("frequency must be from 1Hz to 40MHz")
        index = books.find_channel(pad.number)
        if index is None:
            raise ValueError("out of PWM channels")
        group = index // books.in_group
        timer = books.find_timer(freq, group)
        if timer is None:
            timer = books.find_timer(freq)
        if timer is None:
            raise ValueError("out of PWM timers")
        if timer // books.timers_in_group != group:
            index = books.find_channel(pad.number, timer // books.timers_in_group)
            if index is None:
                raise ValueError("out of PWM channels")
        if books.timers[timer] is None:
            books.timers[timer] = LedcTimer(board, freq, books.most_bits)
        books.channels[index] = (pad.number, timer)
        self._index = index
        board.spend(60.0)
        # 50 % until the duty below has been taken over.
        self._channel = Channel(board, pad, books.timers[timer])
        if duty_u16 is not None:
            self.duty_u16(duty_u16)
        elif duty_ns is not None:
            self.duty_ns(duty_ns)
        elif duty is not None:
            self.duty(duty)

    def duty_u16(self, duty):
        if self._channel is None:
            raise RuntimeError("PWM inactive")
        if type(duty) is not int or not 0 <= duty <= 65535:
            raise ValueError("duty_u16 must be from 0 to 65535")
        self.board.spend(self.board.random.uniform(10.0, 25.0))
        bits = self._channel.timer.bits
        self._channel.set(duty << bits - 16 if bits > 16 else duty >> 16 - bits)

    def duty_ns(self, ns):
        raise NotImplementedError("counts in 65535ths of a period of exactly 1/freq: not exact")

    def duty(self, duty):
        raise NotImplementedError("10 bits are too coarse for a servo")

    def deinit(self):
        if self._channel is None:
            return
        self.board.spend(30.0)
        self._channel.stop()
        self._channel = None
        books = self.board.ledc
        timer = books.channels[self._index][1]
        books.channels[self._index] = None
        if not any(channel and channel[1] == timer for channel in books.channels):
            books.timers[timer] = None
