"""Finds GHST frames in a ring of received bytes and decodes them: the one decoder of the project.

`Receiver` calls it with bytes that it copied into the ring, the interrupt of the wire driver with
bytes that DMA put there. Nothing in here allocates, waits or raises, whatever the bytes are.
"""

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython, ptr8, ptr16, ptr32

from ghst.crc import crc8

# The ring: RING_SIZE received bytes, then a mirror of its first bytes so that a frame which wraps
# is contiguous, then the four raw bytes of the last 0x14 frame.
RING_SIZE = const(256)
VTX_CONTROL = const(272)
RING_ALLOCATION = const(276)

# Words of the state array.
TAIL = const(0)  # ring index of the first byte that is not decoded yet
HEAD = const(1)  # ring index behind the last received byte; only Receiver.feed keeps it here
FRAMES = const(2)
CRC_ERRORS = const(3)
LENGTH_ERRORS = const(4)
UNKNOWN_FRAMES = const(5)
FOREIGN_FRAMES = const(6)
MSP_FRAMES = const(7)
SKIPPED_BYTES = const(8)
LINK_QUALITY = const(9)
RSSI = const(10)  # sign inverted, as on the wire
RF_PROTOCOL = const(11)  # the whole protocol byte
TX_POWER = const(12)
VTX_FLAGS = const(13)
VTX_FREQUENCY = const(14)
VTX_POWER = const(15)
VTX_BAND_CHANNEL = const(16)
STATE_WORDS = const(17)


@micropython.viper
def unpack(ring: ptr8, at: int, pulses: ptr16):
    """Decodes the channels of the control frame whose first byte is `ring[at]` into `pulses`.

    `pulses` holds 16 channels in quarter microseconds (6000 = 1500 us). Types 0x10-0x1F are in
    legacy scaling, 0x30-0x3F in 12-bit scaling; 0x10-0x12 and 0x30-0x32 carry four auxiliary
    channels, all others the four primaries alone (description: Control Packet IDs, Control
    Packet). Values below -100 % stay ordered: the arithmetic is signed.
    """
    low = ring[at + 3] | (ring[at + 4] << 8) | (ring[at + 5] << 16)
    high = ring[at + 6] | (ring[at + 7] << 8) | (ring[at + 8] << 16)
    kind = ring[at + 2]
    auxiliary = 4 + ((kind & 3) << 2)
    if kind & 0x20:
        # 12-bit: one step is a quarter microsecond, centre 2048; auxiliaries 4 us, centre 128.
        pulses[0] = (low & 0xFFF) + 3952
        pulses[1] = (low >> 12) + 3952
        pulses[2] = (high & 0xFFF) + 3952
        pulses[3] = (high >> 12) + 3952
        if kind < 0x33:
            pulses[auxiliary] = (ring[at + 9] << 4) + 3952
            pulses[auxiliary + 1] = (ring[at + 10] << 4) + 3952
            pulses[auxiliary + 2] = (ring[at + 11] << 4) + 3952
            pulses[auxiliary + 3] = (ring[at + 12] << 4) + 3952
    else:
        # Legacy: 5/16 us a step, centre 1984; auxiliaries 5 us, centre 124. 1984 * 5 / 4 = 2480
        # exactly, so the offset can be taken out of the shift.
        pulses[0] = (((low & 0xFFF) * 5) >> 2) + 3520
        pulses[1] = (((low >> 12) * 5) >> 2) + 3520
        pulses[2] = (((high & 0xFFF) * 5) >> 2) + 3520
        pulses[3] = (((high >> 12) * 5) >> 2) + 3520
        if kind < 0x13:
            pulses[auxiliary] = ring[at + 9] * 20 + 3520
            pulses[auxiliary + 1] = ring[at + 10] * 20 + 3520
            pulses[auxiliary + 2] = ring[at + 11] * 20 + 3520
            pulses[auxiliary + 3] = ring[at + 12] * 20 + 3520


@micropython.viper
def scan(ring: ptr8, head: int, state: ptr32, pulses: ptr16) -> int:
    """Decodes every complete frame between `state[TAIL]` and `head`; returns the control frames.

    A control frame is valid, for address 0x82 and of type 0x10-0x1F or 0x30-0x3F. A byte that
    cannot begin a valid frame is skipped alone, so that an intact frame behind a false start is
    never lost with it. An unfinished frame stays in the ring until its rest has come.
    """
    tail = state[TAIL]
    controls = 0
    while True:
        available = (head - tail) & (RING_SIZE - 1)
        if available < 2:
            break
        if tail > RING_SIZE - 14:
            index = 0
            while index < 13:
                ring[RING_SIZE + index] = ring[index]
                index += 1
        address = ring[tail]
        length = ring[tail + 1]
        valid = False
        if address >= 0x80 and address <= 0x89:
            if length >= 2 and length <= 12:
                if available < length + 2:
                    break
                if int(crc8(ring, tail + 2, tail + 1 + length)) == ring[tail + 1 + length]:
                    valid = True
                else:
                    state[CRC_ERRORS] += 1
            else:
                state[LENGTH_ERRORS] += 1
        if not valid:
            state[SKIPPED_BYTES] += 1
            tail = (tail + 1) & (RING_SIZE - 1)
            continue
        kind = ring[tail + 2]
        if address != 0x82:
            state[FOREIGN_FRAMES] += 1
            # VTX set-up goes to the goggles (0x83) and, over GECO, to 0x80.
            if kind == 0x20 and length == 12 and (address == 0x80 or address == 0x83):
                state[VTX_FLAGS] = ring[tail + 3]
                state[VTX_FREQUENCY] = ring[tail + 4] | (ring[tail + 5] << 8)
                state[VTX_POWER] = ring[tail + 6] | (ring[tail + 7] << 8)
                state[VTX_BAND_CHANNEL] = ring[tail + 8]
        elif kind & 0xD0 == 0x10:
            if length == 12:
                unpack(ring, tail, pulses)
                state[FRAMES] += 1
                controls += 1
                if kind & 0x0F == 3:
                    state[LINK_QUALITY] = ring[tail + 9]
                    state[RSSI] = ring[tail + 10]
                    state[RF_PROTOCOL] = ring[tail + 11]
                    power = ring[tail + 12]
                    state[TX_POWER] = power - ((power & 0x80) << 1)
                elif kind == 0x14:
                    index = 0
                    while index < 4:
                        ring[VTX_CONTROL + index] = ring[tail + 9 + index]
                        index += 1
            else:
                state[LENGTH_ERRORS] += 1
        elif kind == 0x21 or kind == 0x22:
            state[MSP_FRAMES] += 1
        else:
            state[UNKNOWN_FRAMES] += 1
        tail = (tail + length + 2) & (RING_SIZE - 1)
    state[TAIL] = tail
    return controls


@micropython.viper
def append(ring: ptr8, state: ptr32, data: ptr8, start: int, stop: int) -> int:
    """Copies `data[start:stop]`, or what fits of it, into the ring; returns the new start.

    At most 13 bytes are unfinished after a scan, so there is always room.
    """
    head = state[HEAD]
    room = (RING_SIZE - 1) - ((head - state[TAIL]) & (RING_SIZE - 1))
    if stop - start > room:
        stop = start + room
    while start < stop:
        ring[head] = data[start]
        start += 1
        head = (head + 1) & (RING_SIZE - 1)
    state[HEAD] = head
    return start
