# only on rp2
"""The hard interrupts of the Ghost wire on a UART: bytes in, telemetry out, TX released.

All three have the priority of the frame interrupt, so that none of them interrupts another.
"""

# ruff: noqa: F821 - ptr8, ptr32 and uint are viper's own names
import micropython
from micropython import const

# Words of the array that they work on.
WRITE = const(0)  # ring index behind the last byte
STAMP = const(1)  # microsecond clock at the last bytes
OPEN = const(2)  # the frame interrupt wants a telemetry frame sent in this slot
CLOCK_REGISTER = const(3)
RING_ADDRESS = const(4)
TAIL = const(5)  # addresses of the decoder's words
SKIPPED_BYTES = const(6)
FORCE_REGISTER = const(7)  # sets the interrupt flags of the PIO block
FORCE_BIT = const(8)
ADDRESS_REGISTER = const(9)  # the slot is open while its state machine is
OPEN_ADDRESS = const(10)  # here
TX_CONTROL = const(11)  # register that gives the TX pin its function:
TX_UART = const(12)
TX_RELEASED = const(13)
COUNT_FIFO = const(14)  # of the state machine that tells when our frame is over
SENT_REGISTER = const(15)  # flag 4 of it: the frame has begun to go out
ZERO = const(16)
# What a byte adds at most to the time between two interrupts: at 415 kBd 24 us, and a pause that
# made no interrupt of its own, 76 us and what it takes to get there. Between them are one pause of
# 100 us and one of 76 us more.
BYTE_US = const(17)
FRAME_US = const(18)  # how long TX is driven
WORDS = const(19)

_RING = const(512)  # where the ring stands in the decoder's memory
_COUNTER_MASK = const(0x3FFFFFFF)
_SENT_FLAG = const(16)
_FRAME_BYTES = const(14)
# MicroPython's buffer behind the FIFO of 32: together less than the ring holds.
_BUFFER = const(128)
# A frame must not begin later than 1200 us behind the control frame, or the next one might follow
# its echo at once. The interrupt of the UART is 80 us behind the control frame.
_LATEST_US = const(1100)


def idle_handler(context, buffer, on_frame):
    """Returns the handler of the receive time-out: the bytes go into the decoder's ring.

    `context`: address of the words; `buffer`: as large as the UART's; `on_frame`: the handler of
    the frame interrupt, which is raised. A closure over five variables would allocate on every
    call.
    """

    @micropython.viper
    def on_idle(uart):
        w = ptr32(int(context))
        now = ptr32(w[CLOCK_REGISTER])[0]
        elapsed = now - w[STAMP]
        w[STAMP] = now
        w[OPEN] = 0
        # A break leaves no byte. More than there are must not be read: that would wait for them.
        count = int(uart.any())
        head = w[WRITE]
        unfinished = (head - ptr32(w[TAIL])[0]) & 255
        if unfinished and (count == 0 or uint(elapsed) > uint((count + 1) * w[BYTE_US])):
            skipped = ptr32(w[SKIPPED_BYTES])
            skipped[0] = (skipped[0] + unfinished) & _COUNTER_MASK
            ptr32(w[TAIL])[0] = _RING | head
        if count:
            behind_echo = 0
            if ptr32(w[SENT_REGISTER])[0] & _SENT_FLAG and count > _FRAME_BYTES:
                behind_echo = count - _FRAME_BYTES
                count = _FRAME_BYTES
            source = ptr8(buffer)
            ring = ptr8(w[RING_ADDRESS])
            while count:
                uart.readinto(buffer, count)
                at = 0
                while at < count:
                    ring[head] = source[at]
                    head = (head + 1) & 255
                    at += 1
                w[WRITE] = head
                if behind_echo:
                    # The echo has to be alone when it is compared. Called, not raised: where the
                    # tick has masked it, failsafe may last for one frame more.
                    on_frame(uart)
                    count = behind_echo
                    behind_echo = 0
                elif count == _BUFFER:
                    # The UART's buffer was full: there may be more in its FIFO.
                    count = int(uart.any())
                else:
                    count = 0
            ptr32(w[FORCE_REGISTER])[0] = w[FORCE_BIT]

    return on_idle


def slot_handler(context, write, frame):
    """Returns the handler of the interrupt behind 1 ms of quiet, which sends or does not.

    `write`: method of the UART; `frame`: what goes out.
    """

    @micropython.viper
    def on_slot(_machine):
        w = ptr32(int(context))
        if w[OPEN]:
            w[OPEN] = 0
            elapsed = uint(ptr32(w[CLOCK_REGISTER])[0] - w[STAMP])
            if ptr32(w[ADDRESS_REGISTER])[0] == w[OPEN_ADDRESS] and elapsed < uint(_LATEST_US):
                ptr32(w[TX_CONTROL])[0] = w[TX_UART]
                write(frame)
                ptr32(w[COUNT_FIFO])[0] = w[FRAME_US]
                ptr32(w[FORCE_REGISTER])[0] = _SENT_FLAG

    return on_slot


def sent_handler(context):
    """Returns the handler of the interrupt behind our frame, which releases TX."""

    @micropython.viper
    def on_sent(_machine):
        w = ptr32(int(context))
        ptr32(w[TX_CONTROL])[0] = w[TX_RELEASED]

    return on_sent
