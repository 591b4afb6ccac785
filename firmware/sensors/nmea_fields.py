"""Takes NMEA sentences apart: kind, fields, numbers, positions.

Integers only, and nothing allocates. Source: NMEA 0183, as receivers' manuals tell it (u-blox,
"NMEA protocol"; MediaTek).
"""

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython, ptr8, ptr32

OTHER = const(0)
GGA = const(1)
RMC = const(2)
VTG = const(3)
GSA = const(4)

UNKNOWN = const(-0x20000000)  # as in gps_solution; an empty field
WRONG = const(-0x20000001)  # a field that is no number, or out of range

MOST_FIELDS = const(24)
_LARGEST = const(26_000_000)  # a tenth of what fits into a small integer; times do as well


@micropython.viper
def split(sentence: ptr8, length: int, starts: ptr8) -> int:
    """Writes to `starts` where each field begins, and the end of the last one plus one.

    `starts`: 25 bytes. Returns the kind of the sentence and 8 times the number of fields, of at
    most 24; the first is the address.
    """
    starts[0] = 0
    fields = 1
    at = 0
    while at < length and fields < MOST_FIELDS:
        if sentence[at] == 0x2C:
            starts[fields] = at + 1
            fields += 1
        at += 1
    if at < length:
        fields -= 1
    else:
        starts[fields] = length + 1
    kind = OTHER
    # The talkers are GA, GB, GI, GL, GN, GP, GQ and, of the first BeiDou receivers, BD.
    if starts[1] == 6 and (sentence[0] == 0x47 or (sentence[0] == 0x42 and sentence[1] == 0x44)):
        name = sentence[2] << 16 | sentence[3] << 8 | sentence[4]
        if name == 0x474741:
            kind = GGA
        elif name == 0x524D43:
            kind = RMC
        elif name == 0x565447:
            kind = VTG
        elif name == 0x475341:
            kind = GSA
    return fields << 3 | kind


@micropython.viper
def number(sentence: ptr8, starts: ptr8, field: int, decimals: int) -> int:
    """Returns the decimal number in a field times 10 ** `decimals`, rounded half up.

    UNKNOWN where there is nothing; WRONG for what is no number, and from 2.6e8 on.
    """
    at = int(starts[field])
    end = int(starts[field + 1]) - 1
    if at >= end:
        return UNKNOWN
    negative = 0
    if sentence[at] == 0x2D:
        negative = 1
        at += 1
    value = 0
    digits = 0
    places = -1  # behind the point
    round_up = 0
    beyond = 0  # whether there is anything behind the digit that rounds
    while at < end:
        digit = sentence[at] - 0x30
        at += 1
        if digit == -2 and places < 0:
            places = 0
            continue
        if digit < 0 or digit > 9:
            return WRONG
        digits += 1
        if places < decimals:
            if value >= _LARGEST:
                return WRONG
            value = value * 10 + digit
        elif places == decimals:
            round_up = digit
        elif digit:
            beyond = 1
        if places >= 0:
            places += 1
    if digits == 0:
        return WRONG
    if places < 0:
        places = 0
    while places < decimals:
        if value >= _LARGEST:
            return WRONG
        value *= 10
        places += 1
    # Half up: of a negative number the half goes towards zero.
    if round_up > 5 or (round_up == 5 and (beyond or not negative)):
        value += 1
    return 0 - value if negative else value


@micropython.viper
def position(sentence: ptr8, starts: ptr8, field: int, target: ptr32) -> int:
    """Reads latitude, N or S, longitude, E or W from `field` on.

    Writes both to `target`, rounded to 1e-7 degrees. Returns 1; 0 if they are empty, -1 if they
    are wrong: `target` is not changed then. Any number of decimals of the minutes will do.
    """
    latitude = 0
    which = 0
    while which < 2:
        at = int(starts[field])
        end = int(starts[field + 1]) - 1
        letter = int(starts[field + 1])
        if at >= end:
            return 0
        whole = 0
        while at < end and sentence[at] != 0x2E:
            digit = sentence[at] - 0x30
            if digit < 0 or digit > 9:
                return -1
            whole = whole * 10 + digit
            if whole > 18000:
                return -1
            at += 1
        minutes_e7 = whole % 100
        if minutes_e7 >= 60:
            return -1
        places = 0
        at += 1
        while places < 7 or at < end:
            digit = 0
            if at < end:
                digit = sentence[at] - 0x30
                if digit < 0 or digit > 9:
                    return -1
                at += 1
            # What stands behind the seventh place is less than a 60th of the result's last one,
            # and cannot change how that is rounded.
            if places < 7:
                minutes_e7 = minutes_e7 * 10 + digit
                places += 1
        angle_e7 = whole // 100 * 10000000 + (minutes_e7 + 30) // 60
        # In two halves: 1.8e9 is no small integer, and viper takes only those.
        if angle_e7 - 900000000 > which * 900000000:
            return -1
        if int(starts[field + 2]) - letter != 2:
            return -1
        value = sentence[letter]
        if value == (0x57 if which else 0x53):
            angle_e7 = 0 - angle_e7
        elif value != (0x45 if which else 0x4E):
            return -1
        if which:
            target[0] = latitude
            target[1] = angle_e7
        latitude = angle_e7
        field += 2
        which += 1
    return 1


@micropython.viper
def cm_s_from_knots(knots_e3: int) -> int:
    """Converts 0..2000000 thousandths of a knot; a knot is 1852 m an hour, 463/9 cm/s."""
    return (knots_e3 * 926 + 9000) // 18000


@micropython.viper
def letter(sentence: ptr8, starts: ptr8, field: int) -> int:
    """Returns the character of a field that has one, 0 of any other."""
    at = int(starts[field])
    return int(sentence[at]) if int(starts[field + 1]) - at == 2 else 0
