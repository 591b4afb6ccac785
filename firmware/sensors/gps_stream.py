"""Finds NMEA sentences and UBX frames in the bytes of a GPS receiver, mixed as they come.

    stream = Stream()
    stream.feed(data, len(data))
    while (kind := stream.next()) != NONE:
        ...                            # stream.frame[: stream.length]

Only what has a right checksum is handed out. Whatever stands before it, in between or in place of
its end is skipped, byte by byte where it could hide something, so that an intact sentence or frame
is never lost to noise. Nothing allocates but `Stream()`.

Sources: NMEA 0183 (sentence: `$`, printable characters, `*`, exclusive or of what lies between
them as two hexadecimal digits); u-blox interface descriptions, "UBX frame structure".
"""

from array import array

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython, ptr8, ptr32

NONE = const(0)
SENTENCE = const(1)
UBX = const(2)

RING_SIZE = const(512)
_RING_MASK = const(511)
# From $ to *. The standard allows 82 with the ends; receivers with more decimals send some more.
LONGEST_SENTENCE = const(120)
_SHORTEST_SENTENCE = const(6)  # an address of five characters
# NAV-PVT has 92. What is longer, such as lists of satellites, is skipped as noise is: waiting for
# the end of a frame that is none would hold up everything behind it.
LONGEST_PAYLOAD = const(120)

ALWAYS_FREE = const(380)  # of the ring, besides what is unfinished

# The words of a stream.
_TAIL = const(0)  # ring index of the first byte that is not done with
_COUNT = const(1)  # bytes from there on
_AT = const(2)  # how many of them belong to the sentence so far
_STAR = const(3)  # where in the sentence the * stands, 0 = not come yet
_CHECK = const(4)
_LENGTH = const(5)
_ERRORS = const(6)
_WORDS = const(7)


@micropython.viper
def _put(words: ptr32, ring: ptr8, data: ptr8, count: int):
    head = words[_TAIL] + words[_COUNT]
    at = 0
    while at < count:
        ring[(head + at) & _RING_MASK] = data[at]
        at += 1
    words[_COUNT] += count


@micropython.viper
def _next(words: ptr32, ring: ptr8, frame: ptr8) -> int:
    tail = words[_TAIL]
    count = words[_COUNT]
    kind = NONE
    while count > 0 and kind == NONE:
        drop = 0
        value = ring[tail]
        if value == 0x24:  # $
            at = words[_AT]
            star = words[_STAR]
            check = words[_CHECK]
            if at == 0:
                at = 1
                star = check = 0
            while at < count:
                value = ring[(tail + at) & _RING_MASK]
                if star == 0:
                    if value == 0x2A:
                        star = at
                        if at < _SHORTEST_SENTENCE:
                            drop = at
                            break
                    elif value < 0x20 or value > 0x7E or value == 0x24 or at > LONGEST_SENTENCE:
                        # Broken off, without a checksum, or too long: none of its bytes can
                        # begin anything but this last one.
                        drop = at
                        break
                    else:
                        check ^= value
                        frame[at - 1] = value
                    at += 1
                    continue
                digit = value - 0x30
                if digit > 9:
                    digit = (value | 0x20) - 0x57
                    if digit < 10:
                        digit = -1
                if digit < 0 or digit > 15:
                    drop = at
                    break
                at += 1
                check ^= digit if at == star + 3 else digit << 4
                if at == star + 3:
                    drop = at
                    if check == 0:
                        kind = SENTENCE
                        words[_LENGTH] = star - 1
                    break
            if drop:
                at = 0
                if kind == NONE:
                    words[_ERRORS] += 1
            words[_AT] = at
            words[_STAR] = star
            words[_CHECK] = check
            if drop == 0:
                break
        elif value == 0xB5:
            if count < 2:
                break
            drop = 1
            if ring[(tail + 1) & _RING_MASK] == 0x62:
                if count < 6:
                    break
                length = ring[(tail + 4) & _RING_MASK] | ring[(tail + 5) & _RING_MASK] << 8
                if length <= LONGEST_PAYLOAD:
                    if count < length + 8:
                        break
                    first = second = at = 0
                    while at < length + 4:
                        value = ring[(tail + 2 + at) & _RING_MASK]
                        first += value
                        second += first
                        frame[at] = value
                        at += 1
                    at += 2
                    if (
                        first & 0xFF == ring[(tail + at) & _RING_MASK]
                        and second & 0xFF == ring[(tail + at + 1) & _RING_MASK]
                    ):
                        drop = at + 2
                        kind = UBX
                        words[_LENGTH] = length
                    else:
                        words[_ERRORS] += 1
        else:
            drop = 1
            while drop < count:
                value = ring[(tail + drop) & _RING_MASK]
                if value == 0x24 or value == 0xB5:
                    break
                drop += 1
        tail = (tail + drop) & _RING_MASK
        count -= drop
    words[_TAIL] = tail
    words[_COUNT] = count
    return kind


class Stream:
    """Takes bytes in pieces of any size, gives sentences and frames.

    `frame` holds what `next` found last: of a sentence the characters between $ and *; of a UBX
    frame class, ID, two bytes of length, and the payload. It is good until the next call.
    """

    def __init__(self):
        self.frame = bytearray(128)
        self._words = array("i", bytes(4 * _WORDS))
        self._ring = bytearray(RING_SIZE)

    @property
    @micropython.native
    def length(self):
        """Characters of the sentence, or bytes of payload of the UBX frame."""
        return self._words[_LENGTH]

    @micropython.native
    def feed(self, data, count):
        """Takes the first `count` bytes of `data`; ALWAYS_FREE always fit after a NONE.

        Those that do not fit raise `ValueError`: they would overwrite what was not looked at.
        """
        if not 0 <= count <= RING_SIZE - self._words[_COUNT] or count > len(data):
            raise ValueError("these bytes do not fit")
        _put(self._words, self._ring, data, count)

    @micropython.native
    def next(self):
        """Returns SENTENCE or UBX with the next one in `frame`, or NONE: more bytes are needed."""
        return _next(self._words, self._ring, self.frame)

    @micropython.native
    def take_errors(self):
        """Returns how many sentences and frames were broken since the last call.

        They had a wrong checksum or none, were too long, or were broken off by something else.
        """
        errors = self._words[_ERRORS]
        self._words[_ERRORS] = 0
        return errors

    def clear(self):
        """Forgets what is unfinished, and the errors."""
        words = self._words
        for index in range(_WORDS):
            words[index] = 0
