"""Sets a u-blox receiver up for ten NAV-PVT a second, step by step, while the main loop goes on.

Each message goes out in the form that series 6 to 9 understand and in the one of series 9 and 10;
a receiver refuses the one that it does not know. It is a u-blox once it has acknowledged one of
them and NAV-PVT comes. Only then is its baud rate raised and NMEA switched off. Everything is
kept in the receiver's RAM: without power it forgets.
"""

try:
    from micropython import const
except ImportError:
    from ghst._host import const

from firmware.sensors import ubx
from ghst.schedule import ticks_diff

FASTEST_BAUDRATE = const(115_200)
PERIOD_MS = const(100)
# NAV-PVT has 100 bytes: ten a second take more than 9600 baud.
_SLOW_PERIOD_MS = const(200)
_SLOW_BAUDRATE = const(19_200)

# Receivers out of the box send once a second.
_ANSWER_MS = const(2500)
_ATTEMPTS = const(3)
# `txdone` is true with the last byte on its way.
_DRAIN_MS = const(20)

_IDLE = const(0)
_ASK = const(1)  # wait for an acknowledgement and NAV-PVT
_RAISE = const(2)  # wait until the messages have gone, at the old baud rate
_LISTEN = const(3)  # wait for anything at the new one
_SET_RATE = const(4)  # wait for an acknowledgement and NAV-PVT


class UbloxSetup:
    """The steps, for one receiver after the other.

    Whoever reads the receiver says what has come: sets `acknowledged` at an ACK-ACK, `navigating`
    at a NAV-PVT, `heard` at any sentence or frame.
    """

    def __init__(self, uart):
        """`uart`: a `machine.UART` whose transmit buffer takes 128 bytes."""
        self._uart = uart
        self._baudrate = 0
        self._slow_baudrate = 0
        self._stay = False
        self._enter(_IDLE, 0)

    @property
    def busy(self):
        """Whether a receiver is being set up."""
        return self._state != _IDLE

    def start(self, baudrate, now_ms):
        """Begins with a receiver that sends at `baudrate`."""
        self._baudrate = baudrate
        self._enter(_ASK, now_ms)

    def stop(self):
        """Ends it: the receiver has gone."""
        self._enter(_IDLE, 0)

    def update(self, now_ms):
        """One step; `now_ms` from `ticks_ms`. Returns the baud rate to go on with, or 0."""
        state = self._state
        if state == _IDLE:
            return 0
        if not self._sent:
            # Only into an empty buffer: `write` would wait for room in a full one.
            if self._uart.txdone():
                self._uart.write(self._messages())
                self._sent = True
                self._since_ms = now_ms
            return 0
        if state == _RAISE:
            if not self._uart.txdone():
                self._since_ms = now_ms
            elif ticks_diff(now_ms, self._since_ms) >= _DRAIN_MS:
                self._slow_baudrate = self._baudrate
                return self._listen(FASTEST_BAUDRATE, _LISTEN, now_ms)
        elif state == _LISTEN:
            if self.heard:
                self._enter(_SET_RATE, now_ms)
            elif ticks_diff(now_ms, self._since_ms) >= _ANSWER_MS:
                self._stay = True
                return self._listen(self._slow_baudrate, _ASK, now_ms)
        elif self.acknowledged and self.navigating:
            if state == _SET_RATE:
                self._stay = False
                self._enter(_IDLE, now_ms)
            elif self._baudrate == FASTEST_BAUDRATE or self._stay:
                self._enter(_SET_RATE, now_ms)
            else:
                self._enter(_RAISE, now_ms)
        elif ticks_diff(now_ms, self._since_ms) >= _ANSWER_MS:
            self._attempts += 1
            self._sent = False
            if self._attempts == _ATTEMPTS:
                self._enter(_IDLE, now_ms)
        return 0

    def _enter(self, state, now_ms):
        self._state = state
        self._attempts = 0
        self._sent = state == _LISTEN
        self._since_ms = now_ms
        self.acknowledged = self.navigating = self.heard = False

    def _listen(self, baudrate, state, now_ms):
        self._baudrate = baudrate
        self._enter(state, now_ms)
        return baudrate

    def _messages(self):
        if self._state == _ASK:
            return (
                ubx.set_port(self._baudrate, ubx.PROTOCOL_UBX | ubx.PROTOCOL_NMEA)
                + ubx.set_pvt_on()
                + ubx.set_values((ubx.UART1_OUT_UBX, 1), (ubx.NAV_PVT_ON_UART1, 1))
            )
        if self._state == _RAISE:
            # A receiver that obeys the first message cannot read the second one any more.
            return ubx.set_port(
                FASTEST_BAUDRATE, ubx.PROTOCOL_UBX | ubx.PROTOCOL_NMEA
            ) + ubx.set_values((ubx.UART1_BAUDRATE, FASTEST_BAUDRATE))
        period_ms = PERIOD_MS if self._baudrate > _SLOW_BAUDRATE else _SLOW_PERIOD_MS
        return (
            ubx.set_rate(period_ms)
            + ubx.set_values(
                (ubx.RATE_MEASUREMENT_MS, period_ms),
                (ubx.RATE_NAVIGATION, 1),
                (ubx.UART1_OUT_NMEA, 0),
            )
            + ubx.set_port(self._baudrate, ubx.PROTOCOL_UBX)
        )
