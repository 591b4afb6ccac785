"""A battery takes no memory once it was made."""

import micropython
from firmware.sensors.battery import Battery
from firmware.sensors.cells import CRITICAL, Cells

from behaviour.support import equal
from behaviour.telemetry_memory import _expect_no_heap

# A first value, twice in a row, across the wrap, and a pause of days.
_NOW_MS = (1 << 30) - 50, (1 << 30) - 49, 0, 1 << 28


class _Adc:
    def __init__(self, code):
        self.code = code

    @micropython.native
    def read_u16(self):
        return self.code


class _Store:
    def __init__(self, number):
        self.number = number

    def load(self):
        return self.number

    def save(self, number):
        self.number = number


def _calls(battery):
    def update(now_ms):
        return lambda: battery.update(now_ms)

    return [update(now_ms) for now_ms in _NOW_MS]


def measuring_anything():
    for voltage, current, options in (
        # The largest numbers that there are.
        (65535, 65535, {"divider_permille": 151515, "current_mv_per_a": 6.6}),
        (65534, 0, {"current_offset_mv": 3300, "store": _Store((1 << 20) - 1 | 16 << 20)}),
        (1, 30000, {"cells": 4, "cell_low_mv": 4350, "store": _Store(None)}),
    ):
        _expect_no_heap(_calls(Battery(_Adc(voltage), _Adc(current), **options)))


def measuring_with_one_input():
    _expect_no_heap(_calls(Battery(_Adc(29000))))
    _expect_no_heap(_calls(Battery(None, _Adc(29000), store=_Store(0))))


def plugging_batteries_in_and_out():
    cells = Cells(before=4)

    def seconds(voltage_mv, count):
        # Native for its locals, which would be on the heap.
        @micropython.native
        def call():
            for _ in range(10 * count):
                cells.update(voltage_mv, 100)

        return call

    _expect_no_heap(
        [seconds(*what) for what in ((16000, 1), (0, 4), (12000, 2), (10000, 3), (9000, 3))]
    )
    equal((cells.present, cells.count, cells.state), (True, 3, CRITICAL))
