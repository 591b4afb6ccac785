"""Finds GHST frames among received bytes and decodes them: the one decoder of the project.

`Receiver` runs it over bytes that it copied into the ring, the interrupt of the wire driver over
bytes that DMA put there, `crc8` over a caller's buffer. It is one function that works on one
block of memory because a call costs the RP2040 microseconds, each argument adds to it, and so does
the use of a global name. Nothing in here allocates, waits or raises, whatever the bytes.
"""

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython, ptr8, ptr16, ptr32, uint

# The memory of a decoder begins with 32-bit words: state.
TAIL = const(0)  # where the first byte stands that is not decoded yet: RING..RING + 255
HEAD = const(1)  # ring index 0..255 behind the last received byte
CRC_ONLY = const(2)  # compute a CRC and nothing else: `ghst.crc`
LINE_QUIET = const(3)  # drop what is unfinished: the line went quiet in the middle of a frame
FRAMES = const(4)
CRC_ERRORS = const(5)
LENGTH_ERRORS = const(6)
UNKNOWN_FRAMES = const(7)
FOREIGN_FRAMES = const(8)
MSP_FRAMES = const(9)
SKIPPED_BYTES = const(10)
LINK_QUALITY = const(11)
RSSI = const(12)  # sign inverted, as on the wire
RF_PROTOCOL = const(13)  # the whole protocol byte
TX_POWER = const(14)  # two's complement, as on the wire
VTX_SETUPS = const(15)  # 0x20 frames for the goggles or the radio
VTX_CONTROLS = const(16)  # 0x14 frames
# A counter goes on at zero, and is never more than a small integer holds.
COUNTER_MASK = const(0x3FFFFFFF)
# Offsets of payloads, ten bytes each: of the last 0x20 frame, of the last 0x14 frame (the last
# four bytes alone), and of the last eight MSP frames, each in the place that the three lowest
# bits of its number name.
VTX_SETUP = const(96)
VTX_CONTROL = const(112)
MSP_QUEUE = const(128)
MSP_QUEUE_LENGTH = const(8)
# The CRC of each single byte: in RAM, where no cache miss can delay it.
CRC_TABLE = const(256)
# The ring of received bytes, on a multiple of its size, and a mirror of its first bytes so that a
# frame which wraps is contiguous.
RING = const(512)
RING_SIZE = const(256)
MEMORY_SIZE = const(784)
_RING_WORD = const(128)
_MIRROR = const(192)


@micropython.viper
def prepare(memory: ptr8):
    """Makes MEMORY_SIZE bytes, all zero, ready for `scan`: nothing received."""
    words = ptr32(memory)
    words[TAIL] = RING
    index = 0
    while index < 256:
        crc = index
        bit = 0
        while bit < 8:
            crc = crc << 1
            if crc & 0x100:
                # Polynomial 0xD5, not reflected (description: CRC).
                crc = crc ^ 0x1D5
            bit += 1
        memory[CRC_TABLE + index] = crc
        index += 1


