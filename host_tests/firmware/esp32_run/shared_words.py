"""`uctypes.addressof` and viper's pointers for an interpreter whose addresses have 64 bits.

What `firmware.shapes` describes keeps addresses in words of 32 bits, as all boards have them. Here
an object gets a number in place of its address, and `ptr16` and `ptr32` find it by that.
"""

_FIRST = 0x1000
_objects = []  # (first address, address behind it, object, bytes an item)


def _size(item):
    return 1 if isinstance(item, bytearray) else 2 if "'H'" in repr(item) else 4


def addressof(item):
    """Returns the number of `item`, an array of halfwords or words or a bytearray."""
    for first, _, known, _ in _objects:
        if known is item:
            return first
    first = (_objects[-1][1] + 15) & ~15 if _objects else _FIRST
    size = _size(item)
    _objects.append((first, first + size * len(item), item, size))
    return first


class _Pointer:
    def __init__(self, address):
        self._address = address

    def __int__(self):
        return self._address

    def _find(self, index):
        address = self._address + self._bytes * index
        for first, end, item, size in _objects:
            if first <= address < end:
                assert (address - first) % self._bytes == 0
                return item, address - first, size
        raise AssertionError(f"nothing is at {address:#x}")

    def __getitem__(self, index):
        item, offset, size = self._find(index)
        if size == 1:
            return int.from_bytes(item[offset : offset + self._bytes], "little")
        assert size == self._bytes
        value = item[offset // size]
        return value - (value >> 31 << 32) if size == 4 and value >= 0 else value

    def __setitem__(self, index, value):
        item, offset, size = self._find(index)
        for part in range(self._bytes // size):
            item[offset // size + part] = value >> 8 * size * part & (1 << 8 * size) - 1


class ptr16(_Pointer):
    _bytes = 2


class ptr32(_Pointer):
    _bytes = 4


def uint(value):
    """Returns `value` as an unsigned word."""
    return value & 0xFFFFFFFF
