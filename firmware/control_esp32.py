# only on esp32
"""Joins a UART, a receiver and outputs by soft interrupts, and shows what these found.

Here MicroPython's interrupts are functions that its scheduler calls between two steps of the main
program. They come whatever that program computes, waits for or raises, but neither while the heap
is collected nor while something written in C holds the interpreter up. So the hardware watchdog
stands behind all of it: it is fed by the tick alone, and only while the control path is healthy.
"""

import time

import machine
from micropython import const

from firmware.limits import FAILSAFE, LINKED, SEARCHING
from firmware.uart_link import UartLink
from ghst.decoder import RF_PROTOCOL, set_word

_TICK_MS = const(10)
_WATCHDOG_MS = const(1000)
# A watchdog cannot be stopped, says the documentation of machine.WDT, but in this port making it
# anew changes its time (ports/esp32/machine_wdt.c). The longest that counts in four bytes of
# quarter milliseconds, the finest unit that the ESP-IDF turns it into, is 12 days.
_PAUSED_MS = 86_400_000

# The main loop is stuck after two seconds, and worth a reset after five where no link is at stake.
_STUCK_MS = const(2000)
_RESET_MS = const(5000)
# Receiving frames and writing outputs takes a millisecond.
_BUSY_MS = const(250)
_MICROSECONDS = const(1000)
_COUNTER_MASK = const(0x3FFFFFFF)

# One bit is 80 ms: a pattern of 16 bits takes 1.28 s.
_BIT_MS = const(80)
_LED_SEARCHING = const(0x00FF)
_LED_LINKED = const(0xFFFF)
_LED_FAILSAFE = const(0x5555)
_LED_STUCK = const(0x0005)
_LED_BROKEN = const(0x0015)