@micropython.viper
def scan(memory: ptr8, channels: ptr8) -> int:
    """Decodes every complete frame between TAIL and HEAD; returns how many control frames.

    `memory`: from `prepare`; `channels`: array of 16 halfwords for the pulse widths in quarter
    microseconds (6000 = 1500 us). A control frame is valid, for address 0x82 and of type
    0x10-0x1F or 0x30-0x3F. A byte that cannot begin a valid frame is skipped alone, so that an
    intact frame behind a false start is never lost with it. An unfinished frame stays in the ring
    until its rest has come.
    """
    words = ptr32(memory)
    source = memory
    tail = words[TAIL]
    controls = 0
    while True:
        length = 0
        if words[CRC_ONLY]:
            source = channels
            at = tail
            stop = words[HEAD]
        else:
            available = (words[HEAD] - tail) & 255
            if available < 2:
                break
            if tail > RING + RING_SIZE - 14:
                words[_MIRROR] = words[_RING_WORD]
                words[_MIRROR + 1] = words[_RING_WORD + 1]
                words[_MIRROR + 2] = words[_RING_WORD + 2]
                words[_MIRROR + 3] = words[_RING_WORD + 3]
            # Known addresses are 0x80-0x89, lengths 2-12: with one type byte up to ten payload
            # bytes (description: Addresses, Frame).
            at = stop = 0
            if uint(memory[tail] - 0x80) < uint(10):
                length = memory[tail + 1]
                if uint(length - 2) > uint(10):
                    length = 0
                    words[LENGTH_ERRORS] = (words[LENGTH_ERRORS] + 1) & COUNTER_MASK
                elif available < length + 2:
                    break
                else:
                    at = tail + 2
                    stop = tail + length + 1
        crc = 0
        if (stop - at) & 1:
            crc = memory[CRC_TABLE + source[at]]
            at += 1
        while at < stop:
            # Two bytes a round, or half of the time goes into the loop.
            crc = memory[CRC_TABLE + (crc ^ source[at])] ^ source[at + 1]
            crc = memory[CRC_TABLE + crc]
            at += 2
        if words[CRC_ONLY]:
            return crc
        if length and crc != memory[stop]:
            words[CRC_ERRORS] = (words[CRC_ERRORS] + 1) & COUNTER_MASK
            length = 0
        if length == 0:
            words[SKIPPED_BYTES] = (words[SKIPPED_BYTES] + 1) & COUNTER_MASK
            tail = RING | ((tail + 1) & 255)
            continue
        kind = memory[tail + 2]
        counter = UNKNOWN_FRAMES
        kept = 0
        if memory[tail] != 0x82:
            counter = FOREIGN_FRAMES
            # VTX set-up goes to the goggles (0x83) and, over GECO, to 0x80.
            if kind == 0x20 and length == 12 and (memory[tail] == 0x80 or memory[tail] == 0x83):
                words[VTX_SETUPS] = (words[VTX_SETUPS] + 1) & COUNTER_MASK
                kept = VTX_SETUP
        elif kind & 0xD0 == 0x10:
            counter = LENGTH_ERRORS
            if length == 12:
                counter = FRAMES
                controls += 1
                # Legacy: 5/16 us a step, centre 1984, and 5/4 * 1984 = 2480 exactly, so the
                # centre can leave the shift; auxiliaries 5 us, centre 124. 12-bit: 1/4 us, centre
                # 2048; auxiliaries 4 us, centre 128.
                scale = 5
                base = 3520
                if kind & 0x20:
                    scale = 4
                    base = 3952
                pulses = ptr16(channels)
                at = 0
                stop = tail + 3
                while at < 4:
                    crc = memory[stop] | (memory[stop + 1] << 8) | (memory[stop + 2] << 16)
                    pulses[at] = (((crc & 0xFFF) * scale) >> 2) + base
                    pulses[at + 1] = (((crc >> 12) * scale) >> 2) + base
                    stop += 3
                    at += 2
                kind = kind & 0x1F
                if kind < 0x13:
                    at = ((kind & 3) << 2) + 4
                    scale = scale << 2
                    pulses[at] = memory[stop] * scale + base
                    pulses[at + 1] = memory[stop + 1] * scale + base
                    pulses[at + 2] = memory[stop + 2] * scale + base
                    pulses[at + 3] = memory[stop + 3] * scale + base
                elif kind == 0x13:
                    words[LINK_QUALITY] = memory[stop]
                    words[RSSI] = memory[stop + 1]
                    words[RF_PROTOCOL] = memory[stop + 2]
                    words[TX_POWER] = memory[stop + 3]
                elif memory[tail + 2] == 0x14:
                    words[VTX_CONTROLS] = (words[VTX_CONTROLS] + 1) & COUNTER_MASK
                    kept = VTX_CONTROL + 6
        elif length == 12 and uint(kind - 0x21) < uint(2):
            counter = MSP_FRAMES
            kept = MSP_QUEUE | ((words[MSP_FRAMES] & (MSP_QUEUE_LENGTH - 1)) << 4)
        if kept:
            at = tail + 3
            if counter == FRAMES:
                at = tail + 9
            while at < tail + 13:
                memory[kept] = memory[at]
                kept += 1
                at += 1
        words[counter] = (words[counter] + 1) & COUNTER_MASK
        tail = RING | ((tail + length + 2) & 255)
    if words[LINE_QUIET]:
        at = words[SKIPPED_BYTES] + ((words[HEAD] - tail) & 255)
        words[SKIPPED_BYTES] = at & COUNTER_MASK
        words[LINE_QUIET] = 0
        tail = RING | words[HEAD]
    words[TAIL] = tail
    return controls


@micropython.viper
def append(memory: ptr8, data: ptr8, start: int, stop: int) -> int:
    """Copies `data[start:stop]`, or what fits of it, into the ring; returns the new start.

    At most 13 bytes are unfinished after a scan, so there is always room.
    """
    words = ptr32(memory)
    head = words[HEAD]
    room = 255 - ((head - words[TAIL]) & 255)
    if stop - start > room:
        stop = start + room
    while start < stop:
        memory[RING | head] = data[start]
        start += 1
        head = (head + 1) & 255
    words[HEAD] = head
    return start


@micropython.viper
def word(memory: ptr32, index: int) -> int:
    """Returns a word of the state."""
    return memory[index]


@micropython.viper
def set_word(memory: ptr32, index: int, value: int):
    """Sets a word of the state."""
    memory[index] = value
