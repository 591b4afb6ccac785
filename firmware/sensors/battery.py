"""Battery voltage and current from two ADC inputs, and the charge used."""

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython

from firmware.sensors.analog import HIGHEST_FULL_SCALE, AnalogInput
from firmware.sensors.cells import Cells

_PERIOD_MS = 20
_LONGEST_STEP_MS = const(100)
_CHUNK_MS = const(2000)  # 500 A times this, in mA ms, is still a small integer of 31 bits
_MA_MS_PER_MAH = const(3_600_000)
# A sensor that is at so much without a current does not go down to the rail with any: one for both
# directions has its zero near half the supply. A pin without a wire or a sensor without supply is
# at 0 V, as far as the ADC can tell: its own error is 10 mV and more.
_WITH_ZERO_MV = 250
_BROKEN_MV = 100

_CELLS_SHIFT = const(20)  # of what is stored: cell count above mAh
_MOST_MAH = const((1 << 20) - 1)
_COUNT_MASK = const(0x3FFFFFFF)
_TIME_MASK = const(0x3FFFFFFF)
_TIME_SIGN = const(0x20000000)


def _check(name, value, low, high, kinds=(int,)):
    if type(value) not in kinds or not low <= value <= high:
        raise ValueError(f"{name} is {value!r}, must be {low}..{high}")
    return value


def _full_scale(name, value):
    if value > HIGHEST_FULL_SCALE:
        raise ValueError(f"{name} makes the ADC's range 0..{value // 1000} V or A, 500 at most")
    return value


