"""The checks of the telemetry slot: when it begins, what is in it, and when it stays empty."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ghst import downlink, encode  # type: ignore[import-not-found]
from ghst_tools.selftest import transmissions
from ghst_tools.selftest.context import PURE_RACE, Context, link_frame
from ghst_tools.selftest.result import Result, judged
from ghst_tools.selftest.session import ask
from ghst_tools.selftest.transmissions import Recording

_SLOTS = 8
# What the firmware promises, and what the samples and the pin's synchroniser add.
_EARLIEST_US, _LATEST_US = 999.0, 1001.5
_VOLTAGE_MV, _CURRENT_MA, _CONSUMED_MAH = 12_340, 5_670, 890  # of `selftest_bench`
_API_VERSION = 1
_MSP_REQUEST = bytes((0x30, 0, _API_VERSION, 0, 0, 0, 0, 0, 0, 0))
_RESPONSE = 0x28


def slots(context: Context) -> Iterator[Result]:
    """All there is about the slot."""
    yield from _frames(context)
    yield _battery(context)
    yield _msp(context)
    control = context.sticks[0].frames[0]
    yield _empty(context, "no slot in a mode without downlink", control, PURE_RACE)
    yield _empty(context, "no slot behind a wrong CRC", control[:-1] + b"\0")


def _slot(
    context: Context, before: list[bytes], control: bytes, scheduled: bool = False
) -> tuple[str | None, Recording]:
    sent = [transmissions.of_frame(frame) for frame in before]
    then = transmissions.of_frame(control)
    found = ask(context.session, f"bench.slot({sent}, {then!r}, {scheduled})")
    return found["frame"], transmissions.read(found["recording"], context.clock_hz)


def _frames(context: Context) -> Iterator[Result]:
    control = context.sticks[0].frames[0]
    before = ask(context.session, "bench.counters()")
    found = [_slot(context, [link_frame()], control) for _ in range(_SLOTS)]
    # Until the last echo has been compared.
    ask(context.session, "bench.wait(4)")
    after = ask(context.session, "bench.counters()")
    starts = [heard.start_us for _, heard in found if heard.start_us is not None]
    if starts:
        measured = f"{min(starts):.1f}..{max(starts):.1f} us, {len(starts)} of {_SLOTS}"
    else:
        measured = f"none in {_SLOTS} slots"
    yield judged(
        "telemetry slot: start",
        f"{_EARLIEST_US:g}..{_LATEST_US:g} us behind the control frame, {_SLOTS} of {_SLOTS}",
        measured,
        len(starts) == _SLOTS and min(starts) >= _EARLIEST_US and max(starts) <= _LATEST_US,
    )
    whole = [
        frame is not None and heard.telemetry.hex() == frame and heard.framing_ok
        for frame, heard in found
    ]
    counted = {key: after[key] - before[key] for key in ("sent", "collisions", "frames")}
    yield judged(
        "telemetry slot: frames",
        f"{_SLOTS} as they were handed over, 0 collisions, no echo decoded",
        f"{sum(whole)} right, {counted['collisions']} collisions, "
        f"{counted['frames'] - 2 * _SLOTS} echoes decoded",
        all(whole) and counted == {"sent": _SLOTS, "collisions": 0, "frames": 2 * _SLOTS},
    )


def _battery(context: Context) -> Result:
    _, heard = _slot(context, [link_frame()], context.sticks[0].frames[0], scheduled=True)
    values = _decoded(heard)
    shown = "nothing"
    if isinstance(values, downlink.PackStatus):
        shown = f"{values.voltage_mv / 1000:.2f} V, {values.current_ma / 1000:.2f} A"
    return judged(
        "telemetry: battery",
        f"{_VOLTAGE_MV / 1000:.2f} V, {_CURRENT_MA / 1000:.2f} A",
        shown,
        values == downlink.PackStatus(_VOLTAGE_MV, _CURRENT_MA, _CONSUMED_MAH, True, 0),
    )


def _msp(context: Context) -> Result:
    request = bytes(encode.msp(0x21, _MSP_REQUEST))
    control = context.sticks[0].frames[0]
    _, heard = _slot(context, [link_frame(), request], control, scheduled=True)
    values = _decoded(heard)
    chunk = bytes(values.chunk) if isinstance(values, downlink.MspResponse) else b""
    return judged(
        "telemetry: MSP answer",
        "API_VERSION, 3 bytes",
        f"command {chunk[2]}, {chunk[1]} bytes" if len(chunk) > 2 else "nothing",
        chunk[1:3] == bytes((3, _API_VERSION)),
    )


def _decoded(heard: Recording) -> Any:
    try:
        return downlink.decode(heard.telemetry)
    except ValueError:
        return None


def _empty(context: Context, name: str, control: bytes, rf_mode: int | None = None) -> Result:
    before = [link_frame() if rf_mode is None else link_frame(rf_mode)]
    frame, heard = _slot(context, before, control)
    silent = heard.start_us is None and not heard.telemetry
    return judged(
        name,
        "nothing is sent",
        "nothing" if silent else f"a byte after {heard.start_us:.1f} us",
        silent and frame is not None,
    )
