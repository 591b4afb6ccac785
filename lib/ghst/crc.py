"""CRC-8/DVB-S2, the check byte of every GHST frame (description: CRC)."""

try:
    import micropython
except ImportError:
    from ghst._host import micropython, ptr8


@micropython.viper
def _fill(table: ptr8):
    index = 0
    while index < 256:
        crc = index
        bit = 0
        while bit < 8:
            crc = crc << 1
            if crc & 0x100:
                crc = crc ^ 0x1D5
            bit += 1
        table[index] = crc
        index += 1


# In RAM also when the module is frozen: a flash read that misses the RP2040's cache costs more
# than the whole step.
_table = bytearray(256)
_fill(_table)


@micropython.viper
def crc8(buf: ptr8, start: int, stop: int) -> int:
    """Returns the CRC-8/DVB-S2 of `buf[start:stop]`: 0..255, 0 where there are no bytes.

    Polynomial 0xD5, initial value 0, no reflection, no final xor. The caller keeps
    0 <= start and stop <= len(buf): on the device nothing checks the bounds.
    """
    crc = 0
    table = ptr8(_table)
    while start < stop:
        crc = table[crc ^ buf[start]]
        start += 1
    return crc