class Battery:
    """A flight battery.

    `voltage_mv`, `current_ma` (negative while charging): means of 32 samples, a new one every
    20 ms or in every second round of the main loop, smoothed over four; None without sensor.

    `consumed_mah`: the integral of the current before smoothing, never below 0; None without a
    current sensor. It begins at 0 with each battery that is plugged in. With a `store` it goes on
    after a reset, unless the battery was unplugged before.

    `present`, `cell_count`, `low`, `critical`, `state`: see `firmware.sensors.cells.Cells`.

    `faults`: failed reads, broken wires, and means at the top of the range, where truth is more.
    """

    def __init__(
        self,
        voltage_adc=None,
        current_adc=None,
        *,
        divider_permille=11000,
        current_mv_per_a=40,
        current_offset_mv=0,
        reference_mv=3300,
        cells=0,
        cell_low_mv=3500,
        cell_critical_mv=3300,
        capacity_mah=0,
        store=None,
    ):
        """`voltage_adc`, `current_adc`: `machine.ADC` or None, one of them at least.

        `divider_permille`: battery voltage divided by that at the pin, in thousandths.
        `current_mv_per_a`, `current_offset_mv`: the current sensor's slope, and its output at 0 A;
        with an offset of 250 mV or more, less than 100 mV is a broken wire.
        `reference_mv`: the ADC's full scale. `cells`: 1..16, 0 = find out. `cell_low_mv`,
        `cell_critical_mv`: limits for one cell. `capacity_mah`: kept for display, 0 = not known.

        `store`: where charge and cell count survive a reset: an object with `load()`, which
        returns the number that was saved last or None, and `save(number)`, 0..2^30 - 1.

        Raises `ValueError` for values that cannot be.
        """
        if voltage_adc is None and current_adc is None:
            raise ValueError("a battery needs voltage_adc or current_adc")
        _check("reference_mv", reference_mv, 500, 6000)
        _check("divider_permille", divider_permille, 1000, 1_000_000)
        _check("current_mv_per_a", current_mv_per_a, 1, 5000, (int, float))
        _check("current_offset_mv", current_offset_mv, 0, reference_mv, (int, float))
        _check("cells", cells, 0, 16)
        _check("cell_low_mv", cell_low_mv, 2500, 4350)
        _check("cell_critical_mv", cell_critical_mv, 2500, cell_low_mv)
        self.capacity_mah = _check("capacity_mah", capacity_mah, 0, _MOST_MAH)
        full_mv = _full_scale("divider_permille", reference_mv * divider_permille // 1000)
        full_ma = _full_scale("current_mv_per_a", round(reference_mv * 1000 / current_mv_per_a))
        zero_ma = round(current_offset_mv * 1000 / current_mv_per_a)
        self._voltage = None if voltage_adc is None else AnalogInput(voltage_adc, full_mv)
        lowest_ma = -1
        if current_offset_mv >= _WITH_ZERO_MV:
            lowest_ma = round(_BROKEN_MV * 1000 / current_mv_per_a)
        self._current = None
        if current_adc is not None:
            self._current = AnalogInput(current_adc, full_ma, zero_ma, lowest_ma)
        # The inputs take turns.
        self._current_next = voltage_adc is None
        self._spacing_ms = _PERIOD_MS if None in (voltage_adc, current_adc) else _PERIOD_MS // 2
        self._time_ms = None
        self._store = store
        saved = (store.load() if store else None) or 0
        self._saved_mah = saved & _MOST_MAH
        self._saved_cells = min(saved >> _CELLS_SHIFT, 16)
        self._cells = Cells(
            given=cells,
            before=self._saved_cells,
            low_mv=cell_low_mv,
            critical_mv=cell_critical_mv,
        )
        self.voltage_mv = None
        self.current_ma = None
        self.consumed_mah = None if current_adc is None else self._saved_mah
        self._charge_ma_ms = 0  # what is not a whole mAh yet
        self.faults = 0

    @property
    def present(self):
        """Whether a battery is plugged in; None without a voltage sensor."""
        return None if self._voltage is None else self._cells.present

    @property
    def cell_count(self):
        """The number of cells; None while not known."""
        return self._cells.count

    @property
    def low(self):
        """Whether the voltage was below `cell_low_mv` for long enough."""
        return self._cells.low

    @property
    def critical(self):
        """Whether the voltage was below `cell_critical_mv` for long enough."""
        return self._cells.critical

    @property
    def state(self):
        """The battery as MSP has it: 0 good, 1 warning, 2 critical, 3 not present, 4 starting."""
        return self._cells.state

    @micropython.native
    def update(self, now_ms):
        """Measures voltage or current, in 0.5 ms; returns True when there is a new value."""
        if self._time_ms is not None:
            # `ghst.schedule.ticks_diff`, without the call.
            elapsed_ms = (((now_ms - self._time_ms) & _TIME_MASK) ^ _TIME_SIGN) - _TIME_SIGN
            if 0 <= elapsed_ms < self._spacing_ms:
                return False
        self._time_ms = now_ms
        if self._current_next:
            self._current_next = self._voltage is None
            new = self._take_current(now_ms)
        else:
            self._current_next = self._current is not None
            new = self._take_voltage(now_ms)
        if self._store is not None:
            self._save()
        return new

    def describe(self):
        """Returns the values in one line."""
        parts = []
        if self.voltage_mv is not None:
            parts.append(f"{self.voltage_mv / 1000:.2f} V")
        if self.current_ma is not None:
            parts.append(f"{self.current_ma / 1000:.1f} A")
        if self.consumed_mah is not None:
            parts.append(f"{self.consumed_mah} mAh")
        if self.present is False:
            parts.append("not plugged in")
        elif self.present and self.cell_count is not None:
            parts.append(f"{self.cell_count}S")
            if self.low:
                parts.append("critical" if self.critical else "low")
        return ", ".join(parts)

    @micropython.native
    def _take_voltage(self, now_ms):
        voltage = self._voltage
        elapsed_ms = voltage.update(now_ms)
        if voltage.at_top or elapsed_ms < 0:
            self._fault()
        if elapsed_ms < 0:
            return False
        self.voltage_mv = voltage.smoothed
        # After a pause it is not known what was in between.
        step_ms = elapsed_ms if elapsed_ms < _LONGEST_STEP_MS else _LONGEST_STEP_MS
        if self._cells.update(voltage.smoothed, step_ms) and self._current is not None:
            self.consumed_mah = self._charge_ma_ms = 0
        return True

    @micropython.native
    def _take_current(self, now_ms):
        current = self._current
        elapsed_ms = current.update(now_ms)
        broken = current.at_bottom
        if broken or current.at_top or elapsed_ms < 0:
            self._fault()
        if broken:
            current.forget()
        if elapsed_ms < 0:
            return False
        self.current_ma = current.smoothed
        if not broken:
            self._integrate(current.value, elapsed_ms)
        return True

    @micropython.native
    def _integrate(self, current_ma, elapsed_ms):
        charge_ma_ms = self._charge_ma_ms
        while elapsed_ms > 0:
            charge_ma_ms += current_ma * (elapsed_ms if elapsed_ms < _CHUNK_MS else _CHUNK_MS)
            elapsed_ms -= _CHUNK_MS
            if not 0 <= charge_ma_ms < _MA_MS_PER_MAH:
                mah = self.consumed_mah + charge_ma_ms // _MA_MS_PER_MAH
                charge_ma_ms %= _MA_MS_PER_MAH
                if mah < 0:
                    mah = charge_ma_ms = 0
                self.consumed_mah = mah if mah < _MOST_MAH else _MOST_MAH
        self._charge_ma_ms = charge_ma_ms

    @micropython.native
    def _save(self):
        cells = self._cells.found
        mah = self.consumed_mah or 0
        if self._cells.unplugged:
            # Whatever comes next, before a reset or after it, is another battery.
            cells = mah = 0
        if mah != self._saved_mah or cells != self._saved_cells:
            self._saved_mah = mah
            self._saved_cells = cells
            self._store.save(cells << _CELLS_SHIFT | mah)

    def _fault(self):
        self.faults = (self.faults + 1) & _COUNT_MASK
