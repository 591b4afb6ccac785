"""The firmware's control path on this board, and the receiver that is played to it."""

import gc
import time
from array import array
from binascii import unhexlify

import machine
import selftest_board
import selftest_pads as pads
import selftest_pulses as pulses
from firmware.adapter import Adapter
from firmware.msp import Msp
from firmware.search import Search
from firmware.telemetry import Telemetry
from micropython import const
from selftest_player import Player

from firmware import chip
from ghst import telemetry

VOLTAGE_MV = const(12_340)
CURRENT_MA = const(5_670)
CONSUMED_MAH = const(890)

_PERIOD_US = const(4000)
_TWO_PERIODS_MS = const(48)  # of a servo, and a pulse more
_LOST_MS = const(1500)
_FRAME_MS = const(400)


class _Battery:
    """A battery sensor that always says the same."""

    present = True
    voltage_mv = VOLTAGE_MV
    current_ma = CURRENT_MA
    consumed_mah = CONSUMED_MAH
    capacity_mah = 0
    cell_count = 3
    state = 0

    def update(self, now_ms):
        return True


class _Recorded:
    """An adapter's control path and receiver; `frame` is what was sent last."""

    frame = None

    def __init__(self, adapter):
        self.control = self
        self.receiver = adapter.receiver
        self.discard = adapter.control.discard
        self._control = adapter.control

    @property
    def link(self):
        return self._control.link

    @property
    def slot_free(self):
        return self._control.slot_free

    def send(self, frame):
        self.frame = bytes(frame)
        self._control.send(frame)


class _Application:
    """What `Msp` and `Telemetry` need of a `firmware.application.Application`."""

    identity = ("selftest", "", "")
    vtx_settings = {  # noqa: RUF012 - there is one of these objects
        "vtx_band": 0,
        "vtx_channel": 0,
        "vtx_power": 0,
        "vtx_pit_mode": 0,
        "vtx_freq_mhz": 0,
        "vtx_low_power_disarm": 0,
        "vtx_pit_freq_mhz": 0,
    }
    cycle_time_us = 0

    def __init__(self, adapter):
        self.receiver = adapter.receiver
        self.search = Search({})
        battery = _Battery()
        self.sensors = {"battery": battery}
        self.msp = Msp(self)
        self.recorded = _Recorded(adapter)
        self.telemetry = Telemetry(self.recorded, self.msp)
        self.telemetry.armed = True
        self.steps = (self.telemetry.add("battery", battery), self.telemetry.update)


