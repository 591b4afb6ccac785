"""Eight and sixteen outputs, plain and shaped: how late they are, and their share of the CPU."""

from __future__ import annotations

import copy
import json
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from typing import Any

from ghst_tools.bench import variants
from ghst_tools.bench.control_path import flight, latencies_us
from ghst_tools.bench.figures import MEETING, Effort, Findings, Spread, Table
from ghst_tools.bench.rig import Rig
from ghst_tools.bench.talking import Talking

# From here on both channels of all eight PWM slices; the wire and the sensors are on others.
_FIRST_PIN = 6
_PLAIN: dict[str, Any] = {}
_SHAPED: dict[str, Any] = {
    "reverse": True,
    "minimum_us": 1050,
    "maximum_us": 1950,
    "subtrim_us": 20.5,
    "deadband_us": 12,
    "slow_us_per_s": 400,
}
EIGHT_PLAIN, SIXTEEN_PLAIN = "8 plain", "16 plain"
EIGHT_SHAPED, SIXTEEN_SHAPED = "8 shaped", "16 shaped"
_OTHERS: dict[str, tuple[int, dict[str, Any]]] = {
    SIXTEEN_PLAIN: (16, _PLAIN),
    EIGHT_SHAPED: (8, _SHAPED),
    SIXTEEN_SHAPED: (16, _SHAPED),
}
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


def rig_of(rig: Rig, kind: str) -> Rig:
    """A rig with outputs of this kind, on channels from 1 on."""
    count, values = _OTHERS[kind]
    return rig.with_outputs(
        {_FIRST_PIN + at: {"channel": 1 + at, **values} for at in range(count)}
    )


def percent(rig: Rig, seconds: float) -> float:
    """What control frames alone take of the CPU at 500 Hz."""
    talking = Talking(rig)
    without = talking.rounds(seconds)
    left, _ = talking.rounds_in_flight(seconds, _RATE_HZ, talk=False)
    return 100 * (1 - left / without)


def kinds(rig: Rig, effort: Effort, findings: Findings) -> tuple[Table, ...]:
    """All kinds beside each other; eight plain outputs were measured before."""
    rigs = {kind: rig_of(rig, kind) for kind in _OTHERS}
    with ProcessPoolExecutor(mp_context=get_context("fork")) as pool:
        flights = {
            kind: {
                load: pool.submit(flight, each, effort.kinds_frames, load) for load in effort.loads
            }
            for kind, each in rigs.items()
        }
        shares = {kind: pool.submit(percent, each, effort.share_s) for kind, each in rigs.items()}
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
        f"{json.dumps(_SHAPED)[1:-1]}. Share: of the CPU at {_RATE_HZ} Hz with control frames "
        "alone, measured as it is above.",
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


def _sixteen(rig: Rig) -> dict[str, Rig]:
    """Sixteen shaped outputs, with the firmware as it is and with others."""
    inlined = rig.variant({_INTERRUPTS: variants.inlined(rig)})
    unlimited = rig.variant({_INTERRUPTS: UNLIMITED})
    viper = copy.copy(rig)
    viper.files = {path: content for path, content in rig.files.items() if path != _THUMB}
    ways = {
        "as it is": rig,
        "shapes in viper": viper,
        "limits in the function of the shapes alone": unlimited,
        "decoder within the handler (1)": inlined,
    }
    return {name: rig_of(each, SIXTEEN_SHAPED) for name, each in ways.items()}


def _way(effort: Effort, name: str, rig: Rig) -> tuple[str, ...]:
    found, lost = latencies_us(rig.asleep, effort.variant_frames)
    if lost:
        raise AssertionError(f"{name}: {lost} frames lost")
    return _row(name, {name: found}, percent(rig, effort.share_s))


def ways(rig: Rig, effort: Effort) -> tuple[Table, ...]:
    """What would make sixteen shaped outputs faster."""
    found = _sixteen(rig)
    with ProcessPoolExecutor(mp_context=get_context("fork")) as pool:
        rows = list(pool.map(partial(_way, effort), found, found.values()))
    table = Table(
        "Sixteen shaped outputs: other ways that were tried",
        f"As in the table above, with an idle main loop and {effort.variant_frames} frames. "
        "Limits in the function of the shapes alone: the frame interrupt does not hold pulses to "
        "800..2200 us once more. (1): without MSP and without the CRC of a buffer, to make room.",
        ("control path", "frames", "mean", "p99", "max", "share"),
        tuple(rows),
    )
    return (table,)
