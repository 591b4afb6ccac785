"""A long flight at 500 Hz with everything on: heap, counters and pulses are watched."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from functools import partial

from ghst_tools.campaign.outputs import Outputs, moving, moving_link
from ghst_tools.campaign.pico import NO_SENSORS, Pico
from ghst_tools.campaign.picos import connect_battery, forked, no_exception
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Row, Trial, equal, expect
from ghst_tools.demo.probes import decoder_state

_RATE_HZ = 500
_CHUNK_S = 5
_WARM_UP_S = 10
"""Until everything is loaded that is loaded when it is used."""
_SPARE_BYTES = 1024
"""What the kept heap may differ by, from one look to the next: texts that are on their way."""
_CONFIGURATION = NO_SENSORS | {"battery": {"enabled": True}}
_USER = b"""
import gc, time
def setup(application):
    seen = [time.ticks_ms()]
    def watch(now_ms):
        if time.ticks_diff(now_ms, seen[0]) >= 5000:
            seen[0] = now_ms
            gc.collect()
            print("heap kept", gc.mem_alloc())
    application.steps.append(watch)
"""
# Request to the flight controller by a script of the radio: MSP version 1, API_VERSION.
_MSP = bytes.fromhex("820c213000010100000000000078")


def _frame(index: int, _t_ns: float) -> bytes:
    if index % 500 == 499:
        return _MSP
    if index % 4 == 0:
        # A mode of 500 Hz has no downlink; the telemetry bit asks for it.
        return moving_link(index, 0x33, rf_mode=11, telemetry=True)
    return moving(index, 0x30 + index % 3)


def fly(pico: Pico, seconds: int) -> str:
    """Fly for `seconds` of emulated time; what was found."""
    started = time.monotonic()
    connect_battery(pico)
    outputs = Outputs(pico)
    receiver = pico.fly(_frame, _RATE_HZ)
    begin = pico.board.now_ns
    kept: list[int] = []
    frames = requests = telemetry = 0
    while pico.board.now_ns - begin < seconds * 1e9:
        pico.board.run_for(min(_CHUNK_S * 1e9, seconds * 1e9 - (pico.board.now_ns - begin)))
        sent = [frame for end, frame in receiver.sent if end < pico.board.now_ns - 50e3]
        later = receiver.sent[len(sent) :]
        requests += sent.count(_MSP)
        frames += len(sent) - sent.count(_MSP)
        equal(decoder_state(pico.board).frames, frames, "control frames counted by the decoder")
        equal(decoder_state(pico.board).crc_errors, 0, "CRC errors")
        outputs.frames(receiver.sent)
        outputs.check()
        for frame in receiver.downlink:
            right = frame.ok and frame.after_ns is not None and 990e3 < frame.after_ns < 1010e3
            expect(right, f"telemetry {frame.after_ns} ns behind a frame")
        equal(receiver.noise, [], "bytes that are no telemetry frame")
        telemetry += len(receiver.downlink)
        text = bytes(pico.board.console.output)
        kept += [int(found[1]) for found in re.finditer(rb"heap kept (\d+)", text)]
        no_exception(pico)
        pico.board.console.output.clear()
        pico.driven.clear()
        pico.wire.edges.clear()
        receiver.trim()
        receiver.sent += later
    said = pico.reply_to_enter()
    expect("stood still 0 times" in said, f"the main loop stood still: {said}")
    expect("failsafes 0" in said and "0 collisions" in said, f"the board says {said}")
    expect("battery: 16.50 V" in said, f"the board says {said}")
    expect(telemetry > 3 * requests, f"{telemetry} telemetry frames")
    warm = kept[_WARM_UP_S // _CHUNK_S :] or kept
    expect(not warm or max(warm) - min(warm) <= _SPARE_BYTES, f"the kept heap: {warm}")
    heap = f"{warm[0]:,} bytes of heap kept at first, {warm[-1]:,} at the end; " if warm else ""
    took = time.monotonic() - started
    return (
        f"all {frames:,} control frames decoded and written to the outputs as an independent "
        f"model has them, {requests:,} MSP "
        f"requests, {telemetry:,} telemetry frames, each in its slot, no collision; "
        f"{outputs.shown()}; {heap}no failsafe, no fault, no reset; took {took:.0f} s of the "
        "host's time"
    )


def _row(setting: Setting) -> list[Row]:
    seconds = setting.effort.flight_s
    pico = setting.picos.boot(_CONFIGURATION, b"sensors: battery", files={"/user.py": _USER})
    happened = forked(partial(fly, pico, seconds))
    done = f"{seconds / 60:.1f} minutes of emulated time at {_RATE_HZ} Hz, battery, telemetry, MSP"
    return [Row("long flight", done, happened)]


def trials(setting: Setting) -> Iterator[tuple[str, Trial]]:
    """The one trial."""
    yield "flight", partial(_row, setting)