class Bench:
    """An adapter on the pins of the board, and a player on the pin that is tied to its wire.

    Transmissions come as hexadecimal text of what `Player` takes.
    """

    def __init__(self, wire_pin, pin, servos, failsafe, watchdog=False):
        """`pin`: GPIO that is tied to the wire; `servos`, `failsafe`: as `Adapter` has them."""
        self._servos = sorted(servos)
        self._player = Player(pin)
        pads.clear(self._servos)
        self.adapter = Adapter(wire_pin, servos, failsafe=failsafe)
        self.adapter.start(watchdog=watchdog)
        self._application = _Application(self.adapter)
        self._frame = bytearray(14)
        self._payload = bytearray(10)

    def rose(self):
        """Returns the servo pins that have risen since the last call, or the beginning."""
        found = pads.rose(self._servos)
        pads.clear(self._servos)
        return found

    def counters(self):
        """Returns the state of the link, what was counted, and the channels."""
        receiver = self.adapter.receiver
        control = self.adapter.control
        return {
            "link": self.adapter.link,
            "frames": receiver.frames,
            "crc_errors": receiver.crc_errors,
            "length_errors": receiver.length_errors,
            "skipped_bytes": receiver.skipped_bytes,
            "unknown_frames": receiver.unknown_frames,
            "foreign_frames": receiver.foreign_frames,
            "msp_frames": receiver.msp_frames,
            "vtx_setups": receiver.vtx_setups,
            "lq": receiver.lq,
            "rssi_dbm": receiver.rssi_dbm,
            "rf_mode": receiver.rf_mode,
            "sent": control.telemetry_frames,
            "collisions": control.collisions,
            "failsafes": control.failsafes,
            "pulses": list(receiver.pulses),
        }

    def wait(self, ms):
        """Lets time pass without a frame; returns what `rose` does then."""
        self.adapter.poll()
        time.sleep_ms(ms)
        return self.rose()

    def play(self, transmissions, period_us=_PERIOD_US):
        """Sends each of them, `period_us` from one to the next; returns `counters()`."""
        self._play(_words(transmissions), len(transmissions), period_us)
        return self.counters()

    def _play(self, transmissions, count, period_us=_PERIOD_US):
        due = time.ticks_us()
        for number in range(count):
            self._player.send(transmissions[number % len(transmissions)])
            self.adapter.poll()
            due = time.ticks_add(due, period_us)
            time.sleep_us(max(0, time.ticks_diff(due, time.ticks_us())))

    def settle(self, transmissions):
        """Sends in turn for two periods of a servo: then its pulses are what they will be."""
        self._play(_words(transmissions), _TWO_PERIODS_MS * 1000 // _PERIOD_US)

    def widths(self, transmissions, pins):
        """Sends in turn and measures, for long enough to see one whole pulse at least.

        Returns for each of `pins`, three at most, the widths of its pulses in ns.
        """
        words = _words(transmissions)
        timers = [pulses.PulseTimer(number, pin) for number, pin in enumerate(pins)]
        self._play(words, _TWO_PERIODS_MS * 1000 // _PERIOD_US)
        return [timer.finish() for timer in timers]

    def widths_without_link(self, pins):
        """The same as `widths` without sending."""
        timers = [pulses.PulseTimer(number, pin) for number, pin in enumerate(pins)]
        time.sleep_ms(_TWO_PERIODS_MS)
        return [timer.finish() for timer in timers]

    def levels(self, pins):
        """Returns the level of each of these pins, as they are."""
        return [machine.Pin(pin).value() for pin in pins]

    def slot(self, before, transmission, scheduled=False):
        """Sends what is in `before`, has a telemetry frame wait, sends and records.

        `scheduled`: the frame is what `Telemetry` chooses; else the battery's. Returns the
        frame, None if none was waiting, and the recording, both hexadecimal.
        """
        control = self.adapter.control
        control.discard()
        # Requests of other checks, which nobody has answered.
        self._application.msp.discard()
        while self.adapter.receiver.next_msp(self._payload):
            pass
        self._play(_words(before), len(before))
        frame = None
        if scheduled:
            frame = self._scheduled()
        else:
            telemetry.pack_status(self._frame, VOLTAGE_MV, CURRENT_MA, CONSUMED_MAH, True)
            control.send(self._frame)
            frame = bytes(self._frame).hex()
        (words,) = _words([transmission])
        gc.collect()
        recording = self._player.record(words).hex()
        return {"frame": frame, "recording": recording}

    def _scheduled(self):
        control = self.adapter.control
        begun_ms = time.ticks_ms()
        while control.slot_free:
            now_ms = time.ticks_ms()
            if time.ticks_diff(now_ms, begun_ms) > _FRAME_MS:
                return None
            for step in self._application.steps:
                step(now_ms)
        return self._application.recorded.frame.hex()

    def lose(self, transmissions):
        """Sends all of these, then nothing; returns the ms from then to failsafe, None: never."""
        words = _words(transmissions)
        self._play(words, len(words) - 1)
        begun_us = time.ticks_us()
        self._player.send(words[-1])
        linked = False
        while True:
            self.adapter.poll()
            link = self.adapter.link
            passed_us = time.ticks_diff(time.ticks_us(), begun_us)
            linked = linked or link == "linked"
            if linked and link == "failsafe":
                return passed_us / 1000
            if passed_us > _LOST_MS * 1000:
                return None
            time.sleep_ms(1)

    def starve(self, transmissions):
        """Sends in turn for 100 ms, then stops the receiving state machine: the chip is reset.

        Counts the ms from then where they outlast that; returns them if nothing happens.
        """
        self._play(_words(transmissions), 25)
        # Reads as zero if there is no reset at all.
        selftest_board.count_ms(0)
        begun_ms = time.ticks_ms()
        machine.mem32[chip.PIO[0] + chip.CLEAR_BITS] = 1
        passed_ms = 0
        while passed_ms < _LOST_MS:
            self.adapter.poll()
            time.sleep_us(_PERIOD_US)
            passed_ms = time.ticks_diff(time.ticks_ms(), begun_ms)
            selftest_board.count_ms(passed_ms)
        return passed_ms

    def stop(self):
        """Makes the pins quiet and gives everything back."""
        self.adapter.stop()
        self._player.stop()
        pulses.forget()


def _words(transmissions):
    return [array("I", unhexlify(text)) for text in transmissions]
