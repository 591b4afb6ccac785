# only on esp32
"""The Ghost wire on `machine.UART` where interrupts are soft: written for the ESP32.

Wiring: RX to the wire with a pull-up; TX to the wire through a diode, cathode at TX, which
releases the wire while TX is idle. (1 kOhm does as well, but pulls the wire up while it is idle.)

A soft interrupt may come late by any time, a garbage collection for one. So the age of a frame is
known by two looks at the UART: at the earlier one the frame was not complete, at the later one it
was. Only where the two are so close that the whole window of the slot, 1.0 to 1.3 ms behind the
frame, can be kept for certain, telemetry is sent. `UART.IRQ_RXIDLE` would be of no use: on the
ESP32 it comes 0.5 to 1 ms after the last byte.
"""

import time

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython

from ghst.decoder import COUNTER_MASK, HEAD, RF_PROTOCOL, RING, TAIL, word

_FRAME_BYTES = const(14)
_SLOT_US = const(1000)
_LATEST_US = const(1300)
# How long a byte may be here before `any` counts it. With timeout_char=1 the ESP32 hands over what
# it has received when the line has been idle for one byte.
_HIDDEN_US = const(60)
# From the last look at the clock to our start bit.
_SEND_US = const(60)
# So much earlier than the slot is the timer, whose callback may come late and waits for the rest.
_TIMER_US = const(150)
# Our echo is here 450 us after the frame was sent, a frame of the receiver not before 700 us.
_ECHO_US = const(600)
# Bytes of a frame are 100 us apart at most; beside that a byte takes 24 us and is hidden.
_GAP_US = const(250)
# Modes with a downlink: Normal (5), Race (6), Long Range (8), Race250 (10); or the request bit.
_BIDIRECTIONAL = const(0x560)
_TELEMETRY_REQUESTED = const(0x20)


