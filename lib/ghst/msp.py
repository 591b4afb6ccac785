"""MSP inside GHST: requests out of 0x21 and 0x22 frames, replies into the chunks of 0x28 frames.

    responder = Responder()
    responder.command(0x3000, answer)  # def answer(request, reply): reply.u16(...)
    responder.feed(payload)            # the ten bytes of each 0x21 and 0x22 frame
    while responder.next_chunk(chunk): # six bytes for each 0x28 frame
        ...

The first byte of every payload is the status: bits 0-3 sequence, bit 4 start of a message, bits
5-6 MSP version (1, or 2, which 0 also stands for), bit 7 error. `ghst.msp_commands` answers what
a flight controller is asked. The buffers, 512 bytes each for request and reply, are made once;
nothing in here allocates after that, and no bytes make it raise.
"""

from ghst.msp_reply import Reply

PAYLOAD_SIZE = 10  # bytes of a request frame that are MSP, status byte included
REQUEST_SIZE = 512

_START = 0x10
_JUMBO = 0xFF  # in place of the size of an MSP v1 message: a 16-bit size follows the command
_DONT_REPLY = 0x01  # flag of MSP v2

# What `Request.feed` returns.
UNFINISHED = 0
COMPLETE = 1
OVERSIZED = 2

_IDLE = 0
_OPEN = 1
_TRAILING = 2


def _next(counter):
    """Returns the counter one further; behind the largest small integer it goes on at zero."""
    return 0 if counter == 0x3FFFFFFF else counter + 1


class Request:
    """Puts one request after the other together.

    After `feed` returned COMPLETE: `version` 1 or 2, `flags` (v2; else 0), `command`, and `size`
    bytes of payload in `data`. They stay until the next `feed`. Counters, each modulo 2^30:
    `sequence_errors` messages dropped for a gap or a repetition in the sequence, `restarts`
    messages dropped because the next one began, `oversized` messages that are larger than `data`,
    `orphans` chunks that continue nothing, `malformed` chunks of version 3 or too short for their
    header.
    """

    def __init__(self, capacity=REQUEST_SIZE):
        """Makes the buffer, of `capacity` bytes."""
        self.data = bytearray(capacity)
        self.version = self.flags = self.command = self.size = 0
        self.sequence_errors = self.restarts = self.oversized = 0
        self.orphans = self.malformed = 0
        self._phase = _IDLE
        self._sequence = 0
        self._received = 0

    def feed(self, payload, start=0):
        """Takes the chunk at `payload[start:]`, at most PAYLOAD_SIZE bytes.

        Returns COMPLETE with the last chunk of a message; OVERSIZED with the first chunk of one
        that does not fit, whose `version` and `command` are then known; else UNFINISHED.
        """
        stop = min(len(payload), start + PAYLOAD_SIZE)
        if start >= stop or payload[start] & 0x60 == 0x60:
            self.malformed = _next(self.malformed)
            self._phase = _IDLE
            return UNFINISHED
        status = payload[start]
        start += 1
        if status & _START:
            if self._phase == _OPEN:
                self.restarts = _next(self.restarts)
            self._phase = _IDLE
            start = self._begin(payload, start, stop, 1 if status & 0x60 == 0x20 else 2)
            if not start:
                self.malformed = _next(self.malformed)
                return UNFINISHED
            if self.size > len(self.data):
                self.oversized = _next(self.oversized)
                return OVERSIZED
        elif self._phase == _IDLE:
            self.orphans = _next(self.orphans)
            return UNFINISHED
        elif status & 15 != self._sequence:
            if self._phase == _OPEN:
                self.sequence_errors = _next(self.sequence_errors)
            else:
                self.orphans = _next(self.orphans)
            self._phase = _IDLE
            return UNFINISHED
        elif self._phase == _TRAILING:
            self._phase = _IDLE
            return UNFINISHED
        self._sequence = (status + 1) & 15
        return self._append(payload, start, stop)

    def _begin(self, payload, start, stop, version):
        """Reads a message's header; returns where its data begin, 0 if the header is cut off."""
        room = stop - start
        if version == 2:
            if room < 5:
                return 0
            self.flags = payload[start]
            self.command = payload[start + 1] | payload[start + 2] << 8
            self.size = payload[start + 3] | payload[start + 4] << 8
            start += 5
        else:
            if room < 2 or (payload[start] == _JUMBO and room < 4):
                return 0
            self.flags = 0
            self.size = payload[start]
            self.command = payload[start + 1]
            start += 2
            if self.size == _JUMBO:
                self.size = payload[start] | payload[start + 1] << 8
                start += 2
        self.version = version
        self._received = 0
        return start

    def _append(self, payload, start, stop):
        """Copies what still belongs to the message: beyond its size nothing does."""
        while start < stop and self._received < self.size:
            self.data[self._received] = payload[start]
            self._received += 1
            start += 1
        if self._received < self.size:
            self._phase = _OPEN
            return UNFINISHED
        # Radios' scripts append an xor of everything: behind a full chunk in one of its own.
        self._phase = _TRAILING if start == stop else _IDLE
        return COMPLETE

    def u8(self, at):
        """Returns the payload byte at `at`, 0 beyond the end."""
        return self.data[at] if at < self.size else 0

    def u16(self, at):
        """Returns the unsigned 16-bit number at `at`; what is beyond the end counts as 0."""
        return self.u8(at) | self.u8(at + 1) << 8


