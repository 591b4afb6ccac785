"""`Reply`: what a handler answers over MSP, and the chunks in which GHST carries it."""

from struct import pack_into

CHUNK_SIZE = 6  # bytes of a response frame that are MSP: the rest is not sent over the air
REPLY_SIZE = 512

_START = 0x10
_ERROR = 0x80
_JUMBO = 0xFF  # in place of the size of an MSP v1 message: a 16-bit size follows the command

# Names, since each use of a literal of more than 31 bits may allocate.
_U32_HIGH = 0xFFFFFFFF
_S32_LOW = -0x80000000
_S32_HIGH = 0x7FFFFFFF


class Reply:
    """One reply: a handler writes the payload, `next_chunk` cuts it up.

    Numbers are clamped to their field; None, for a value that is not known, is written as 0. A
    payload that does not fit becomes an error reply. `pending`: there are chunks left to send.
    """

    def __init__(self, capacity=REPLY_SIZE):
        """Makes the buffer, of `capacity` bytes."""
        self.data = bytearray(capacity)
        self.size = 0
        self.version = 1
        self.command = 0
        self.pending = False
        self._error = 0
        self._sent = -1  # bytes of the payload; -1 before the header
        self._sequence = 0

    def begin(self, version, command):
        """Starts an empty reply to `command` in MSP `version` 1 or 2; forgets the one before."""
        self.version = version
        self.command = command
        self.size = 0
        self.pending = False
        self._error = 0
        self._sent = -1

    def fail(self):
        """Makes it an error reply, which has no payload."""
        self._error = _ERROR

    @property
    def failed(self):
        """Whether this is an error reply."""
        return self._error != 0

    def send(self):
        """Makes the reply `pending`."""
        if self._error:
            self.size = 0
        self.pending = True

    def next_chunk(self, chunk):
        """Writes the next six bytes into `chunk`; returns False, and nothing, if none are left."""
        if not self.pending:
            return False
        status = self._sequence | self.version << 5
        self._sequence = (self._sequence + 1) & 15
        at = 1
        if self._sent < 0:
            self._sent = 0
            status |= _START | self._error
            at = self._header(chunk)
        chunk[0] = status
        # Readers look for the end behind the data: if those fill a chunk to its last byte, the
        # reader waits for another one, as Ghost radios' scripts do, and gets an empty one.
        self.pending = self.size - self._sent >= CHUNK_SIZE - at
        while at < CHUNK_SIZE:
            if self._sent < self.size:
                chunk[at] = self.data[self._sent]
                self._sent += 1
            else:
                chunk[at] = 0
            at += 1
        return True

    def _header(self, chunk):
        size = self.size
        if self.version == 2:
            chunk[1] = 0
            chunk[2] = self.command & 0xFF
            chunk[3] = self.command >> 8
            chunk[4] = size & 0xFF
            chunk[5] = size >> 8
            return 6
        chunk[2] = self.command
        if size < _JUMBO:
            chunk[1] = size
            return 3
        chunk[1] = _JUMBO
        chunk[3] = size & 0xFF
        chunk[4] = size >> 8
        return 5

    def u8(self, value):
        """Writes one byte, 0..255."""
        self._number("<B", 1, value, 0, 0xFF)

    def u16(self, value):
        """Writes two bytes, 0..65535."""
        self._number("<H", 2, value, 0, 0xFFFF)

    def s16(self, value):
        """Writes two bytes, -32768..32767."""
        self._number("<h", 2, value, -0x8000, 0x7FFF)

    def u32(self, value):
        """Writes four bytes, 0..2^32-1."""
        self._number("<I", 4, value, 0, _U32_HIGH)

    def s32(self, value):
        """Writes four bytes, -2^31..2^31-1."""
        self._number("<i", 4, value, _S32_LOW, _S32_HIGH)

    def text(self, value, size=None, pad=0x20):
        """Writes bytes or a str (which allocates); with `size` cut or padded to it."""
        if isinstance(value, str):
            value = value.encode()
        if size is None:
            size = len(value)
        at = self._claim(size)
        if at >= 0:
            for index in range(size):
                self.data[at + index] = value[index] if index < len(value) else pad

    def counted_text(self, value):
        """Writes a byte with the length, then the text."""
        if isinstance(value, str):
            value = value.encode()
        self.u8(len(value))
        self.text(value, min(len(value), 0xFF))

    def _number(self, code, size, value, low, high):
        at = self._claim(size)
        if at >= 0:
            pack_into(code, self.data, at, 0 if value is None else max(low, min(high, value)))

    def _claim(self, size):
        at = self.size
        if at + size > len(self.data):
            self.fail()
            return -1
        self.size = at + size
        return at
