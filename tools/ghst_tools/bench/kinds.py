"""Eight and sixteen outputs, plain and shaped: how late they are, and their share of the CPU."""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import cycle
from multiprocessing import get_context
from typing import Any, NamedTuple

from ghst import encode  # type: ignore[import-not-found]
from ghst_tools.bench import variants
from ghst_tools.bench.control_path import Frames, flight
from ghst_tools.bench.figures import IDLE, MEETING, Effort, Findings, Spread, Table
from ghst_tools.bench.rig import CONTROL_TYPES, Rig, control_frames
from ghst_tools.bench.talking import Talking

# From here on both channels of all eight PWM slices; the wire and the sensors are on others.
_FIRST_PIN = 6
_REVERSED = {"reverse": True}
_MOTOR = {"motor": True}
_SHAPED = {
    "minimum_us": 1050,
    "maximum_us": 1950,
    "subtrim_us": 20.5,
    "deadband_us": 12,
    "slow_us_per_s": 400,
}
# What only motors have, which run then, and limits for the link, which is better than they are.
_ARMING = {
    "arming": {"channel": 9, "throttle_channel": 10},
    "failsafe": {"minimum_lq_percent": 1, "minimum_rssi_dbm": -120},
}
_ARM_TYPES = (0x11, 0x31)
_LOW, _MIDDLE, _HIGH = 3, 128, 253
_RATE_HZ = 500

_INTERRUPTS, _THUMB = "firmware/interrupts.py", "/lib/firmware/shape_thumb.mpy"
# What is shaped is within the limits already: failsafe alone is left to be asked for.
UNLIMITED = tuple(
    (
        f"""\
                if uint({half} - MINIMUM) > uint(MAXIMUM - MINIMUM):
                    if {half} == 0:
                        {half} = ptr16(slice[{word}])[0]
                    if {half} > MAXIMUM:
                        {half} = MAXIMUM
                    elif {half} < MINIMUM and {half} != 0:
                        {half} = MINIMUM
""",
        f"""\
                if {half} == 0:
                    {half} = ptr16(slice[{word}])[0]
""",
    )
    for half, word in (("low", 4), ("high", 8))
)


def _arming_frames() -> Iterator[bytes]:
    """Frames that arm, and then those of all types that leave the arm channel as it is."""
    for arm in (_LOW, _HIGH):
        yield bytes(encode.channels(0x31, (2048,) * 4, (arm, _LOW, _MIDDLE, _MIDDLE)))
    values = random.Random(0x6857)
    for kind in cycle(kind for kind in CONTROL_TYPES if kind not in _ARM_TYPES):
        primaries = [values.randrange(4096) for _ in range(4)]
        if kind & 0x1F == 0x13:
            yield bytes(encode.link_data(kind, primaries, lq=99, rssi_dbm=-60))
        else:
            yield bytes(
                encode.channels(kind, primaries, [values.randrange(256) for _ in range(4)])
            )


class _Kind(NamedTuple):
    """Outputs, on channels from 1 on."""

    outputs: list[dict[str, Any]]
    others: Mapping[str, Any] = {}
    """Other sections of the configuration."""
    frames: Frames = control_frames

    def rig(self, rig: Rig) -> Rig:
        """A rig with these outputs."""
        points = enumerate(self.outputs)
        return rig.with_outputs(
            {_FIRST_PIN + at: {"channel": 1 + at, **point} for at, point in points}, self.others
        )


EIGHT_PLAIN, EIGHT_SHAPED, EIGHT_ARMED = "8 plain", "8 shaped", "8 shaped, 4 armed"
SIXTEEN_PLAIN, SIXTEEN_SHAPED = "16 plain", "16 shaped"
_OTHERS = {
    SIXTEEN_PLAIN: _Kind([{}] * 16),
    EIGHT_SHAPED: _Kind([_SHAPED | _REVERSED] * 8),
    EIGHT_ARMED: _Kind(
        [_SHAPED | _REVERSED] * 4 + [_SHAPED | _MOTOR] * 4, _ARMING, _arming_frames
    ),
    SIXTEEN_SHAPED: _Kind([_SHAPED | _REVERSED] * 16),
}


def percent(rig: Rig, frames: Frames, seconds: float) -> float:
    """What control frames alone take of the CPU at 500 Hz."""
    talking = Talking(rig)
    without = talking.rounds(seconds)
    left, _ = talking.rounds_in_flight(seconds, _RATE_HZ, talk=False, frames=frames())
    return 100 * (1 - left / without)


