"""Numbers of 16 bits out of the registers of a sensor."""

try:
    import micropython
except ImportError:
    from ghst._host import micropython


# Native: as bytecode it would take the heap for its frame.
@micropython.native
def signed_words(data, words, little_endian):
    """Fills `words`, a list of three, from `data`: two bytes of two's complement each.

    Returns the three folded into one integer below 2^30, which tells measurements apart.
    """
    folded = 0
    at = 0
    for place in range(3):
        first, second = data[at], data[at + 1]
        word = second << 8 | first if little_endian else first << 8 | second
        folded = folded << 7 ^ word
        words[place] = word - 0x10000 if word >= 0x8000 else word
        at += 2
    return folded
