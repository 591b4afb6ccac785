"""The CRC of a GHST frame, by the decoder's own loop and table.

A module of its own: a board that only receives never loads it.
"""

import sys

from ghst.decoder import CRC_ONLY, HEAD, RING, TAIL, prepare, scan, set_word

# The words and the table of a decoder; it needs no ring.
_memory = bytearray(RING)
prepare(_memory)
set_word(_memory, CRC_ONLY, 1)


def crc8(buf, start, stop):
    """Returns the CRC-8/DVB-S2 of `buf[start:stop]`: 0..255, 0 where there are no bytes.

    Polynomial 0xD5, initial value 0, no reflection, no final xor (description: CRC). The caller
    keeps 0 <= start and stop <= len(buf): on the device nothing checks the bounds. There is one
    place for start and stop: on a board not for an interrupt or the other core while the main loop
    may be in here. On CPython any thread may call it at any time.
    """
    set_word(_memory, TAIL, start)
    set_word(_memory, HEAD, stop if stop > start else start)
    return scan(_memory, buf)


if sys.implementation.name != "micropython":
    from ghst._host import one_at_a_time

    crc8 = one_at_a_time(crc8)
