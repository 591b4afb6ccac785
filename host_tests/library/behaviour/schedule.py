"""Which telemetry frame is next: turns, rates, time-outs, clocks that wrap."""

from behaviour.support import equal, sample
from ghst import protocol
from ghst.schedule import Schedule, ticks_diff

PACK = protocol.TYPE_PACK_STATUS
GPS_1 = protocol.TYPE_GPS_PRIMARY
GPS_2 = protocol.TYPE_GPS_SECONDARY
BARO = protocol.TYPE_MAG_BARO
MSP = protocol.TYPE_MSP_RESPONSE
KINDS = (PACK, GPS_1, GPS_2, BARO)

_WRAP = 1 << 30


def _schedule(kinds=KINDS, timeout_ms=1000, **keywords):
    schedule = Schedule()
    return schedule, [schedule.add(kind, timeout_ms, **keywords) for kind in kinds]


def _refresh(sources, now_ms):
    for source in sources:
        source.refresh(now_ms)


def _run(slots_hz, milliseconds, start_ms=0):
    """The times at which each kind went out, with sources that are always fresh."""
    schedule, sources = _schedule()
    times = {kind: [] for kind in KINDS}
    for slot in range(milliseconds * slots_hz // 1000):
        elapsed_ms = slot * 1000 // slots_hz
        now_ms = (start_ms + elapsed_ms) % _WRAP
        _refresh(sources, now_ms)
        kind = schedule.next(now_ms)
        if kind:
            times[kind].append(elapsed_ms)
    return times


def nothing_is_sent_without_a_source():
    schedule = Schedule()
    for now_ms in (0, 1, 1000, _WRAP - 1, 0):
        equal(schedule.next(now_ms), 0)


def nothing_is_sent_for_a_source_that_gave_nothing_yet():
    schedule, _ = _schedule()
    for now_ms in range(0, 5000, 50):
        equal(schedule.next(now_ms), 0)


def the_first_values_go_into_the_next_slot():
    schedule, sources = _schedule()
    equal(schedule.next(777), 0)
    sources[2].refresh(780)
    equal(schedule.next(780), GPS_2)
    equal(schedule.next(781), 0)


def sources_that_come_together_go_in_the_order_in_which_they_were_added():
    schedule, sources = _schedule()
    _refresh(sources, 5)
    equal([schedule.next(5 + slot) for slot in range(6)], [PACK, GPS_1, GPS_2, BARO, 0, 0])


def one_kind_goes_out_once_in_its_period():
    schedule, (source,) = _schedule((BARO,))
    times = []
    for now_ms in range(0, 1000, 10):
        source.refresh(now_ms)
        if schedule.next(now_ms):
            times.append(now_ms)
    equal(times, list(range(0, 1000, 100)))


def a_kind_may_have_a_period_of_its_own():
    schedule = Schedule()
    sources = [schedule.add(PACK, 1000, period_ms=500), schedule.add(BARO, 1000, period_ms=40)]
    counts = {0: 0, PACK: 0, BARO: 0}
    for now_ms in range(0, 2000, 10):
        _refresh(sources, now_ms)
        counts[schedule.next(now_ms)] += 1
    equal(counts, {0: 146, PACK: 4, BARO: 50})


def each_kind_ten_times_a_second_where_there_are_slots():
    for slots_hz in sample((250, 160, 55), 2):
        times = _run(slots_hz, 2000)
        equal([len(times[kind]) for kind in KINDS], [20] * 4, slots_hz)


def turn_by_turn_where_there_are_too_few():
    times = _run(19, 4000)
    equal([len(times[kind]) for kind in KINDS], [19] * 4)
    order = sorted((at, kind) for kind in KINDS for at in times[kind])
    equal([kind for _, kind in order], list(KINDS) * 19)


def a_kind_that_waited_for_its_slot_does_not_come_later_each_time():
    # A slot every 70 ms: none is at a multiple of 100 but every tenth.
    schedule, (source,) = _schedule((PACK,))
    times = []
    for now_ms in range(0, 1400, 70):
        source.refresh(now_ms)
        if schedule.next(now_ms):
            times.append(now_ms)
    equal(times, [0, 140, 210, 350, 420, 560, 630, 700, 840, 910, 1050, 1120, 1260, 1330])


def of_a_pause_one_frame_is_made_up_for():
    schedule, (source,) = _schedule((PACK,), timeout_ms=100000)
    source.refresh(0)
    equal(schedule.next(0), PACK)
    times = [now_ms for now_ms in range(5030, 5500, 10) if schedule.next(now_ms)]
    equal(times, [5030, 5040, 5130, 5230, 5330, 5430])


def a_fast_kind_leaves_the_slow_ones_their_turn():
    schedule = Schedule()
    sources = [schedule.add(PACK, 1000, period_ms=1), schedule.add(BARO, 1000, period_ms=1000)]
    times = []
    for now_ms in range(0, 5000, 50):
        _refresh(sources, now_ms)
        if schedule.next(now_ms) == BARO:
            times.append(now_ms)
    assert len(times) == 5, times
    assert all(at - 1000 * turn <= 100 for turn, at in enumerate(times)), times


def an_msp_response_goes_first():
    schedule, sources = _schedule()
    equal(schedule.next(0, True), MSP)
    _refresh(sources, 1)
    equal(schedule.next(1, True), MSP)
    equal(schedule.next(2, msp_waiting=True), MSP)
    # And takes no turn away from anybody.
    equal([schedule.next(3 + slot) for slot in range(5)], [PACK, GPS_1, GPS_2, BARO, 0])


def a_stale_source_is_left_out_and_may_come_back():
    schedule, (source,) = _schedule((PACK,), timeout_ms=300)
    source.refresh(0)
    found = [schedule.next(now_ms) for now_ms in range(0, 700, 100)]
    equal(found, [PACK, PACK, PACK, PACK, 0, 0, 0])
    equal(source.live, False)
    source.refresh(730)
    equal(source.live, True)
    equal([schedule.next(now_ms) for now_ms in (731, 732, 829, 830)], [PACK, 0, 0, PACK])


def the_time_out_counts_to_the_millisecond():
    for age_ms, wanted in ((249, PACK), (250, PACK), (251, 0)):
        schedule, (source,) = _schedule((PACK,), timeout_ms=250)
        source.refresh(10)
        equal(schedule.next(10 + age_ms), wanted, age_ms)


def each_source_has_its_own_time_out():
    schedule = Schedule()
    sources = [schedule.add(PACK, 150), schedule.add(BARO, 350)]
    _refresh(sources, 0)
    found = [schedule.next(now_ms) for now_ms in range(0, 500, 50)]
    equal(found, [PACK, BARO, PACK, BARO, BARO, 0, BARO, 0, 0, 0])
    equal([source.live for source in sources], [False, False])


def a_source_can_be_stopped():
    schedule, sources = _schedule((GPS_1, GPS_2))
    _refresh(sources, 0)
    sources[0].stop()
    equal([schedule.next(now_ms) for now_ms in (0, 1)], [GPS_2, 0])
    sources[1].stop()
    equal(schedule.next(500), 0)
    sources[0].refresh(600)
    equal([schedule.next(now_ms) for now_ms in (600, 601)], [GPS_1, 0])


def values_may_be_newer_than_the_slot_s_time():
    schedule, (source,) = _schedule((PACK,), timeout_ms=50)
    source.refresh(1003)
    equal([schedule.next(now_ms) for now_ms in (1000, 1003)], [0, PACK])


def a_clock_that_wraps_changes_nothing():
    wanted = _run(55, 1000)
    for start_ms in sample((_WRAP - 1, _WRAP - 500, _WRAP // 2 - 500, _WRAP // 2), 2):
        equal(_run(55, 1000, start_ms), wanted, start_ms)


def a_source_goes_stale_across_the_wrap():
    schedule, (source,) = _schedule((PACK,), timeout_ms=300)
    source.refresh(_WRAP - 150)
    found = [schedule.next((_WRAP - 150 + 100 * slot) % _WRAP) for slot in range(6)]
    equal(found, [PACK, PACK, PACK, PACK, 0, 0])


def what_went_stale_stays_so_when_the_clock_comes_round():
    schedule, (source,) = _schedule((PACK,), timeout_ms=300)
    source.refresh(1000)
    equal(schedule.next(2000), 0)
    for now_ms in (1 << 29, (1 << 29) + 1000, _WRAP - 1, 0, 1000, 1100):
        equal(schedule.next(now_ms), 0, now_ms)


def many_days_without_a_slot_keep_nothing_back():
    # As in an RF mode without a downlink: the sources go on, nobody asks what is next.
    for pause_ms in ((1 << 29) - 1, 1 << 29, (1 << 29) + 12345, _WRAP - 1, _WRAP - 50):
        schedule, (source,) = _schedule((PACK,))
        source.refresh(100)
        equal(schedule.next(100), PACK)
        now_ms = (100 + pause_ms) % _WRAP
        source.refresh(now_ms)
        equal(schedule.next(now_ms), PACK, pause_ms)


def differences_of_times():
    for end_ms, start_ms, wanted in (
        (5, 3, 2),
        (3, 5, -2),
        (2, _WRAP - 3, 5),
        (_WRAP - 3, 2, -5),
        (1 << 29, 0, -(1 << 29)),
        ((1 << 29) - 1, 0, (1 << 29) - 1),
        (0, (1 << 29) - 1, 1 - (1 << 29)),
        (0, _WRAP - 1, 1),
        (_WRAP - 1, 0, -1),
    ):
        equal(ticks_diff(end_ms, start_ms), wanted, (end_ms, start_ms))


def differences_are_those_of_micropython():
    try:
        from time import ticks_add
        from time import ticks_diff as own
    except ImportError:  # CPython has none
        return
    for start in (0, 1, _WRAP // 2, _WRAP - 1):
        for step in (-5000000, -1, 0, 1, 77, 5000000):
            end = ticks_add(start, step)
            equal(ticks_diff(end, start), own(end, start), (end, start))


def _message(*arguments, **keywords):
    schedule, _ = _schedule((PACK,))
    try:
        schedule.add(*arguments, **keywords)
    except ValueError as error:
        return error.args[0]
    raise AssertionError("nothing was raised")


def sources_that_cannot_be():
    equal(_message(PACK, 100), "type 0x23 has a source already")
    equal(_message(MSP, 100), "type 0x28 has no source")
    equal(_message(0, 100), "type 0x00 has no source")
    equal(_message(256, 100), "type 0x100 has no source")
    equal(_message(BARO, 0), "timeout_ms is 0, must be 1..268435456")
    equal(_message(BARO, -1), "timeout_ms is -1, must be 1..268435456")
    equal(_message(BARO, 268435457), "timeout_ms is 268435457, must be 1..268435456")
    equal(_message(BARO, 1, 0), "period_ms is 0, must be 1..268435456")
    equal(_message(BARO, 1, period_ms=1 << 29), "period_ms is 536870912, must be 1..268435456")
