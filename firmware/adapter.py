"""`Adapter`: a Ghost receiver on one pin, servos on others, failsafe and watchdog between them."""

import sys

import firmware
from firmware.limits import FAILSAFE, LINKED, SEARCHING

LINK_NAMES = ("searching", "linked", "failsafe")

MINIMUM_FAILSAFE_MS = 110
MAXIMUM_FAILSAFE_MS = 10_000
# Slower, the echo of our telemetry would reach into the next frame's time.
MINIMUM_BAUD_RATE = 350_000
MAXIMUM_BAUD_RATE = 500_000

__all__ = ("FAILSAFE", "LINKED", "LINK_NAMES", "SEARCHING", "Adapter")


def _parts():
    # A board ships those of its own chip.
    if sys.platform == "esp32":
        from firmware.parts_esp32 import parts
    else:
        from firmware.parts_rp2 import parts
    return parts


class Adapter:
    """The control path of one receiver.

    Control frames move the servos from interrupts alone. The main loop calls `poll` at least once
    a second and reads `receiver`, `link` and `status()` whenever it likes. In failsafe the
    channels in `receiver.pulses` are 0, each until it comes again. An adapter is started once.
    """

    def __init__(
        self,
        wire_pin,
        channels,
        *,
        failsafe=None,
        failsafe_ms=500,
        led=None,
        led_active_low=False,
        arming=None,
        link_limits=None,
        broken=False,
        wire="pio",
        tx_pin=None,
        baud_rate=420_000,
        inverted=False,
    ):
        """Claims the pins; nothing moves before `start`.

        `wire_pin`: GPIO of the Ghost wire. `wire`: "pio", or "uart" where `wire_pin` is RX of a
        UART and `tx_pin` (default: the GPIO below) its TX, tied to it. `baud_rate`: of both
        directions, 350000..500000; `inverted`: whether the line idles low, "pio" only. `channels`:
        {GPIO: channel 1..16 or `Output`}; `arming`, `link_limits`: as `ServoOutputs`. `failsafe`:
        {GPIO: outputs.HOLD, outputs.NONE or quarter microseconds}. `failsafe_ms`: 110..10000, two
        frames of Long Range at least. `led`: GPIO or None. `broken`: whether the LED shows that
        the configuration is. Raises `ValueError` for what cannot be, and while another adapter
        runs.
        """
        if firmware.running:
            raise ValueError("an adapter is running: stop it first")
        if not MINIMUM_FAILSAFE_MS <= failsafe_ms <= MAXIMUM_FAILSAFE_MS:
            raise ValueError(f"failsafe_ms is {failsafe_ms}, must be 110..10000")
        if wire_pin in channels:
            raise ValueError(f"GP{wire_pin} is the Ghost wire and a servo output")
        if led is not None and (led == wire_pin or led in channels):
            raise ValueError(f"GP{led} is the LED and something else")
        if wire not in ("pio", "uart"):
            raise ValueError(f'wire is {wire!r}, must be "pio" or "uart"')
        if wire == "uart":
            if tx_pin is None:
                tx_pin = wire_pin - 1
            if tx_pin in channels or tx_pin == led:
                raise ValueError(f"GP{tx_pin} is TX of the Ghost wire and something else")
        self._started = False
        if not MINIMUM_BAUD_RATE <= baud_rate <= MAXIMUM_BAUD_RATE:
            raise ValueError(f"baud_rate is {baud_rate}, must be 350000..500000")
        if inverted and wire == "uart":
            raise ValueError('inverted is for wire "pio" only')
        self.receiver, self.outputs, self.control = _parts()(
            (wire, wire_pin, tx_pin, baud_rate, inverted),
            channels,
            {"failsafe": failsafe, "arming": arming, "link_limits": link_limits},
            {
                "failsafe_ms": failsafe_ms,
                "led": led,
                "led_active_low": led_active_low,
                "broken": broken,
            },
        )

    def start(self, *, watchdog=True):
        """Begins to receive. `watchdog`: whether the chip is reset when the control path stops."""
        if self._started:
            raise ValueError("an adapter is started once: make a new one")
        self._started = True
        firmware.running = self
        self.control.start(watchdog=watchdog)

    def stop(self):
        """Makes the pins quiet and gives all hardware back; may be called again."""
        if firmware.running is self:
            self.control.stop()
            self.outputs.stop()
            firmware.running = None

    def poll(self):
        """Says that the main loop is alive; returns `SEARCHING`, `LINKED` or `FAILSAFE`."""
        self.control.alive()
        return self.control.link

    @property
    def link(self):
        """The state of the link in a word: one of `LINK_NAMES`."""
        return LINK_NAMES[self.control.link]

    def status(self):
        """Returns a dict of everything worth showing; allocates."""
        receiver = self.receiver
        return {
            "link": self.link,
            "lq": receiver.lq,
            "rssi_dbm": receiver.rssi_dbm,
            "rf_mode": receiver.rf_mode,
            "frames": receiver.frames,
            "crc_errors": receiver.crc_errors,
            "length_errors": receiver.length_errors,
            "skipped_bytes": receiver.skipped_bytes,
            "failsafes": self.control.failsafes,
            "main_loop_stuck": self.control.stuck,
            "pulses_us": [pulse / 4 for pulse in receiver.pulses],
        }
