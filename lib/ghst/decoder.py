"""Finds GHST frames in a ring of received bytes and decodes them: the one decoder of the project.

`Receiver` runs it over bytes that it copied into the ring, the interrupt of the wire driver over
bytes that DMA put there, `crc8` over a caller's buffer. It is one function because a call costs
the RP2040 three to seven microseconds, as much as all the channels of a frame. Nothing in here
allocates, waits or raises, whatever the bytes are.
"""

from array import array

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython, ptr8, ptr16, ptr32

# The ring: RING_SIZE received bytes, then a mirror of its first bytes so that a frame which wraps
# is contiguous, then the four raw bytes of the last 0x14 frame.
RING_SIZE = const(256)
VTX_CONTROL = const(272)
RING_ALLOCATION = const(276)

# Words of the state.
TAIL = const(0)  # ring index of the first byte that is not decoded yet
HEAD = const(1)  # ring index behind the last received byte
_CRC_ONLY = const(2)  # 1: compute a CRC and nothing else
FRAMES = const(3)
CRC_ERRORS = const(4)
LENGTH_ERRORS = const(5)
UNKNOWN_FRAMES = const(6)
FOREIGN_FRAMES = const(7)
MSP_FRAMES = const(8)
SKIPPED_BYTES = const(9)
LINK_QUALITY = const(10)
RSSI = const(11)  # sign inverted, as on the wire
RF_PROTOCOL = const(12)  # the whole protocol byte
TX_POWER = const(13)
VTX_FLAGS = const(14)
VTX_FREQUENCY = const(15)
VTX_POWER = const(16)
VTX_BAND_CHANNEL = const(17)
_STATE_WORDS = const(18)
# Behind the state: the CRC of each single byte. In RAM, where no cache miss can delay it.
_CRC_TABLE = const(72)  # 4 * _STATE_WORDS
_WORDS = const(82)


@micropython.viper
def _fill_crc_table(words: ptr32):
    table = ptr8(words)
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
        table[_CRC_TABLE + index] = crc
        index += 1


def new_state():
    """Returns an `array('i')` for `scan`: everything zero, nothing received."""
    words = array("i", [0] * _WORDS)
    _fill_crc_table(words)
    return words


@micropython.viper
def _others(ring: ptr8, words: ptr32, at: int):
    """Takes what the valid frame at `ring[at]` carries besides channels and link data."""
    address = ring[at]
    length = ring[at + 1]
    kind = ring[at + 2]
    if address != 0x82:
        words[FOREIGN_FRAMES] += 1
        # VTX set-up goes to the goggles (0x83) and, over GECO, to 0x80.
        if kind == 0x20 and length == 12 and (address == 0x80 or address == 0x83):
            words[VTX_FLAGS] = ring[at + 3]
            words[VTX_FREQUENCY] = ring[at + 4] | (ring[at + 5] << 8)
            words[VTX_POWER] = ring[at + 6] | (ring[at + 7] << 8)
            words[VTX_BAND_CHANNEL] = ring[at + 8]
    elif kind & 0xD0 == 0x10:
        if length != 12:
            words[LENGTH_ERRORS] += 1
        elif kind == 0x14:
            index = 0
            while index < 4:
                ring[VTX_CONTROL + index] = ring[at + 9 + index]
                index += 1
    elif length == 12 and (kind == 0x21 or kind == 0x22):
        words[MSP_FRAMES] += 1
    else:
        words[UNKNOWN_FRAMES] += 1


