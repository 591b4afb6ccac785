"""The UART of a GPS receiver: finds the baud rate, and gives sentences and frames."""

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython

from firmware.sensors.gps_stream import NONE, Stream
from ghst.schedule import ticks_diff

SLOWEST = const(9600)
BAUDRATES = (SLOWEST, 38400, 57600, 115200)

# What comes at 115200 baud while the main loop is away for 80 ms, and the messages of the set-up.
# `init` makes both buffers anew, with 256 bytes unless it is told otherwise.
_RXBUF = const(1024)
_TXBUF = const(256)
_READ_BYTES = const(128)  # at once, or it takes too long

_LOST_MS = const(3000)  # without a sentence or frame
# A burst, at least so many bytes with so much silence before and behind them, has a sentence or a
# frame in it, or the baud rate is wrong.
_BURST_BYTES = const(5)
_PAUSE_MS = const(50)
# If there are no pauses: receivers send once a second or more often, and the longest sentence
# takes another 90 ms at 9600 baud.
_TRY_MS = const(1300)
# At 115200 baud, every byte sent at 9600 looks like a break, which MicroPython does not pass on.
_SILENT_MS = const(2000)
# Each round of all rates takes twice as long as the one before: a change of the rate allocates.
_LONGEST_ROUND = const(8)


class GpsPort:
    """Reads a UART at the baud rate at which sentences or frames come.

    `baudrate`: None while it is searched for; `listening`: what the UART is set to. `stale`:
    whether `retune` has to be called before anything else. `frame` and `length` are those of the
    `Stream`.
    """

    def __init__(self, uart):
        """`uart`: a `machine.UART`; its baud rate and its buffers are set here."""
        self._uart = uart
        self._data = bytearray(_READ_BYTES)
        self._stream = Stream()
        self.frame = self._stream.frame
        self.baudrate = None
        self._round = 1
        self._changes = 0
        self._listen(SLOWEST)
        self.retune(0)

    @property
    def length(self):
        """Characters of the sentence, or bytes of the frame's payload."""
        return self._stream.length

    @micropython.native
    def receive(self):
        """Reads what has come; returns whether there is anything for `next` to look at."""
        if self._unseen:
            return True
        # `readinto` would wait for bytes that are not there yet.
        count = self._uart.any()
        if not count:
            return False
        if count > _READ_BYTES:
            count = _READ_BYTES
        count = self._uart.readinto(self._data, count)
        if not count:
            return False
        self._stream.feed(self._data, count)
        self._arrived += count
        self._unseen = True
        return True

    @micropython.native
    def next(self, now_ms):
        """Returns the kind of the next sentence or frame (`gps_stream`), NONE if there is none."""
        kind = self._stream.next()
        if kind == NONE:
            self._unseen = False
            return NONE
        self._heard_ms = now_ms
        if not self._settled:
            # What was cut by a change of the baud rate is nobody's fault.
            self._settled = True
            self._stream.take_errors()
        if self.baudrate is None:
            self.baudrate = self.listening
            self._round = 1
            self._changes = 0
        return kind

    @micropython.native
    def check(self, now_ms):
        """Searches for the baud rate; returns the number of faults since the last call.

        Faults are sentences and frames that were broken, and a receiver that has gone silent or
        sends something else. To be called every 50 ms or more often.
        """
        count = self._arrived
        self._arrived = 0
        if self.baudrate is None:
            self._search(count, now_ms)
            return 0
        faults = self._stream.take_errors() if self._settled else 0
        if ticks_diff(now_ms, self._heard_ms) > _LOST_MS:
            self.baudrate = None
            self._begin(now_ms)
            faults += 1
        return faults

    def change(self, baudrate):
        """Follows a receiver that has changed its baud rate."""
        self.baudrate = baudrate
        self._listen(baudrate)

    def retune(self, now_ms):
        """Sets the UART to the baud rate in `listening`.

        That takes 30 bits, 3.1 ms at 9600 baud, on the RP2: so it is a step of its own.
        """
        self._uart.init(
            baudrate=self.listening, bits=8, parity=None, stop=1, rxbuf=_RXBUF, txbuf=_TXBUF
        )
        self.stale = False
        self._stream.clear()
        self._heard_ms = now_ms
        self._begin(now_ms)

    @micropython.native
    def _search(self, count, now_ms):
        # Nothing is heard of a much slower sender, something of a faster one: silence is a reason
        # for the slowest rate, and none to leave it. Any other rate is left for the next one when
        # something comes that is neither sentence nor frame.
        pause_ms = ticks_diff(now_ms, self._byte_ms)
        longest_ms = self._round * _TRY_MS
        if count > 0:
            if pause_ms >= _PAUSE_MS:
                self._burst_bytes = 0
                self._whole = True
            if not self._tried or pause_ms > _TRY_MS:
                self._tried = True
                self._tried_ms = now_ms
            self._burst_bytes = min(self._burst_bytes + count, _READ_BYTES)
            self._byte_ms = now_ms
        elif self._whole and self._burst_bytes >= _BURST_BYTES and pause_ms >= _PAUSE_MS:
            longest_ms -= _TRY_MS
        elif pause_ms > _SILENT_MS and self.listening != SLOWEST:
            self._listen(SLOWEST)
            return
        else:
            return
        if ticks_diff(now_ms, self._tried_ms) > longest_ms:
            self._changes += 1
            if self._changes == len(BAUDRATES):
                self._changes = 0
                self._round = min(2 * self._round, _LONGEST_ROUND)
            choice = BAUDRATES.index(self.listening) + 1
            self._listen(BAUDRATES[choice % len(BAUDRATES)])

    def _listen(self, baudrate):
        self.listening = baudrate
        self.stale = True

    def _begin(self, now_ms):
        self._tried = self._whole = self._settled = self._unseen = False
        self._burst_bytes = self._arrived = 0
        self._byte_ms = now_ms
