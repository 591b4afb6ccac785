"""What a battery's voltage tells: plugged in, number of cells, low and critical."""

from firmware.sensors.cells import Cells

from behaviour.support import equal, sample

_STEP_MS = 50
_GOOD, _WARNING, _CRITICAL, _NOT_PRESENT, _STARTING = range(5)


def _run(cells, voltage_mv, milliseconds, step_ms=_STEP_MS):
    """Whether another battery was seen."""
    others = [cells.update(voltage_mv, step_ms) for _ in range(milliseconds // step_ms)]
    return any(others)


def _found(voltage_mv):
    cells = Cells()
    _run(cells, voltage_mv, 1100)
    return cells.count


def the_cell_count_is_the_voltage_by_4350_mv_rounded_up():
    for count in sample(range(1, 9), 3):
        equal(_found(count * 4200), count)
        equal(_found(count * 4350), count)
        equal(_found(count * 4350 + 1), count + 1)


def every_charge_state_of_up_to_four_cells_is_right():
    for count, lowest_mv in ((1, 3000), (2, 3270), (3, 3270), (4, 3270), (5, 3490), (6, 3630)):
        for cell_mv in sample(range(lowest_mv, 4351, 10), 2):
            equal(_found(count * cell_mv), count, f"{count} cells of {cell_mv} mV")


def a_cell_count_takes_a_second_of_steady_voltage():
    cells = Cells()
    equal((cells.count, cells.present, cells.state), (None, False, _NOT_PRESENT))
    for voltage_mv in (3000, 7000, 11000, 16000, 16500):
        _run(cells, voltage_mv, 500)
        equal((cells.count, cells.state), (None, _STARTING))
    # The last one has been there for 450 ms; it may wander by 0.1 V.
    _run(cells, 16400, 500)
    equal(cells.count, None)
    _run(cells, 16600, _STEP_MS)
    equal((cells.count, cells.state), (4, _GOOD))


def a_voltage_that_never_stands_still_is_counted_after_ten_seconds():
    cells = Cells()
    for _ in range(99):
        _run(cells, 15000, _STEP_MS)
        _run(cells, 15200, _STEP_MS)
    equal(cells.count, None)
    _run(cells, 15000, _STEP_MS)
    equal(cells.count, None)
    _run(cells, 15200, _STEP_MS)
    equal(cells.count, 4)


def a_given_cell_count_is_taken():
    cells = Cells(given=3)
    equal((cells.count, cells.found, cells.state), (3, 0, _NOT_PRESENT))
    _run(cells, 16800, _STEP_MS)
    equal((cells.count, cells.found, cells.state), (3, 0, _GOOD))


def the_cell_count_stays_while_the_battery_empties():
    cells = Cells()
    _run(cells, 16800, 1100)
    for voltage_mv in range(16800, 2500, -600):
        _run(cells, voltage_mv, 500)
        equal((cells.count, cells.found), (4, 4))


def a_battery_is_present_above_3_v_until_it_was_3_s_below_2_5_v():
    cells = Cells()
    _run(cells, 2999, 4000)
    equal(cells.present, False)
    _run(cells, 3000, _STEP_MS)
    equal(cells.present, True)
    _run(cells, 2500, 6000)
    equal(cells.present, True)
    _run(cells, 2499, 2950)
    equal(cells.present, True)
    _run(cells, 2499, _STEP_MS)
    equal((cells.present, cells.state), (False, _NOT_PRESENT))
    _run(cells, 2999, 4000)
    equal(cells.present, False)


def a_loose_contact_is_not_another_battery():
    cells = Cells()
    equal(_run(cells, 16000, 2000), False)
    for _ in range(3):
        equal(_run(cells, 0, 2900), False)
        equal(_run(cells, 16000, 100), False)
    equal((cells.present, cells.count), (True, 4))


def another_battery_is_seen_once_and_counted_anew():
    cells = Cells()
    equal(_run(cells, 16000, 2000), False)
    equal(_run(cells, 0, 5000), False)
    equal((cells.present, cells.count), (False, 4))
    equal(cells.update(12000, _STEP_MS), True)
    equal((cells.present, cells.count, cells.found), (True, None, 0))
    equal(_run(cells, 12000, 1100), False)
    equal(cells.count, 3)


def a_given_cell_count_holds_for_the_next_battery_as_well():
    cells = Cells(given=4)
    _run(cells, 16000, 1000)
    _run(cells, 0, 5000)
    equal(cells.update(12000, _STEP_MS), True)
    equal((cells.count, cells.state), (4, _GOOD))


def the_cell_count_of_before_a_reset_holds():
    for voltage_mv in (10000, 13000, 17400, 17800):
        cells = Cells(before=4)
        equal(cells.update(voltage_mv, _STEP_MS), False)
        equal((cells.count, cells.found, cells.present), (4, 4, True))


def the_cell_count_of_before_a_reset_must_be_possible():
    for voltage_mv, count in ((9999, 3), (17801, 5)):
        cells = Cells(before=4)
        equal(cells.update(voltage_mv, _STEP_MS), True)
        equal(cells.count, None)
        equal(_run(cells, voltage_mv, 1100), False)
        equal(cells.count, count)
    # Under load later on, anything may come.
    cells = Cells(before=4)
    cells.update(12000, _STEP_MS)
    equal(_run(cells, 8000, 5000), False)
    equal(cells.count, 4)


def no_battery_after_a_reset_makes_the_next_one_another_one():
    cells = Cells(before=4)
    _run(cells, 0, 2950)
    equal(_run(cells, 16000, _STEP_MS), False)
    cells = Cells(before=4)
    _run(cells, 0, 3000)
    equal(cells.update(16000, _STEP_MS), True)
    equal(cells.count, None)


def low_takes_two_seconds():
    cells = Cells(given=4)
    _run(cells, 14000, 4000)
    equal((cells.low, cells.state), (False, _GOOD))
    _run(cells, 13999, 1950)
    equal((cells.low, cells.state), (False, _GOOD))
    _run(cells, 13999, _STEP_MS)
    equal((cells.low, cells.critical, cells.state), (True, False, _WARNING))


def a_sag_of_less_than_two_seconds_is_not_low():
    cells = Cells(given=4)
    for _ in range(3):
        _run(cells, 12000, 1950)
        _run(cells, 14000, _STEP_MS)
        equal(cells.state, _GOOD)


def low_ends_two_seconds_after_0_1_v_a_cell_more():
    cells = Cells(given=4)
    _run(cells, 13999, 2000)
    _run(cells, 14399, 5000)
    equal(cells.low, True)
    _run(cells, 14400, 1950)
    equal(cells.low, True)
    _run(cells, 14399, _STEP_MS)
    _run(cells, 14400, 1950)
    equal(cells.low, True)
    _run(cells, 14400, _STEP_MS)
    equal((cells.low, cells.state), (False, _GOOD))


def critical_has_its_own_limit():
    cells = Cells(given=2, low_mv=3600, critical_mv=3200)
    _run(cells, 6399, 2000)
    equal((cells.low, cells.critical, cells.state), (True, True, _CRITICAL))
    _run(cells, 6599, 5000)
    equal(cells.state, _CRITICAL)
    _run(cells, 6600, 2000)
    equal((cells.low, cells.critical, cells.state), (True, False, _WARNING))
    _run(cells, 7400, 2000)
    equal(cells.state, _GOOD)


def unplugging_ends_the_alarms():
    cells = Cells(given=4)
    _run(cells, 12000, 3000)
    equal(cells.state, _CRITICAL)
    _run(cells, 0, 3000)
    equal((cells.low, cells.critical, cells.state), (False, False, _NOT_PRESENT))
    _run(cells, 16000, _STEP_MS)
    equal(cells.state, _GOOD)


class _Model:
    """Alarms by the letter: looks back over all that was measured."""

    def __init__(self, limit_mv):
        self.limit_mv = limit_mv
        self.on = False
        self.since_change = []

    def update(self, cell_mv, step_ms):
        self.since_change.append((cell_mv, step_ms))
        against_ms = 0
        for then_mv, then_ms in reversed(self.since_change):
            if then_mv < self.limit_mv + 100 if self.on else then_mv >= self.limit_mv:
                break
            against_ms += then_ms
        if against_ms >= 2000:
            self.on = not self.on
            self.since_change = []


def alarms_agree_with_a_model_on_any_voltage():
    seen = set()
    for start in sample(range(40), 1):
        cells = Cells(given=1, low_mv=3500, critical_mv=3300)
        low, critical = _Model(3500), _Model(3300)
        random = start + 1
        centre_mv = 3500
        for _ in range(160):
            random = random * 16807 % 65537
            if random % 16 == 0:
                centre_mv = 3100 + random % 600
            cell_mv = centre_mv + random % 151 - 75
            step_ms = 40 + random % 61
            cells.update(cell_mv, step_ms)
            low.update(cell_mv, step_ms)
            critical.update(cell_mv, step_ms)
            equal((cells.low, cells.critical), (low.on or critical.on, critical.on))
            seen.add(cells.state)
    equal(seen, {_GOOD, _WARNING, _CRITICAL})
