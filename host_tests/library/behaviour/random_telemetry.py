"""Random values through the builders and back: a workload, judged by the host."""

from binascii import hexlify

from behaviour.random_bytes import step
from ghst import downlink, telemetry

_EDGES = (
    0, 1, 5, 10, 255, 256, 1800, 3600, 32000, 32767, 32768, 65535, 65536, 655344, 655345, 655350,
    900000000, 1 << 30, 1800000000, 1 << 31, 1 << 32, 1 << 64,
)  # fmt: skip


def _number(seed):
    """An integer: near an edge of some field, or of any size up to 31 bits; of either sign."""
    seed = step(seed)
    choice = seed >> 16
    seed = step(seed)
    size = seed >> 8
    if choice & 3 == 0:
        value = _EDGES[(choice >> 4) % len(_EDGES)] + size % 3 - 1
    else:
        seed = step(seed)
        value = seed >> (size % 31)
    return seed, -value if choice & 4 else value


def calls(count, seed):
    """Yields the name of a builder and its arguments, `count` times."""
    for _ in range(count):
        seed = step(seed)
        choice = seed >> 16
        numbers = []
        for _ in range(5):
            seed, value = _number(seed)
            numbers.append(value)
        flags = bool(choice & 16), bool(choice & 32)
        kind = choice % 5
        if kind == 0:
            yield "pack_status", tuple(numbers[:3]) + flags[:1]
        elif kind == 1:
            yield "gps_primary", tuple(numbers[:3])
        elif kind == 2:
            yield "gps_secondary", tuple(numbers) + flags
        elif kind == 3:
            values = [None if choice >> at & 0x100 else numbers[at] for at in range(3)]
            values.append(choice >> 5 & 7)
            yield "mag_baro", tuple(values)
        else:
            chunk = bytes([value & 255 for value in numbers] + [choice >> 4 & 255])
            yield "msp_response", (chunk[: choice % 7],)


def run(count, seed):
    """Yields each frame in hexadecimal digits, and a tuple of what is read from it."""
    frame = bytearray(14)
    for name, arguments in calls(count, seed):
        getattr(telemetry, name)(frame, *arguments)
        yield hexlify(frame).decode(), tuple(downlink.decode(frame))
