"""Judges the telemetry of a flight: when it was on the wire, and whether its values were true."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ghst_tools.demo.aircraft import Aircraft, Devices, home_from
from ghst_tools.demo.radio import MAG_BARO, MOTION, PACK, POSITION, Radio
from ghst_tools.demo.report import Report
from ghst_tools.emulator import GhostReceiver
from ghst_tools.emulator.gps_messages import Place

SLOT_US = (990.0, 1010.0)

_KINDS = {
    "battery": (PACK,),
    "gps": (POSITION, MOTION),
    "barometer": (MAG_BARO,),
    "magnetometer": (MAG_BARO,),
}
_STEP_NS = 5e6
_NEAR_HOME_M = 20.0  # nearer than this its direction says little


class Quantity(NamedTuple):
    """A value that the radio shows.

    `shown` takes the values of a frame (None: not valid), `really` the time in ns. What is shown
    may be as old as `age_ms`, and `tolerance` off what the device had at any time since then.
    """

    sensor: str
    label: str
    unit: str
    digits: int
    kind: str
    shown: Callable[[Any], float | None]
    really: Callable[[float], float | None]
    age_ms: float
    tolerance: float
    turns: bool = False
    """Degrees of a circle."""
    lag_ms: float = 0.0
    """Typical age: the device's value of that time stands beside the one shown last."""


class _Solutions:
    """What the GPS receiver has measured: the radio cannot show a newer place."""

    def __init__(self, devices: Devices) -> None:
        self._sent = devices.gps.sent if devices.gps else []

    def recent(self, t_ns: float) -> list[float]:
        """Times of the last two solutions: the last one may be on its way."""
        return [sent_ns for sent_ns, _ in self._sent if sent_ns <= t_ns][-2:]


def judge(
    result: Report,
    values: Mapping[str, Any],
    receiver: GhostReceiver,
    radio: Radio,
    aircraft: Aircraft,
    devices: Devices,
) -> None:
    """Add lines and failures to `result`; `values` is the board's description."""
    sensors = [sensor for sensor in _KINDS if sensor in values["defaults"]]
    if not sensors:
        result.lines.append(("telemetry", "none: the board's description names no sensors"))
        return
    result.failures += radio.broken
    counts = radio.counts
    result.lines.append(
        ("telemetry frames", ", ".join(f"{kind} {counts[kind]}" for kind in sorted(counts)))
    )
    _slots(result, receiver)
    kinds = dict.fromkeys(kind for sensor in sensors for kind in _KINDS[sensor])
    result.failures += [f"no {kind} frame came" for kind in kinds if not counts[kind]]
    solutions = _Solutions(devices)
    if gps := devices.gps:
        result.lines.append(
            (
                "receiver of the GPS",
                f"{len(gps.sent)} solutions, set up for {gps.baud} baud and "
                f"{1000 / gps.period_ms:.0f} solutions a second",
            )
        )
    for quantity in quantities(aircraft):
        if quantity.sensor in sensors:
            _quantity(result, quantity, radio, solutions)


def quantities(aircraft: Aircraft) -> list[Quantity]:
    """All that the radio shows."""

    def place(read: Callable[[Place], float]) -> Callable[[float], float]:
        return lambda t_ns: read(aircraft.place(t_ns))

    def homeward(t_ns: float) -> float | None:
        distance, direction = home_from(aircraft.place(t_ns))
        return direction if distance >= _NEAR_HOME_M else None

    def tenth(value: int | None) -> float | None:
        return None if value is None else value / 10

    return [
        # The board smooths over four values, one every 20 ms; half a step of the frame is in the
        # tolerance.
        Quantity("battery", "voltage", "V", 2, PACK,
                 lambda v: v.voltage_mv / 1000, aircraft.volts, 400, 0.03, lag_ms=80),
        Quantity("battery", "current", "A", 2, PACK,
                 lambda v: v.current_ma / 1000, aircraft.amps, 400, 0.3, lag_ms=80),
        Quantity("battery", "charge", "mAh", 1, PACK,
                 lambda v: v.consumed_mah, aircraft.consumed_mah, 400, 6.0),
        Quantity("gps", "latitude", "deg", 6, POSITION,
                 lambda v: v.lat_e7 / 1e7, place(lambda p: p.lat_deg), 0, 1e-6),
        Quantity("gps", "longitude", "deg", 6, POSITION,
                 lambda v: v.lon_e7 / 1e7, place(lambda p: p.lon_deg), 0, 1e-6),
        Quantity("gps", "altitude by GPS", "m", 1, POSITION,
                 lambda v: v.alt_m, place(lambda p: p.alt_m), 0, 1.0),
        Quantity("gps", "speed", "km/h", 1, MOTION,
                 lambda v: v.speed_cm_s * 0.036, place(lambda p: p.speed_m_s * 3.6), 0, 0.1),
        Quantity("gps", "course", "deg", 1, MOTION,
                 lambda v: v.course_decideg / 10, aircraft.course_deg, 0, 0.2, True),
        Quantity("gps", "satellites", "", 0, MOTION,
                 lambda v: v.satellites, place(lambda p: p.satellites), 0, 0.0),
        Quantity("gps", "home distance", "m", 1, MOTION,
                 lambda v: v.home_dist_m, place(lambda p: home_from(p)[0]), 0, 6.0),
        Quantity("gps", "home direction", "deg", 1, MOTION,
                 lambda v: v.home_dir_decideg / 10, homeward, 0, 1.0, True),
        Quantity("barometer", "altitude", "m", 1, MAG_BARO,
                 lambda v: v.alt_m, aircraft.height_m, 600, 1.0),
        # The filter needs two seconds for 95 % of a change.
        Quantity("barometer", "vario", "m/s", 2, MAG_BARO,
                 lambda v: None if v.vario_cm_s is None else v.vario_cm_s / 100,
                 lambda t_ns: aircraft.climb_cm_s(t_ns) / 100, 2500, 0.5),
        Quantity("magnetometer", "heading", "deg", 1, MAG_BARO,
                 lambda v: tenth(v.heading_decideg), aircraft.course_deg, 200, 3.0, True),
    ]  # fmt: skip


