"""Reads JSON, and nothing that only looks like it (RFC 8259)."""

import json

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython, ptr8

LARGEST = 16384
"""Bytes that a file of the user may have."""

_DEEPEST = const(32)
# What may come next.
_VALUE = const(0)
_VALUE_OR_END = const(1)
_NAME = const(2)
_NAME_OR_END = const(3)
_COLON = const(4)
_COMMA_OR_END = const(5)


def parse(data):
    """Returns what `data`, bytes or a bytearray, says.

    Raises `ValueError`, or whatever a parser does with nonsense. MicroPython's own takes text
    without its colons, commas and last brackets, and so makes values out of a damaged file that
    nobody has written.
    """
    if not _well_formed(data, len(data), bytearray(_DEEPEST)):
        raise ValueError("no JSON")
    return json.loads(data)


# In pieces: the M0+ cannot branch as far as one function would reach.
@micropython.viper
def _behind_string(data: ptr8, size: int, at: int) -> int:
    """Where the string ends that begins before `at`; 0 if it does not."""
    while at < size:
        letter = data[at]
        at += 1
        if letter == 0x22:
            return at
        if letter < 0x20:
            return 0
        if letter == 0x5C:
            if at >= size:
                return 0
            letter = data[at]
            at += 1
            digits = 0
            if letter == 0x75:
                digits = 4
            # Behind a backslash: one of "\\/bfnrtu.
            elif not (
                letter == 0x22 or letter == 0x5C or letter == 0x2F or letter == 0x62
            ) and not (letter == 0x66 or letter == 0x6E or letter == 0x72 or letter == 0x74):
                return 0
            while digits:
                if at >= size:
                    return 0
                letter = data[at]
                if letter < 0x30 or letter > 0x39:
                    letter |= 0x20  # a small letter
                    if letter < 0x61 or letter > 0x66:
                        return 0
                at += 1
                digits -= 1
    return 0


@micropython.viper
def _behind_number(data: ptr8, size: int, at: int) -> int:
    """Where the number ends whose first digit should be at `at`; 0 if there is none."""
    part = 0  # digits, perhaps some behind a point, perhaps some behind an e
    while True:
        first = at
        while at < size and data[at] >= 0x30 and data[at] <= 0x39:
            at += 1
        if at == first or (part == 0 and data[first] == 0x30 and at > first + 1):
            return 0
        if at == size:
            return at
        letter = data[at]
        if part == 0 and letter == 0x2E:
            part = 1
        elif part < 2 and (letter == 0x65 or letter == 0x45):
            part = 2
            if at + 1 < size and (data[at + 1] == 0x2B or data[at + 1] == 0x2D):
                at += 1
        else:
            return at
        at += 1


@micropython.viper
def _well_formed(data: ptr8, size: int, closing: ptr8) -> int:
    """Whether names, values and what stands between them follow each other as they must.

    `closing`: memory for the brackets that are to come. Left to the parser: how true, false and
    null are spelled, and UTF-8.
    """
    depth = 0
    expected = _VALUE
    at = 0
    while at < size:
        letter = data[at]
        at += 1
        if letter == 0x20 or letter == 0x0A or letter == 0x0D or letter == 0x09:
            continue
        if letter == 0x3A:  # a colon
            if expected != _COLON:
                return 0
            expected = _VALUE
        elif letter == 0x2C:  # a comma
            if expected != _COMMA_OR_END or depth == 0:
                return 0
            expected = _NAME if closing[depth - 1] == 0x7D else _VALUE
        elif letter == 0x7D or letter == 0x5D:  # } or ]
            if depth == 0 or closing[depth - 1] != letter:
                return 0
            if expected == _VALUE or expected == _NAME or expected == _COLON:  # noqa: SIM109
                return 0
            depth -= 1
            expected = _COMMA_OR_END
        elif letter == 0x22:
            if expected > _NAME_OR_END:
                return 0
            at = int(_behind_string(data, size, at))
            expected = _COMMA_OR_END if expected <= _VALUE_OR_END else _COLON
        else:
            if expected > _VALUE_OR_END:
                return 0
            expected = _COMMA_OR_END
            if letter == 0x7B or letter == 0x5B:  # { or [
                if depth == _DEEPEST:
                    return 0
                closing[depth] = letter + 2
                depth += 1
                expected = _NAME_OR_END if letter == 0x7B else _VALUE_OR_END
            elif letter == 0x74 or letter == 0x6E:  # true, null
                at += 3
            elif letter == 0x66:  # false
                at += 4
            else:
                at = int(_behind_number(data, size, at if letter == 0x2D else at - 1))
        if at == 0:
            return 0
    return 1 if depth == 0 and expected == _COMMA_OR_END else 0