@micropython.viper
def scan(ring: ptr8, words: ptr32, pulses: ptr16) -> int:
    """Decodes every complete frame between TAIL and HEAD; returns how many control frames.

    `ring`: RING_ALLOCATION bytes; `words`: from `new_state`; `pulses`: 16 channels in quarter
    microseconds (6000 = 1500 us). A control frame is valid, for address 0x82 and of type
    0x10-0x1F or 0x30-0x3F. A byte that cannot begin a valid frame is skipped alone, so that an
    intact frame behind a false start is never lost with it. An unfinished frame stays in the ring
    until its rest has come.
    """
    tail = words[TAIL]
    controls = 0
    table = ptr8(words)
    while True:
        length = 0
        if words[_CRC_ONLY]:
            at = tail
            stop = words[HEAD]
        else:
            available = (words[HEAD] - tail) & (RING_SIZE - 1)
            if available < 2:
                break
            if tail > RING_SIZE - 14:
                at = 0
                while at < 13:
                    ring[RING_SIZE + at] = ring[at]
                    at += 1
            at = tail + 2
            # Known addresses are 0x80-0x89, lengths 2-12: with one type byte up to ten payload
            # bytes (description: Addresses, Frame).
            if ring[tail] & 0xF0 == 0x80 and ring[tail] < 0x8A:
                length = ring[tail + 1]
                if length < 2 or length > 12:
                    length = 0
                    words[LENGTH_ERRORS] += 1
                elif available < length + 2:
                    break
            stop = tail + 1 + length
        crc = 0
        while at < stop:
            crc = table[_CRC_TABLE + (crc ^ ring[at])]
            at += 1
        if words[_CRC_ONLY]:
            controls = crc
            break
        if length and crc != ring[stop]:
            words[CRC_ERRORS] += 1
            length = 0
        if not length:
            words[SKIPPED_BYTES] += 1
            tail = (tail + 1) & (RING_SIZE - 1)
            continue
        kind = ring[tail + 2]
        plain = False
        if ring[tail] == 0x82 and kind & 0xD0 == 0x10 and length == 12:
            words[FRAMES] += 1
            controls += 1
            # Legacy: 5/16 us a step, centre 1984, and 5/4 * 1984 = 2480 exactly, so the centre can
            # leave the shift; auxiliaries 5 us, centre 124. 12-bit: 1/4 us, centre 2048;
            # auxiliaries 4 us, centre 128.
            scale = 5
            base = 3520
            if kind & 0x20:
                scale = 4
                base = 3952
            packed = ring[tail + 3] | (ring[tail + 4] << 8) | (ring[tail + 5] << 16)
            pulses[0] = (((packed & 0xFFF) * scale) >> 2) + base
            pulses[1] = (((packed >> 12) * scale) >> 2) + base
            packed = ring[tail + 6] | (ring[tail + 7] << 8) | (ring[tail + 8] << 16)
            pulses[2] = (((packed & 0xFFF) * scale) >> 2) + base
            pulses[3] = (((packed >> 12) * scale) >> 2) + base
            if kind & 0x0F < 3:
                at = (kind & 3) << 2
                scale = scale << 2
                pulses[at + 4] = ring[tail + 9] * scale + base
                pulses[at + 5] = ring[tail + 10] * scale + base
                pulses[at + 6] = ring[tail + 11] * scale + base
                pulses[at + 7] = ring[tail + 12] * scale + base
                plain = True
            elif kind & 0x0F == 3:
                words[LINK_QUALITY] = ring[tail + 9]
                words[RSSI] = ring[tail + 10]
                words[RF_PROTOCOL] = ring[tail + 11]
                words[TX_POWER] = (ring[tail + 12] ^ 0x80) - 0x80
                plain = True
        if not plain:
            _others(ring, words, tail)
        tail = (tail + length + 2) & (RING_SIZE - 1)
    words[TAIL] = tail
    return controls


@micropython.viper
def discard(words: ptr32):
    """Drops the bytes that are still unfinished: the line went quiet in the middle of a frame."""
    words[SKIPPED_BYTES] += (words[HEAD] - words[TAIL]) & (RING_SIZE - 1)
    words[TAIL] = words[HEAD]


@micropython.viper
def append(ring: ptr8, words: ptr32, data: ptr8, start: int, stop: int) -> int:
    """Copies `data[start:stop]`, or what fits of it, into the ring; returns the new start.

    At most 13 bytes are unfinished after a scan, so there is always room.
    """
    head = words[HEAD]
    room = (RING_SIZE - 1) - ((head - words[TAIL]) & (RING_SIZE - 1))
    if stop - start > room:
        stop = start + room
    while start < stop:
        ring[head] = data[start]
        start += 1
        head = (head + 1) & (RING_SIZE - 1)
    words[HEAD] = head
    return start


_crc_words = new_state()
_crc_words[_CRC_ONLY] = 1
_no_pulses = array("H")


@micropython.viper
def crc8(buf, start: int, stop: int) -> int:
    """Returns the CRC-8/DVB-S2 of `buf[start:stop]`: 0..255, 0 where there are no bytes.

    Polynomial 0xD5, initial value 0, no reflection, no final xor (description: CRC). The caller
    keeps 0 <= start and stop <= len(buf): on the device nothing checks the bounds.
    """
    words = ptr32(_crc_words)
    words[TAIL] = start
    words[HEAD] = stop
    return int(scan(buf, _crc_words, _no_pulses))
