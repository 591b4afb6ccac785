"""Neither the builders nor the scheduler allocate: with the heap locked, and watched."""

import gc

import micropython

from ghst import telemetry
from ghst.schedule import Schedule

_GARBAGE = 5000


def _touches_the_heap(calls):
    """Whether any of `calls` takes from the heap, even if it gives back before it returns.

    There is garbage, and the collector is set to run as soon as anything is allocated: so if the
    garbage is still there afterwards, nothing was. The lock cannot tell: with it the interpreter
    takes the stack where it would take the heap.
    """
    gc.collect()
    bytearray(_GARBAGE)
    gc.threshold(16)
    try:
        before = gc.mem_alloc()
        for call in calls:
            call()
        return before - gc.mem_alloc() > _GARBAGE // 2
    finally:
        gc.threshold(-1)


def _expect_no_heap(calls):
    micropython.heap_lock()
    try:
        for call in calls:
            call()
    finally:
        micropython.heap_unlock()
    if _touches_the_heap(calls):
        places = [place for place in range(len(calls)) if _touches_the_heap(calls[place:][:1])]
        raise AssertionError(f"calls number {places} of {len(calls)} allocated")


def _quiet():
    return max(1, 2)


def _many_locals(a, b, c, d, e, f, g, h):
    return max(a, max(b, max(c, max(d, max(e, max(f, max(g, h)))))))


def the_watch_does_see_an_allocation():
    number = (1 << 62) - 1
    for call in (
        bytearray,
        lambda: number + 1,
        # The interpreter's own, gone again when the function returns.
        lambda: _many_locals(1, 2, 3, 4, 5, 6, 7, 8),
    ):
        assert _touches_the_heap((_quiet, call, _quiet)), call
    assert not _touches_the_heap((_quiet, _quiet))


# All made before the calls, those beyond a 32-bit port's small integers too.
_NUMBERS = (
    655350,
    5,
    -5,
    65535,
    0,
    900000000,
    -900000000,
    (1 << 30) - 1,
    -(1 << 30),
    1 << 30,
    1800000000,
    -1800000000,
    (1 << 31) - 1,
    -(1 << 31),
    1 << 32,
    -(1 << 64),
)


def _each(build):
    """Has `build` make a call of a frame and of each number, and expects no heap in the calls."""
    frames = bytearray(14), memoryview(bytearray(40))[9:23]
    _expect_no_heap([build(frame, value) for frame in frames for value in _NUMBERS])


def building_a_pack_status():
    _each(lambda frame, n: lambda: telemetry.pack_status(frame, n, n, n, True))
    _each(lambda frame, n: lambda: telemetry.pack_status(frame, n, n, n, False))


def building_a_position():
    _each(lambda frame, n: lambda: telemetry.gps_primary(frame, n, n, n))


def building_motion_and_home():
    def build(frame, n):
        # Native for eight arguments: its own place for them must not be on the heap either.
        @micropython.native
        def call():
            telemetry.gps_secondary(frame, n, n, n, n, n, True, False)

        return call

    _each(build)


def building_magnetometer_and_barometer():
    _each(lambda frame, n: lambda: telemetry.mag_baro(frame, n, n, n))
    _each(lambda frame, n: lambda: telemetry.mag_baro(frame, None, n, n, 5))


def building_an_msp_response():
    frame = bytearray(14)
    chunk = bytearray(b"\xff" * 6)
    parts = b"", b"\xff" * 6, chunk, memoryview(chunk)[1:4]

    def build(part):
        return lambda: telemetry.msp_response(frame, part)

    _expect_no_heap([build(part) for part in parts])


def _refresh(sources, now_ms):
    for source in sources:
        source.refresh(now_ms)


def _slots(schedule, now_ms):
    schedule.next(now_ms, True)
    for _ in range(6):
        schedule.next(now_ms)


# The clock at its start, on both sides of the change of sign and of the wrap.
_TIMES = (0, 1, (1 << 29) - 1, 1 << 29, (1 << 30) - 101, (1 << 30) - 1)


def choosing_the_next_frame():
    schedule = Schedule()
    longest = 1 << 28
    sources = [schedule.add(kind, longest, longest) for kind in (0x23, 0x25)]
    sources += [schedule.add(kind, 1, 1) for kind in (0x26, 0x27)]

    def refresh_at(now_ms):
        return lambda: _refresh(sources, now_ms)

    def slots_at(now_ms):
        return lambda: _slots(schedule, now_ms)

    calls = []
    for now_ms in _TIMES:
        # What was refreshed at one end of the clock, asked for there and at the other.
        calls.append(refresh_at(now_ms))
        calls.append(slots_at(now_ms))
        calls += [slots_at(later_ms) for later_ms in _TIMES]
    _expect_no_heap(calls)


def choosing_without_a_source():
    schedule = Schedule()
    _expect_no_heap((lambda: schedule.next(0), lambda: schedule.next(1 << 29)))
