"""Battery voltage, current and charge: exact values, turns, pauses, faults, what is stored."""

try:
    import micropython
except ImportError:
    from ghst._host import micropython

from firmware.sensors.battery import Battery

from behaviour.support import equal, sample

_WRAP = 1 << 30
_START = _WRAP - 500  # the clock wraps half a second later
_TOP = 65535
_MAH = 3_600_000  # mA ms


class _Adc:
    """An input that returns the same 32 codes over and over."""

    def __init__(self, code=0):
        self.samples = 0
        self.set(code)

    def set(self, code):
        """`code`: one for all, a sequence of 32, or None: reading fails from now on."""
        self.codes = (code,) * 32 if isinstance(code, int) else code

    @micropython.native
    def read_u16(self):
        codes = self.codes
        if codes is None:
            raise OSError(5)
        samples = self.samples
        self.samples = samples + 1
        return codes[samples & 31]


class _Store:
    def __init__(self, number=None):
        self.number = number
        self.saved = []

    def load(self):
        return self.number

    def save(self, number):
        self.number = number
        self.saved.append(number)


class _Clock:
    """Calls `update` of a battery at regular times."""

    def __init__(self, battery, step_ms=20, now_ms=_START):
        self.battery = battery
        self.step_ms = step_ms
        self.now_ms = now_ms % _WRAP
        self.true = []

    def run(self, calls):
        for _ in range(calls):
            self.true.append(self.battery.update(self.now_ms))
            self.now_ms = (self.now_ms + self.step_ms) % _WRAP
        return self.true[-1]


def _round_half_up(numerator, denominator):
    return (2 * numerator + denominator) // (2 * denominator)


def _code_of(current_ma, full_ma=82500, zero_ma=0):
    """Codes whose mean reads as exactly `current_ma`, with 40 mV/A."""
    total = _round_half_up((current_ma + zero_ma) << 21, full_ma)
    code, more = total >> 5, total & 31
    return (code + 1,) * more + (code,) * (32 - more)


def the_voltage_is_exact_over_the_whole_range():
    # 500 V of full scale is the most that 31 bits can compute.
    for divider, full_mv in ((1000, 3300), (11000, 36300), (151515, 499999)):
        for code in sample(range(0, _TOP + 1, 1285), 2):
            adc = _Adc(code)
            battery = Battery(adc, divider_permille=divider)
            equal(battery.voltage_mv, None)
            assert battery.update(5)
            equal(battery.voltage_mv, _round_half_up(code * full_mv, 65536), f"code {code}")
            equal(adc.samples, 32)


def the_voltage_is_the_mean_of_32_samples():
    # 12-bit codes as the RP2040 gives them, with noise of some steps around a slope.
    for start in sample(range(0, 4000, 97), 3):
        codes = [start + 7 * at * at % 23 for at in range(32)]
        codes = [code << 4 | code >> 8 for code in codes]
        battery = Battery(_Adc(codes))
        assert battery.update(0)
        equal(battery.voltage_mv, _round_half_up(sum(codes) * 36300, 32 * 65536))


def the_current_has_slope_and_offset():
    # 100 mV/A around 1650 mV; 12.5 mV/A from 330 mV; 6.6 mV/A, the flattest that is possible.
    for slope, offset, full_ma in ((100, 1650, 33000), (12.5, 330, 264000), (6.6, 0, 500000)):
        zero_ma = round(offset * 1000 / slope)
        # From 100 mV on: with an offset, what is below is a broken wire.
        for code in sample(range(2000, _TOP, 997), 3):
            battery = Battery(None, _Adc(code), current_mv_per_a=slope, current_offset_mv=offset)
            equal(battery.current_ma, None)
            assert battery.update(0)
            equal(battery.current_ma, _round_half_up(code * full_ma, 65536) - zero_ma)
            equal(battery.voltage_mv, None)
            equal(battery.present, None)
            equal(battery.state, 3)


