"""Nothing is allocated for a sentence, a frame or a solution, whatever comes."""

from firmware.sensors import ubx
from firmware.sensors.geodesy import distance_and_direction
from firmware.sensors.gps import Gps
from firmware.sensors.gps_solution import empty
from firmware.sensors.gps_stream import Stream

from behaviour.gps_support import pvt, sentence
from behaviour.support import equal
from behaviour.telemetry_memory import _expect_no_heap

# West of 107 degrees: a longitude that is no small integer.
_RMC = "GPRMC,091715.00,A,3403.1320,N,11814.6220,W,23.99,271.26,130726,,,A"
_VTG = "GPVTG,271.26,T,,M,23.99,N,44.43,K,A"
_GGA = "GPGGA,091715.00,3403.1320,N,11814.6220,W,1,09,0.9,431.9,M,48.0,M,,"
_GSA = "GPGSA,A,3,01,02,03,04,05,06,07,08,09,,,,1.37,0.90,1.03"
_EPOCH = (_GSA, _RMC, _VTG, _GGA)
_NO_FIX = ("GPRMC,,V,,,,,,,,,,N", "GPGGA,,,,,,0,00,99.99,,,,,,")
_WRONG = (_RMC[:30], _GGA.replace("N", "x"), _GSA.replace("1.37", "-"), _VTG.replace(".", ""))
_PVT = {"lat_e7": 340_522_000, "lon_e7": -1_182_437_000}


class _Uart:
    """Takes nothing from the heap itself; the time is told by the calls."""

    def __init__(self):
        self.data = b""
        self.at = 0

    def init(self, **options):
        pass

    def any(self):
        return len(self.data) - self.at

    def readinto(self, buffer, count):
        at = self.at
        for index in range(count):
            buffer[index] = self.data[at + index]
        self.at = at + count
        return count

    def txdone(self):
        return True

    def write(self, data):
        raise AssertionError("not set up, so nothing is to be written")


def _updates(parts, configure=False):
    """A Gps that is connected, and calls that give it one part after the other."""
    uart = _Uart()
    gps = Gps(uart, configure=configure)
    calls = []
    now_ms = 0

    def call(data, now_ms):
        def update():
            uart.data = data
            uart.at = 0
            while True:
                gps.update(now_ms)
                if uart.at == len(data):
                    break
            gps.update(now_ms)
            gps.update(now_ms)

        return update

    # The first of all has the code loaded.
    call(sentence(_GSA), 0)()
    for part in parts:
        now_ms += 25
        calls.append(call(part, now_ms))
    return gps, calls


def sentences_with_a_fix():
    parts = [sentence(text) for text in _EPOCH * 5]
    gps, calls = _updates(parts)
    for call in calls:
        call()
    equal((gps.fix_3d, gps.home_fix, gps.lon_e7), (True, True, -1_182_437_000))
    _expect_no_heap(calls)
    # All parts: once before, once with the heap locked, once watched.
    equal(gps.updates, 3 * 5)


def sentences_without_a_fix_and_wrong_ones():
    parts = [sentence(text) for text in _NO_FIX + _WRONG + _EPOCH]
    parts += [part[:20] for part in parts[2:5]] + [part.replace(b"*", b"*0") for part in parts[:3]]
    gps, calls = _updates(parts)
    _expect_no_heap(calls)
    equal(gps.faults, 2 * 10)


def navigation_solutions():
    parts = [pvt(**_PVT), pvt(fix=0), pvt(lat_e7=1 << 30), pvt(length=20), pvt(**_PVT)[:-1]]
    gps, calls = _updates(parts)
    _expect_no_heap(calls)
    equal(gps.protocol, "UBX")


def noise_and_silence():
    noise = bytes(range(256))
    starts = b"$GPGGA,\xb5\x62\x01\x07\x5c\x00" * 12
    parts = [
        sentence(_GSA),
        noise,
        starts,
        b"",
        bytes(range(255, -1, -1)),
        b"",
        b"",
        sentence(_GSA),
    ]
    gps, calls = _updates(parts)
    _expect_no_heap(calls)
    # All calls once more with the time going on: the fix ends, and the receiver is lost.
    now_ms = 0
    later = []
    while now_ms < 8000:
        now_ms += 500
        later.append(lambda now_ms=now_ms: gps.update(now_ms))
    _expect_no_heap(later)
    equal(gps.baudrate, None)


def a_stream_and_a_way_home():
    stream = Stream()
    data = sentence(_GGA) + pvt() + b"noise"
    points = empty()
    result = empty()
    solution = empty()
    frame = pvt(**_PVT)[2:]

    def stream_all():
        stream.feed(data, len(data))
        while stream.next():
            pass

    _expect_no_heap(
        (
            stream_all,
            lambda: ubx.read_pvt(frame, 92, solution),
            lambda: distance_and_direction(solution, result),
            lambda: distance_and_direction(points, result),
        )
    )