def _slots(result: Report, receiver: GhostReceiver) -> None:
    starts_us = [heard.after_ns / 1000 for heard in receiver.downlink if heard.after_ns]
    if starts_us:
        low, high = min(starts_us), max(starts_us)
        result.lines.append(
            (
                "stop bit to telemetry slot",
                f"min {low:.2f}, mean {statistics.fmean(starts_us):.2f}, max {high:.2f} us "
                f"(must: {SLOT_US[0]:.0f} to {SLOT_US[1]:.0f} us)",
            )
        )
        if low < SLOT_US[0] or high > SLOT_US[1]:
            result.failures.append(f"telemetry began {low:.2f} to {high:.2f} us after a stop bit")
    contention = receiver.wire.contention
    slots = Counter(round(h.t_ns - h.after_ns) for h in receiver.downlink if h.after_ns)
    fullest = max(slots.values(), default=0)
    result.lines.append(
        ("collisions on the wire", f"{len(contention)}, frames in one slot: at most {fullest}")
    )
    if contention:
        result.failures.append(
            f"{len(contention)} collisions on the wire, the first at {contention[0] / 1e6:.3f} ms"
        )
    if fullest > 1:
        result.failures.append(f"{fullest} telemetry frames in one slot")
    if len(starts_us) < len(receiver.downlink):
        result.failures.append("telemetry was sent before the first control frame")
    if receiver.noise:
        result.failures.append(f"{len(receiver.noise)} bytes on the wire that are no frame")


def _quantity(result: Report, quantity: Quantity, radio: Radio, solutions: _Solutions) -> None:
    worst = 0.0
    last = None
    frames = 0
    for t_ns, values in radio.heard.get(quantity.kind, ()):
        shown = quantity.shown(values)
        if quantity.sensor == "gps":
            times = solutions.recent(t_ns)
        else:
            steps = round(quantity.age_ms * 1e6 / _STEP_NS)
            times = [t_ns - step * _STEP_NS for step in range(steps + 1)]
        really = [value for value in map(quantity.really, times) if value is not None]
        if shown is None or not really:
            continue
        errors = [_error(quantity, shown, value) for value in really]
        # In between is right as well: the board smooths. A place is one of two or wrong.
        between = quantity.sensor != "gps" and min(errors) <= 0 <= max(errors)
        nearest = 0.0 if between else min(errors, key=abs)
        worst = max(worst, abs(nearest))
        # Of two solutions that one is compared that is shown.
        beside = round(quantity.lag_ms * 1e6 / _STEP_NS)
        device = really[errors.index(nearest) if quantity.sensor == "gps" else beside]
        last = (shown, device, _error(quantity, shown, device))
        frames += 1
    if last is None:
        if radio.heard.get(quantity.kind) and quantity.label != "home direction":
            result.failures.append(f"the radio never showed a valid {quantity.label}")
        return
    gps = quantity.sensor == "gps"
    since = "the last two solutions" if gps else f"the last {quantity.age_ms:.0f} ms"
    before = f" {quantity.lag_ms:.0f} ms before" if quantity.lag_ms else ""
    digits, unit = quantity.digits, f" {quantity.unit}".rstrip()
    result.lines.append(
        (
            f"{quantity.label} on the radio",
            f"{last[0]:.{digits}f}{unit}, device {last[1]:.{digits}f}{unit}{before} "
            f"({last[2]:+.{digits}f}); {frames} frames within {worst:.{digits}f}{unit} of {since}",
        )
    )
    if worst > quantity.tolerance:
        result.failures.append(
            f"{quantity.label} on the radio is up to {worst:.{digits}f}{unit} off the device's"
        )


def _error(quantity: Quantity, shown: float, really: float) -> float:
    error = shown - really
    return (error + 180) % 360 - 180 if quantity.turns else error