def values_are_smoothed_and_settle_exactly():
    adc = _Adc(20000)
    battery = Battery(adc)
    clock = _Clock(battery)
    clock.run(1)
    equal(battery.voltage_mv, 11078)
    smoothed_4 = 4 * 11078
    for code, target in ((30000, 16617), (3, 2)):
        adc.set(code)
        for _ in range(40):
            clock.run(1)
            smoothed_4 += target - smoothed_4 // 4
            equal(battery.voltage_mv, smoothed_4 // 4)
        equal(battery.voltage_mv, target)


def a_negative_current_is_smoothed_the_same_way():
    adc = _Adc(32768)
    battery = Battery(None, adc, current_mv_per_a=100, current_offset_mv=1650)
    clock = _Clock(battery)
    clock.run(1)
    equal(battery.current_ma, 0)
    adc.set(30000)
    last_ma = 0
    for _ in range(40):
        clock.run(1)
        assert -1394 <= battery.current_ma <= last_ma
        last_ma = battery.current_ma
    equal(battery.current_ma, -1394)


def the_inputs_take_turns():
    for step_ms, due_every in ((1, 10), (7, 2), (9, 2), (10, 1), (20, 1), (300, 1)):
        voltage, current = _Adc(9), _Adc(9)
        clock = _Clock(Battery(voltage, current), step_ms)
        clock.run(1 + 4 * due_every)
        equal(clock.true, ([True] + [False] * (due_every - 1)) * 4 + [True])
        equal((voltage.samples, current.samples), (3 * 32, 2 * 32))


def an_input_alone_is_read_at_the_same_rate():
    for inputs in ((_Adc(9), None), (None, _Adc(9))):
        clock = _Clock(Battery(*inputs), 5)
        clock.run(9)
        equal(clock.true, [True, False, False, False] * 2 + [True])


def a_clock_that_goes_back_stops_nothing():
    battery = Battery(_Adc(), _Adc(_code_of(50000)))
    for now_ms in (5000, 5010, 1000, 1010):
        assert battery.update(now_ms), now_ms
    equal(battery.consumed_mah, 0)


def charge_is_the_integral_of_the_current():
    for current_ma, step_ms, calls in sample(
        [(3600, 20, 3000), (82000, 10, 2000), (999, 37, 2000), (1, 1000, 4000)], 2
    ):
        if len(sample(range(9), 2)) == 2:
            calls = 30
            step_ms *= 40
        battery = Battery(None, _Adc(_code_of(current_ma)))
        clock = _Clock(battery, step_ms)
        for call in range(calls):
            clock.run(1)
            if clock.true[-1]:
                equal(battery.consumed_mah, current_ma * call * step_ms // _MAH)


def charge_counts_each_measurement_for_the_time_before_it():
    adc = _Adc()
    battery = Battery(None, adc)
    now_ms = _START
    charge = 0
    for at, pause_ms in enumerate((20, 21, 5000, 59999, 333, 20, 12345, 40, 1999, 2000, 2001)):
        current_ma = 7919 * (at + 1) % 80000
        adc.set(_code_of(current_ma))
        if at:
            charge += current_ma * pause_ms
            now_ms = (now_ms + pause_ms) % _WRAP
        assert battery.update(now_ms)
        equal(battery.consumed_mah, charge // _MAH)


def a_pause_counts_for_a_minute_at_most():
    battery = Battery(None, _Adc(_code_of(60000)))
    battery.update(1000)
    battery.update(1000 + 3600 * 1000)
    equal(battery.consumed_mah, 1000)
    battery.update((1000 + 3600 * 1000 + 60001) % _WRAP)
    equal(battery.consumed_mah, 2000)


def charging_counts_backwards_but_not_below_zero():
    zero_ma = 41250  # 1650 mV with 40 mV/A
    adc = _Adc(_code_of(36000, zero_ma=zero_ma))
    battery = Battery(None, adc, current_offset_mv=1650)
    clock = _Clock(battery, 1000)
    clock.run(11)
    equal(battery.consumed_mah, 100)
    adc.set(_code_of(-18000, zero_ma=zero_ma))
    clock.run(10)
    equal(battery.consumed_mah, 50)
    clock.run(11)
    equal(battery.consumed_mah, 0)
    # Not one mAh is owed.
    adc.set(_code_of(3600, zero_ma=zero_ma))
    clock.run(1)
    equal(battery.consumed_mah, 1)


def charge_stops_at_what_can_be_stored():
    battery = Battery(None, _Adc(_code_of(60000)), store=_Store((1 << 20) - 1 - 1500))
    clock = _Clock(battery, 60000)
    for mah in (1047075, 1048075, 1048575, 1048575):
        clock.run(1)
        equal(battery.consumed_mah, mah)


def a_failed_read_is_counted_and_the_gap_is_filled():
    voltage, current = _Adc(20000), _Adc(_code_of(36000))
    battery = Battery(voltage, current)
    clock = _Clock(battery, 10)
    clock.run(20)
    mah = battery.consumed_mah
    equal(mah, 36000 * 180 // _MAH)
    voltage.set(None)
    current.set(None)
    clock.run(30)
    equal(clock.true[20:], [False] * 30)
    equal((battery.faults, battery.voltage_mv, battery.consumed_mah), (30, 11078, mah))
    voltage.set(20000)
    current.set(_code_of(36000))
    clock.run(2)
    equal(clock.true[-2:], [True, True])
    equal((battery.faults, battery.consumed_mah), (30, 36000 * 500 // _MAH))


def the_top_of_the_range_is_a_fault():
    voltage, current = _Adc(_TOP), _Adc(_TOP)
    battery = Battery(voltage, current)
    clock = _Clock(battery, 10)
    clock.run(4)
    equal((battery.voltage_mv, battery.current_ma, battery.faults), (36299, 82499, 4))
    # Eight steps of 12 bits: it is never read exactly.
    for adc in (voltage, current):
        adc.set((_TOP, _TOP - 256) * 16)
    clock.run(4)
    equal(battery.faults, 8)
    for adc in (voltage, current):
        adc.set((_TOP, _TOP - 256) * 15 + (_TOP, _TOP - 257))
    clock.run(4)
    equal(battery.faults, 8)


def the_bottom_is_none_without_an_offset():
    battery = Battery(_Adc(0), _Adc(0), current_offset_mv=249)
    _Clock(battery, 10).run(4)
    equal((battery.voltage_mv, battery.current_ma, battery.faults), (0, -6225, 0))


def a_broken_wire_of_a_sensor_with_an_offset_is_a_fault():
    for offset_mv in (250, 1650):
        zero_ma = offset_mv * 25
        adc = _Adc(_code_of(36000, zero_ma=zero_ma))
        battery = Battery(None, adc, current_offset_mv=offset_mv)
        clock = _Clock(battery, 100)
        clock.run(31)
        equal((battery.current_ma, battery.consumed_mah), (36000, 30))
        faults = 0
        # Nothing at all, what an RP2040 reads of 0 V, and just not 100 mV.
        for codes in (0, (176, 470) * 16, _code_of(2500)):
            adc.set(codes)
            clock.run(10)
            faults += 10
            equal((battery.current_ma, battery.consumed_mah, battery.faults), (None, 30, faults))
        adc.set(_code_of(18000, zero_ma=zero_ma))
        clock.run(1)
        # Not smoothed with what was before, and the time without a wire counts for nothing.
        equal((battery.current_ma, battery.faults), (18000, 30))
        clock.run(19)
        equal(battery.consumed_mah, 40)
        adc.set(_code_of(2501))
        clock.run(60)
        equal((battery.current_ma, battery.faults), (2501 - zero_ma, 30))


def charge_goes_on_where_the_store_has_it():
    store = _Store(1234)
    battery = Battery(None, _Adc(_code_of(36000)), store=store)
    equal(battery.consumed_mah, 1234)
    _Clock(battery, 100).run(4)
    equal(battery.consumed_mah, 1237)
    # Only what has changed is saved.
    equal(store.saved, [1235, 1236, 1237])


def an_empty_store_begins_at_zero():
    battery = Battery(None, _Adc(), store=_Store())
    equal(battery.consumed_mah, 0)
    _Clock(battery).run(3)
    equal(battery.consumed_mah, 0)


def the_cell_count_is_stored_as_well():
    store = _Store()
    voltage = _Adc(29000)  # 16.06 V: 4 cells
    battery = Battery(voltage, _Adc(_code_of(36000)), store=store)
    clock = _Clock(battery, 50)
    clock.run(24)
    equal((battery.cell_count, battery.consumed_mah), (4, 11))
    equal(store.number, 4 << 20 | 11)
    # After a reset under load: 13.0 V would be 3 cells.
    again = Battery(_Adc(23500), _Adc(_code_of(36000)), store=store)
    equal((again.cell_count, again.consumed_mah), (4, 11))
    clock = _Clock(again, 50)
    clock.run(42)
    equal((again.cell_count, again.consumed_mah, again.state), (4, 31, 2))


def a_given_cell_count_is_not_stored():
    store = _Store()
    battery = Battery(_Adc(29000), cells=5, store=store)
    _Clock(battery, 100).run(25)
    equal((battery.cell_count, store.saved), (5, []))


def the_next_battery_begins_at_zero():
    store = _Store()
    voltage, current = _Adc(29000), _Adc(_code_of(36000))
    battery = Battery(voltage, current, store=store)
    clock = _Clock(battery, 50)
    clock.run(25)
    equal((battery.cell_count, battery.state, battery.consumed_mah), (4, 0, 11))
    voltage.set(0)
    current.set(0)
    clock.run(80)
    # Unplugged: what it has given can still be read.
    equal((battery.present, battery.state, battery.consumed_mah), (False, 3, 11))
    # After a reset, the next one begins anew.
    equal(store.number, 0)
    voltage.set(38000)
    clock.run(8)
    equal((battery.present, battery.state, battery.consumed_mah), (True, 4, 0))
    equal(store.number, 0)
    clock.run(50)
    equal((battery.cell_count, battery.state, store.number), (5, 0, 5 << 20))


def the_one_line():
    battery = Battery(_Adc(29000), _Adc(_code_of(12340)), store=_Store(4 << 20 | 431))
    equal(battery.describe(), "431 mAh, not plugged in")
    _Clock(battery).run(2)
    equal(battery.describe(), "16.06 V, 12.3 A, 431 mAh, 4S")
    battery = Battery(None, _Adc(_code_of(500)))
    battery.update(0)
    equal(battery.describe(), "0.5 A, 0 mAh")
    for volts, word in ((13.8, "low"), (13.0, "critical")):
        battery = Battery(_Adc(int(volts / 36.3 * 65536)), cells=4)
        _Clock(battery, 100).run(21)
        equal(battery.describe(), f"{volts:.2f} V, 4S, {word}")


def options_that_cannot_be():
    adc = _Adc()
    for name, value in (
        ("reference_mv", 0),
        ("reference_mv", 3300.0),
        ("divider_permille", 999),
        ("divider_permille", 152000),
        ("divider_permille", "11"),
        ("current_mv_per_a", 0),
        ("current_mv_per_a", -40),
        ("current_mv_per_a", 6.5),
        ("current_mv_per_a", None),
        ("current_offset_mv", -1),
        ("current_offset_mv", 3301),
        ("cells", -1),
        ("cells", 17),
        ("cells", 4.0),
        ("cell_low_mv", 2400),
        ("cell_low_mv", 4400),
        ("cell_critical_mv", 3501),
        ("capacity_mah", -1),
        ("capacity_mah", True),
    ):
        try:
            Battery(adc, adc, **{name: value})
        except ValueError as error:
            assert name in str(error) and "\n" not in str(error), error
        else:
            raise AssertionError(f"{name}={value!r} was taken")
    try:
        Battery()
    except ValueError as error:
        assert "voltage_adc" in str(error)
    else:
        raise AssertionError("a battery without inputs")
