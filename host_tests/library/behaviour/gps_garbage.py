"""Mutated sentences, mutated frames and noise have the same outcome on every interpreter.

`test_gps_model.py` says what is right; this says that 31-bit integers make no difference.
"""

from firmware.sensors import ubx
from firmware.sensors.geodesy import distance_and_direction
from firmware.sensors.gps_solution import empty
from firmware.sensors.gps_stream import NONE, SENTENCE, Stream
from firmware.sensors.nmea import Nmea

from behaviour.gps_support import pvt, sentence
from behaviour.gps_support import ubx as ubx_frame
from behaviour.support import equal

_TEXTS = (
    "GPGGA,091715.00,3403.1320,N,11814.6220,W,1,09,0.9,431.9,M,48.0,M,,",
    "GNRMC,091715.00,A,3403.1320,N,11814.6220,W,23.99,271.26,130726,,,A",
    "GPVTG,271.26,T,,M,23.99,N,44.43,K,A",
    "GPGSA,A,3,01,02,03,04,05,06,07,08,09,,,,1.37,0.90,1.03",
)


class _Random:
    """A linear congruence in small integers."""

    def __init__(self, seed):
        self.state = seed

    def below(self, limit):
        self.state = (self.state * 4005 + 12345) & 0x3FFFF
        return (self.state >> 6) % limit


def _mutated(random, data):
    data = bytearray(data)
    for _ in range(1 + random.below(2)):
        data[random.below(len(data))] = random.below(256)
    return bytes(data)


def _part(random):
    kind = random.below(8)
    if kind < 3:
        # A right checksum behind wrong characters, so that the fields are read.
        text = _TEXTS[random.below(4)]
        at = random.below(len(text))
        digit = b"0123456789,.-NEA"[random.below(16)]
        return sentence(text[:at] + chr(digit) + text[at + 1 :])
    if kind == 3:
        payload = bytearray(pvt()[6:-2])
        for _ in range(random.below(3)):
            payload[20 + random.below(60)] = random.below(256)
        return ubx_frame(0x01, 0x07, bytes(payload))
    if kind == 4:
        return _mutated(random, pvt())
    if kind == 5:
        return _mutated(random, sentence(_TEXTS[random.below(4)]))
    if kind == 6:
        return sentence(_TEXTS[random.below(4)])[: random.below(60)]
    return bytes([random.below(256) for _ in range(random.below(40))])


def _outcome(seed, parts):
    """What becomes of `parts` random parts: sentences, frames, errors, solutions, a checksum."""
    random = _Random(seed)
    stream = Stream()
    solution = empty()
    way = empty()
    nmea = Nmea(solution)
    counts = [0, 0, 0, 0]
    check = 0
    for now_ms in range(parts):
        data = _part(random)
        stream.feed(data, len(data))
        while True:
            kind = stream.next()
            if kind == NONE:
                break
            if kind == SENTENCE:
                new = nmea.feed(stream.frame, stream.length, now_ms)
            else:
                new = ubx.name(stream.frame) == ubx.NAV_PVT
                new = new and ubx.read_pvt(stream.frame, stream.length, solution)
            counts[kind - 1] += 1
            if new:
                counts[3] += 1
                way[0], way[1] = solution[1], solution[2]
                distance_and_direction(way, way)
                for value in list(solution) + list(way):
                    check = (check * 31 + value) & 0xFFFFFF
    counts[2] = stream.take_errors() + nmea.take_errors()
    counts.append(check)
    return tuple(counts)


def a_hundred_parts():
    equal(_outcome(1, 100), (39, 13, 66, 13, 4_641_413))


def others():
    for seed, wanted in ((2, (11, 6, 11, 6, 2_760_363)), (77, (8, 3, 19, 4, 10_239_628))):
        equal(_outcome(seed, 30), wanted, f"seed {seed}")