def kinds(rig: Rig, effort: Effort, findings: Findings) -> tuple[Table, ...]:
    """All kinds beside each other; eight plain outputs were measured before."""
    rigs = {name: kind.rig(rig) for name, kind in _OTHERS.items()}
    with ProcessPoolExecutor(mp_context=get_context("fork")) as pool:
        flights = {
            kind: {
                load: pool.submit(flight, each, effort.kinds_frames, load, _OTHERS[kind].frames)
                for load in effort.loads
            }
            for kind, each in rigs.items()
        }
        shares = {
            kind: pool.submit(percent, each, _OTHERS[kind].frames, effort.share_s)
            for kind, each in rigs.items()
        }
        for kind, flown in flights.items():
            results = {load: each.result() for load, each in flown.items()}
            findings.kinds_us[kind] = {load: found for load, (found, _, _) in results.items()}
            findings.lost += sum(lost for _, lost, _ in results.values())
        findings.kinds_percent = {kind: share.result() for kind, share in shares.items()}
    plain = {load: us for load, us in findings.latencies_us.items() if load != MEETING}
    table = Table(
        "Plain and shaped outputs",
        "Last stop bit to last compare register in microseconds, in flights as above, under each "
        f"of the loads: {', '.join(effort.loads)}; mean and maximum of all of them, p99 of the "
        "load under which it is latest. The outputs, on GP6 and those behind it, follow the "
        "channels from 1 on, which all move. A shaped one has everything that a servo can have: "
        f"{json.dumps(_SHAPED | _REVERSED)[1:-1]}. Armed: motors in place of reversed servos, "
        f"which run, and limits for the link: {json.dumps(_ARMING)[1:-1]}; channels 9 to 12 stand "
        f"still then. Share: of the CPU at {_RATE_HZ} Hz with control frames alone, measured as "
        "it is above.",
        ("outputs", "frames", "mean", "p99", "max", "share"),
        tuple(
            _row(kind, found, share)
            for kind, found, share in (
                (EIGHT_PLAIN, plain, findings.share_percent),
                *((kind, findings.kinds_us[kind], findings.kinds_percent[kind]) for kind in rigs),
            )
        ),
    )
    return (table,)


def _row(kind: str, found: dict[str, list[float]], share: float) -> tuple[str, ...]:
    every = Spread.of([us for each in found.values() for us in each])
    p99 = max(Spread.of(each).p99 for each in found.values())
    times = (every.mean, p99, every.maximum)
    return (kind, f"{every.count}", *(f"{us:.2f}" for us in times), f"{share:.2f} %")


def _ways(rig: Rig) -> dict[str, Rig]:
    """The firmware as it is, and others that were to be faster."""
    viper = copy.copy(rig)
    viper.files = {path: content for path, content in rig.files.items() if path != _THUMB}
    return {
        "as it is": rig,
        "shapes in viper": viper,
        "limits in the function of the shapes alone": rig.variant({_INTERRUPTS: UNLIMITED}),
        "decoder within the handler (1)": rig.variant({_INTERRUPTS: variants.inlined(rig)}),
    }


def _way(effort: Effort, kind: str, name: str, rig: Rig) -> tuple[str, ...]:
    flown, frames = _OTHERS[kind].rig(rig), _OTHERS[kind].frames
    found, lost, _ = flight(flown, effort.kinds_frames, IDLE, frames)
    if lost:
        raise AssertionError(f"{kind}, {name}: {lost} frames lost")
    return _row(f"{kind}: {name}", {name: found}, percent(flown, frames, effort.share_s))


def ways(rig: Rig, effort: Effort) -> tuple[Table, ...]:
    """What would make those kinds faster that miss a goal."""
    found = _ways(rig)
    with ProcessPoolExecutor(mp_context=get_context("fork")) as pool:
        rows = [
            row
            for kind in (EIGHT_ARMED, SIXTEEN_SHAPED)
            for row in pool.map(partial(_way, effort, kind), found, found.values())
        ]
    table = Table(
        "Shaped outputs: other ways that were tried",
        "As in the table above, with an idle main loop. "
        "Limits in the function of the shapes alone: the frame interrupt does not hold pulses to "
        "800..2200 us once more. (1): without MSP and without the CRC of a buffer, to make room.",
        ("outputs: control path", "frames", "mean", "p99", "max", "share"),
        tuple(rows),
    )
    return (table,)