class Responder:
    """Answers requests with the handlers that are registered, one reply at a time.

    A request that is complete while a reply is still under way takes that reply's place, and ends
    it even if it wants no reply itself: radios ask again, or something else, only when they no
    longer wait, and there is one buffer. The one exception is a repeated question, a request
    without payload for the very command and version that are being answered: the reply under way
    is its answer and goes on, or a slow link would begin it for ever.

    Counters, each modulo 2^30: `answered` requests handled without error, `errors` error replies,
    `replaced` replies cut off, `repeated` questions answered by the reply under way. `last_error`
    is the last exception that came out of a handler, None before the first.
    """

    def __init__(self, request=None, reply=None):
        """Makes a responder without commands; `request` and `reply` where other sizes are due."""
        self.request = request or Request()
        self.reply = reply or Reply()
        self.answered = self.errors = self.replaced = self.repeated = 0
        self.last_error = None
        self._handlers = {}

    def command(self, number, handler):
        """Has `handler(request, reply)` answer `number`, 0..65535; None for `handler`: nobody.

        The handler reads a `Request` and writes the payload of a `Reply`. It returns False, or
        raises, to have an error replied. It runs in `feed` and should not take long.
        """
        if not 0 <= number <= 0xFFFF:
            raise ValueError(f"MSP command is {number}, must be 0..65535")
        self._handlers[number] = handler

    def feed(self, payload, start=0):
        """Takes the ten bytes of a 0x21 or 0x22 frame at `payload[start:]`; True: reply pending.

        Both types are handled alike; there are no other types to hand over.
        """
        request = self.request
        outcome = request.feed(payload, start)
        if outcome != UNFINISHED:
            self._answer(request, outcome == OVERSIZED)
        return self.reply.pending

    def next_chunk(self, chunk):
        """Writes six bytes for a response frame (0x28); returns False if nothing is pending."""
        return self.reply.next_chunk(chunk)

    def discard(self):
        """Drops the reply under way, for callers that lost the link."""
        self.reply.pending = False

    def _answer(self, request, oversized):
        reply = self.reply
        if reply.pending:
            if (
                not request.size
                and request.command == reply.command
                and request.version == reply.version
            ):
                self.repeated = _next(self.repeated)
                return
            self.replaced = _next(self.replaced)
        reply.begin(request.version, request.command)
        handler = self._handlers.get(request.command)
        if oversized or handler is None:
            reply.fail()
        else:
            try:
                if handler(request, reply) is False:
                    reply.fail()
            except Exception as error:  # an application's mistake must not end the main loop
                self.last_error = error
                reply.fail()
        if reply.failed:
            self.errors = _next(self.errors)
        else:
            self.answered = _next(self.answered)
        if not request.flags & _DONT_REPLY:
            reply.send()
