"""That outputs which should move do: a pulse on each servo pin in each period."""

from __future__ import annotations

from typing import Any

from ghst_tools.campaign.pico import PERIOD_NS, SERVOS, Pico
from ghst_tools.campaign.picos import HIGHEST_NS
from ghst_tools.campaign.verdict import equal, expect

_ROUNDING_NS = 1e3


class Periods:
    """Pulses from `begin_ns` on, when the first frame came: none is missing, late or early.

    `check` looks at those that have come since it was called last; what it has seen may be
    forgotten by the meter.
    """

    def __init__(self, pico: Pico, begin_ns: float) -> None:
        self._pico = pico
        self._begin_ns = begin_ns
        self._last_ns: dict[int, float] = {}

    def check(self, case: dict[str, Any] | None = None) -> int:
        """Raise Wrong unless no pulse is missing; how many there were since the last call."""
        count = 0
        for pin in SERVOS:
            last_ns = self._last_ns.get(pin, self._begin_ns)
            for pulse in self._pico.meter.pulses[pin]:
                if pulse.rise_ns <= last_ns:
                    continue
                us = round((pulse.rise_ns - last_ns) / 1e3)
                if pin in self._last_ns:
                    equal(us, round(PERIOD_NS / 1e3), f"us between pulses on GP{pin}", case)
                else:
                    expect(us <= PERIOD_NS / 1e3, f"first pulse on GP{pin} after {us} us", case)
                self._last_ns[pin] = last_ns = pulse.rise_ns
                count += 1
            # The pulse under way is not on record yet.
            silent_ns = self._pico.board.now_ns - last_ns
            limit_ns = PERIOD_NS + HIGHEST_NS + _ROUNDING_NS
            expect(silent_ns < limit_ns, f"no pulse on GP{pin} for {silent_ns / 1e6} ms", case)
        return count