class UartLink:
    """Feeds a `ghst.Receiver` from a UART and sends telemetry in the slot, if it is certain.

    Telemetry is sent behind frames that came between two looks which were less than 180 us apart:
    mostly those that came while `poll` was listening. So a main loop that has nothing to do had
    better listen for half a millisecond than sleep. All else works at any pace.
    """

    def __init__(self, uart, rx, timer, receiver, on_control=None):
        """`uart`: `machine.UART(..., 415000, tx=, rx=, rxbuf=256, timeout=0, timeout_char=1)`;
        `rx`: `machine.Pin` of its RX; `timer`: a hardware `machine.Timer` that nobody else uses
        (not number 0); `receiver`: a `ghst.Receiver`; `on_control`: called behind bytes that
        brought control frames, with their number.
        """
        self.receiver = receiver
        self.in_hand = False  # bytes, and what follows from them: nobody else had better decide
        self._busy = False
        self.telemetry_frames = 0
        self.collisions = 0
        self._uart = uart
        self._rx = rx
        self._timer = timer
        self._on_control = on_control
        self._buffer = bytearray(64)
        self._frame = bytearray(_FRAME_BYTES)
        self._echo = bytearray(_FRAME_BYTES)
        self._waiting = False  # `_frame` waits for its slot, or for its echo
        self._sent = False
        self._open = False
        self._again = False
        self._unfinished = False
        self._ticks_us = time.ticks_us
        self._ticks_diff = time.ticks_diff
        self._looked_us = time.ticks_us()
        self._bytes_us = self._complete_us = self._earliest_us = self._sent_us = self._looked_us
        # Bound once: it allocates.
        self._any = uart.any
        self._receive_bound = self._receive
        self._slot_bound = self._slot
        self._edge_bound = self._edge

    def start(self):
        """Begins to receive."""
        uart = self._uart
        # The RP2 has no IRQ_RX, and its IRQ_RXIDLE comes 76 us behind the last byte.
        trigger = uart.IRQ_RX if hasattr(uart, "IRQ_RX") else uart.IRQ_RXIDLE
        uart.irq(self._receive_bound, trigger)

    def stop(self):
        """Stops receiving and sending; a frame on its way is finished."""
        self._close_slot()
        self._timer.deinit()
        self._uart.irq(None)

    def poll(self, listen_us=0):
        """Takes what has come; returns how many control frames.

        `listen_us`: for how long to wait for bytes if there are none. It returns as soon as some
        are there. While a slot is about to come it does nothing: the interrupts do.
        """
        return 0 if self._open else self._receive_bound(self._uart, listen_us)

    @property
    def slot_free(self):
        """Whether no telemetry frame waits for its slot."""
        return not self._waiting

    def send(self, frame):
        """Has the 14 bytes of `frame` sent in the next certain slot; only while it is free."""
        if len(frame) != _FRAME_BYTES:
            raise ValueError(f"a telemetry frame has 14 bytes, not {len(frame)}")
        for index in range(_FRAME_BYTES):
            self._frame[index] = frame[index]
        self._waiting = True

    def discard(self):
        """Forgets a frame that waits; one that is on its way goes on."""
        if not self._sent:
            self._waiting = False

    # Native: two looks have to follow one another quickly, and a bytecode function with so many
    # locals has them on the heap.
    @micropython.native
    def _receive(self, uart, listen_us=0):
        # The interrupt, or the main loop, which it may interrupt.
        if self._busy:
            self._again = True
            return 0
        controls = 0
        while True:
            self._busy = True
            self._again = False
            try:
                controls += self._look(uart, listen_us)
            finally:
                self._busy = self.in_hand = False
            if not self._again:
                break
        return controls

    @micropython.native
    def _look(self, uart, listen_us):
        ticks_us = self._ticks_us
        ticks_diff = self._ticks_diff
        look = self._any
        controls = 0
        before_us = self._looked_us
        begin_us = now_us = ticks_us()
        count = look()
        while not count and ticks_diff(now_us, begin_us) < listen_us:
            before_us = now_us
            now_us = ticks_us()
            count = look()
        self._looked_us = now_us
        if count:
            self.in_hand = True
            complete_us = ticks_us()
            controls = self._take(uart, count, now_us)
            if controls:
                if self._waiting:
                    self._open_slot(before_us, complete_us)
                if self._on_control is not None:
                    self._on_control(controls)
        elif self._unfinished and ticks_diff(now_us, self._bytes_us) > _GAP_US:
            self._unfinished = False
            self.receiver.discard_partial()
        return controls

    @micropython.native
    def _take(self, uart, count, now_us):
        self._close_slot()
        controls = 0
        if self._sent:
            # What comes early is our echo, whatever it looks like.
            early = self._ticks_diff(now_us, self._sent_us) < _ECHO_US
            if early and count < _FRAME_BYTES:
                return 0  # until all of it is there
            self._sent = self._waiting = False
            self.telemetry_frames = (self.telemetry_frames + 1) & COUNTER_MASK
            whole = count >= _FRAME_BYTES
            if whole:
                uart.readinto(self._echo)
                count -= _FRAME_BYTES
            if not whole or self._echo != self._frame:
                self.collisions = (self.collisions + 1) & COUNTER_MASK
                if early:
                    self._drop(uart, count)
                    return 0
                if whole:
                    controls = self.receiver.feed(self._echo)
        self._bytes_us = now_us
        buffer = self._buffer
        while count > 0:
            length = min(count, len(buffer))
            uart.readinto(buffer, length)
            controls += self.receiver.feed(buffer, length)
            count -= length
        memory = self.receiver.memory
        self._unfinished = word(memory, TAIL) & 255 != word(memory, HEAD)
        return controls

    def _drop(self, uart, count):
        while count > 0:
            length = min(count, len(self._buffer))
            uart.readinto(self._buffer, length)
            count -= length

    def _slot_follows(self):
        # Behind a control frame that is the last thing received, in a mode with a downlink.
        memory = self.receiver.memory
        start = word(memory, HEAD) - _FRAME_BYTES
        if memory[RING | start & 255] != 0x82 or memory[RING | start + 2 & 255] & 0xD0 != 0x10:
            return False
        protocol = word(memory, RF_PROTOCOL)
        return bool(protocol & _TELEMETRY_REQUESTED or _BIDIRECTIONAL >> (protocol & 31) & 1)

    @micropython.native
    def _open_slot(self, before_us, complete_us):
        # The frame was complete between `_earliest_us` and `_complete_us`.
        self._earliest_us = time.ticks_add(before_us, -_HIDDEN_US)
        self._complete_us = complete_us
        known_us = time.ticks_diff(complete_us, self._earliest_us)
        if known_us > _LATEST_US - _SLOT_US - _SEND_US or not self._slot_follows():
            return
        wait_us = _SLOT_US - _TIMER_US - time.ticks_diff(time.ticks_us(), complete_us)
        if wait_us > 0:
            # Bytes that follow one another closely are hidden until the last one: a falling edge
            # is not. Soft interrupts come in turn, so that it comes before the timer's.
            self._open = True
            self._rx.irq(self._edge_bound, self._rx.IRQ_FALLING)
            self._timer.init(
                mode=self._timer.ONE_SHOT, freq=1_000_000 // wait_us, callback=self._slot_bound
            )

    def _close_slot(self):
        if self._open:
            self._open = False
            self._rx.irq(None)

    def _edge(self, _rx):
        self._close_slot()

    @micropython.native
    def _slot(self, _timer):
        elapsed_us = time.ticks_diff(time.ticks_us(), self._complete_us)
        # Early: that is the timer of a slot before this one, which was closed.
        if not self._open or elapsed_us < _SLOT_US - 2 * _TIMER_US:
            return
        self._close_slot()
        while time.ticks_diff(time.ticks_us(), self._complete_us) < _SLOT_US:
            pass
        if self._uart.any() or not self._rx.value():
            return
        if time.ticks_diff(time.ticks_us(), self._earliest_us) <= _LATEST_US - _SEND_US:
            self._uart.write(self._frame)
            self._sent_us = time.ticks_us()
            self._sent = True