class SoftControl:
    """Joins UART, receiver and outputs by two soft interrupts, and shows what they found.

    `link`: `SEARCHING`, `LINKED` or `FAILSAFE`; `failsafes`, `stuck`: how often the link was lost
    and the main loop stood still for two seconds.
    """

    def __init__(
        self,
        uart,
        wire_pin,
        receiver,
        outputs,
        *,
        failsafe_ms=500,
        led=None,
        led_active_low=False,
        broken=False,
    ):
        """`uart`: as `UartLink` has it, RX on GPIO `wire_pin`.

        Takes the hardware timers 0 and 1: the C3 has no others, and 0 is what `UART.IRQ_RXIDLE`
        of any UART would take. The rest is as `firmware.control.Control` has it.
        """
        self._uart = uart
        self._wire_pin = wire_pin
        self._receiver = receiver
        self._outputs = outputs
        self._failsafe_us = failsafe_ms * _MICROSECONDS
        self._broken = broken
        self._led = None
        if led is not None:
            self._led = machine.Pin(led, machine.Pin.OUT, value=led_active_low)
        self._led_off = led_active_low
        self.link = SEARCHING
        self.failsafes = 0
        self.stuck = 0
        self._stamp_us = 0
        self._dead = False
        self._running = False
        self._watchdog = None
        self._alive = self._idle = False
        self._held_ms = None  # since when the main loop has a frame in hand, as the ticks saw it
        self._alive_ms = self._began_ms = time.ticks_ms()
        self._timer = machine.Timer(0)
        # RX pulls itself up; the pin is looked at beside it.
        pin = machine.Pin(wire_pin)
        self._link = UartLink(uart, pin, machine.Timer(1), receiver, self._on_frames)

    def start(self, *, watchdog=True):
        """Starts both interrupts, and the hardware watchdog that the tick feeds."""
        self._running = True
        self._alive_ms = self._began_ms = time.ticks_ms()
        self._link.start()
        if watchdog:
            self._watchdog = machine.WDT(timeout=_WATCHDOG_MS)
        self._timer.init(mode=machine.Timer.PERIODIC, period=_TICK_MS, callback=self._on_tick)

    def stop(self):
        """Stops both interrupts, and puts the watchdog off for a day: the REPL is not reset."""
        self._running = False
        self._timer.deinit()
        self._link.stop()
        if self._watchdog:
            self._watchdog = machine.WDT(timeout=_PAUSED_MS)
        self._uart.deinit()
        machine.Pin(self._wire_pin, machine.Pin.IN, machine.Pin.PULL_UP)
        if self._led:
            self._led.value(self._led_off)

    def _on_frames(self, frames):
        if not self._running or self._dead:
            return
        try:
            # Frames of a link that is too weak do not count.
            if self._outputs.shape(frames):
                self._stamp_us = time.ticks_us()
                self.link = LINKED
                self._outputs.write()
        except MemoryError:
            raise  # the next frame tries again
        except Exception:
            # An output that takes no pulse: all go off with the next tick.
            self._dead = True
            raise

    def _on_tick(self, _timer):
        if not self._running:
            return
        now_ms = time.ticks_ms()
        # What the UART's interrupt was not called for: the scheduler has room for eight.
        self._link.poll()
        if not self._link.in_hand:
            self._held_ms = None
        elif self._held_ms is None:
            self._held_ms = now_ms
        elif time.ticks_diff(now_ms, self._held_ms) > _BUSY_MS:
            self._dead = True
        if self._dead:
            self.link = FAILSAFE
            self._show_led(now_ms)
            self._outputs.off()
            return
        # Not while the main loop has a frame in hand: it would go on with what it had. Nor while
        # bytes wait for it.
        if (
            self.link == LINKED
            and not self._link.in_hand
            and time.ticks_diff(time.ticks_us(), self._stamp_us) > self._failsafe_us
            and not self._uart.any()
        ):
            self._lose()
        if self.link == FAILSAFE and not self._link.in_hand:
            try:
                # Each time, lest Ctrl-C has cut the last one short.
                self._outputs.write()
            except MemoryError:
                raise  # as does the next tick
            except Exception:
                self._dead = True
                raise
        if self._alive:
            self._alive = False
            self._alive_ms = now_ms
        if self._watchdog and (
            self.link == LINKED or time.ticks_diff(now_ms, self._alive_ms) < _RESET_MS
        ):
            self._watchdog.feed()
        self._show_led(now_ms)

    def _lose(self):
        self._outputs.lose()
        pulses = self._receiver.pulses
        for index in range(len(pulses)):
            pulses[index] = 0
        # Nothing is sent until the RF mode is known again.
        set_word(self._receiver.memory, RF_PROTOCOL, 0)
        self.link = FAILSAFE
        self.failsafes = (self.failsafes + 1) & _COUNTER_MASK

    def _show_led(self, now_ms):
        idle = time.ticks_diff(now_ms, self._alive_ms) > _STUCK_MS
        if idle and not self._idle:
            self.stuck = (self.stuck + 1) & _COUNTER_MASK
        self._idle = idle
        if not self._led:
            return
        pattern = _LED_SEARCHING
        if self._broken:
            pattern = _LED_BROKEN
        elif idle:
            pattern = _LED_STUCK
        elif self.link == LINKED:
            pattern = _LED_LINKED
        elif self.link == FAILSAFE:
            pattern = _LED_FAILSAFE
        bit = pattern >> (time.ticks_diff(now_ms, self._began_ms) // _BIT_MS & 15) & 1
        self._led.value(bit ^ self._led_off)

    def rest(self, ms):
        """Passes the time of the main loop: listening, if there is telemetry that wants a slot.

        A frame that comes meanwhile ends it.
        """
        if self.link == LINKED and not self._link.slot_free:
            self._link.poll(ms * _MICROSECONDS)
        else:
            time.sleep_ms(ms)

    @property
    def restarted(self):
        """Whether the watchdog has restarted the chip."""
        return machine.reset_cause() == machine.WDT_RESET

    def alive(self):
        """Tells the tick that the main loop runs; to be called at least once a second."""
        self._alive = True

    @property
    def slot_free(self):
        """Whether no telemetry frame waits for its slot."""
        return self._link.slot_free

    def send(self, frame):
        """Has the 14 bytes of `frame` sent in the next certain slot; only while it is free."""
        self._link.send(frame)

    def discard(self):
        """Forgets a frame that waits; one that is on its way goes on."""
        self._link.discard()

    @property
    def telemetry_frames(self):
        """Frames sent, modulo 2^30."""
        return self._link.telemetry_frames

    @property
    def collisions(self):
        """Frames sent whose echo was missing or not the same, modulo 2^30."""
        return self._link.collisions
