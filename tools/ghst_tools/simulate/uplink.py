"""What the receiver sends, slot by slot: frames from sticks, or those of a recording."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from dataclasses import dataclass
from math import ceil

from ghst.protocol import RF_MODES, TYPE_12_BIT  # type: ignore[import-not-found]
from ghst_tools.control_frames import ROTATIONS, control_frame
from ghst_tools.replay import Plan
from ghst_tools.simulate.faults import Faults, Ramp
from ghst_tools.simulate.sticks import Sticks

HIGHEST_RATE_HZ = 500
"""A receiver sends a control frame at most every 2 ms (description: RC Data)."""

_LQ, _RSSI_DBM = Ramp(100, 100, 0.0), Ramp(-60, -60, 0.0)


@dataclass(frozen=True)
class Link:
    """What link data say."""

    rf_mode: int
    lq: Ramp = _LQ
    rssi_dbm: Ramp = _RSSI_DBM
    tx_power_dbm: int = 20
    telemetry_requested: bool = False

    @property
    def name(self) -> str:
        """The name of the RF mode."""
        return str(RF_MODES[self.rf_mode][0])

    @property
    def rate_hz(self) -> float:
        """Frames a second in this RF mode."""
        return float(RF_MODES[self.rf_mode][1])

    @property
    def downlink(self) -> bool:
        """Whether a flight controller may send telemetry."""
        return bool(RF_MODES[self.rf_mode][2]) or self.telemetry_requested


class Uplink(ABC):
    """Slots with their times from the first one on, and what is in each.

    `rate_hz`: how many slots there are in a second, in the mean. `extra`: frames that wait for a
    slot, in which they take the place of the control frame.
    """

    rate_hz: float

    def __init__(self, faults: Faults) -> None:
        self.faults = faults
        self.extra: deque[bytes] = deque()

    @property
    @abstractmethod
    def length_s(self) -> float | None:
        """How long all slots take; None: there is always another one."""

    @abstractmethod
    def due_s(self, index: int) -> float | None:
        """When slot `index` begins; None: there is none."""

    def octets(self, index: int, t_s: float) -> bytes:
        """What slot `index` holds at `t_s`; empty if nothing is sent."""
        frame = self.extra.popleft() if self.extra else self._frame(index, t_s)
        return self.faults.apply(index, t_s, frame)

    @abstractmethod
    def _frame(self, index: int, t_s: float) -> bytes: ...


class StickUplink(Uplink):
    """Control frames with the sticks, evenly spaced, for `duration_s` or as long as they last."""

    def __init__(
        self,
        sticks: Sticks,
        link: Link,
        faults: Faults,
        rate_hz: float | None = None,
        channels: int = 12,
        twelve_bit: bool = False,
        duration_s: float | None = None,
    ) -> None:
        super().__init__(faults)
        self.link = link
        self.rate_hz = rate_hz or link.rate_hz
        self._sticks = sticks
        self._kinds = [kind + twelve_bit * TYPE_12_BIT for kind in ROTATIONS[channels]]
        ends_s = [end_s for end_s in (sticks.end_s, duration_s) if end_s is not None]
        # A slot that would begin at the very end is none, also if rounding lets it begin before.
        self._slots = ceil(min(ends_s) * self.rate_hz - 1e-6) if ends_s else None

    @property
    def length_s(self) -> float | None:
        """As `Uplink.length_s`."""
        return None if self._slots is None else self._slots / self.rate_hz

    def due_s(self, index: int) -> float | None:
        """As `Uplink.due_s`."""
        return None if self._slots is not None and index >= self._slots else index / self.rate_hz

    def _frame(self, index: int, t_s: float) -> bytes:
        link = self.link
        return control_frame(
            self._kinds[index % len(self._kinds)],
            self._sticks.pulses(t_s),
            lq=link.lq.at(t_s),
            rssi_dbm=link.rssi_dbm.at(t_s),
            rf_mode=link.rf_mode,
            telemetry=link.telemetry_requested,
            tx_power_dbm=link.tx_power_dbm,
        )


class CaptureUplink(Uplink):
    """The frames of a recording, with their distances; `loop`: begins again behind the last."""

    def __init__(
        self, plan: Plan, faults: Faults, loop: bool = False, duration_s: float | None = None
    ) -> None:
        super().__init__(faults)
        self._plan = plan
        self._due_s = plan.due_s.tolist()
        self._loop = loop
        self._duration_s = duration_s
        self.rate_hz = len(plan.frames) / plan.duration_s

    @property
    def length_s(self) -> float | None:
        """As `Uplink.length_s`."""
        if self._loop:
            return self._duration_s
        return min(self._plan.duration_s, self._duration_s or self._plan.duration_s)

    def due_s(self, index: int) -> float | None:
        """As `Uplink.due_s`."""
        turn, at = divmod(index, len(self._due_s))
        if turn and not self._loop:
            return None
        due_s = float(turn * self._plan.duration_s + self._due_s[at])
        return None if self._duration_s is not None and due_s >= self._duration_s else due_s

    def _frame(self, index: int, t_s: float) -> bytes:
        return self._plan.frames[index % len(self._plan.frames)]
