"""Bytes over the emulated wire into the whole firmware: shaped outputs, arming, telemetry, MSP."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from typing import Any

import ghst  # type: ignore[import-not-found]
from ghst_tools.campaign import again
from ghst_tools.campaign.model import Model
from ghst_tools.campaign.pico import NO_SENSORS, Pico
from ghst_tools.campaign.picos import Picos, check_outputs, connect_battery, forked, no_exception
from ghst_tools.campaign.shown import Shown
from ghst_tools.campaign.verdict import Case, Row, equal, expect
from ghst_tools.campaign.wire_bytes import INTACT_US, Send, sends
from ghst_tools.demo.probes import decoder_memory, decoder_state

# Every shape of an output but a switch, whose pulses are as long as they like.
CONFIGURATION: dict[str, Any] = NO_SENSORS | {
    "battery": {"enabled": True},
    "outputs": {
        "6": {"reverse": True, "minimum_us": 1100, "maximum_us": 1900, "failsafe": "hold"},
        "7": {"deadband_us": 20, "subtrim_us": 50, "failsafe": 1500},
        "8": {"slow_us_per_s": 400, "failsafe": 1500},
        "9": {"motor": True, "minimum_us": 1000, "maximum_us": 2000},
    },
    "arming": {"channel": 5, "throttle_channel": 4},
}
_STEP_NS = 320
_LIMITS_NS = {6: (1100e3, 1900e3), 9: (1000e3, 2000e3)}
_FRAME_NS = 14 * 10e9 / 420_000
READY = b"sensors: battery"
# What link data say. Which of the other frames are decoded depends on when telemetry meets them.
_LINK = (
    *("lq", "rssi_dbm", "rssi_percent", "rf_mode", "telemetry_requested", "alt_scale"),
    "tx_power_dbm",
)


def _intact(rng: random.Random) -> bytes:
    """A frame that names an RF mode with a downlink, so that telemetry is sent."""
    raw = [rng.randrange(4096) for _ in range(4)]
    return bytes(ghst.encode.link_data(0x33, raw, lq=rng.randrange(101)))


_BEGIN = _intact(random.Random(0))


def blocks(seed: int, total: int) -> Iterator[tuple[float, list[Send]]]:
    """The blocks of `sends` with other intact frames, each with the time to its beginning."""
    rng = random.Random(seed)
    for *pieces, (pause_us, _) in sends(seed, total):
        block = [*pieces, (pause_us, _intact(rng))]
        yield rng.uniform(200.0, 6000.0), block


def one_block(pico: Pico, begin_us: float, block: Sequence[Send]) -> int:
    """Send a block; the frame at its end has to be decoded. How many frames were, in all.

    What the link data in that frame say has to be what the board knows then.
    """
    case = application_case(begin_us, block)
    end = pico.at(begin_us * 1e3)
    for pause_us, data in block:
        end = pico.wire.send(data, end + pause_us * 1e3)
    pico.board.run_for(end - _FRAME_NS - pico.board.now_ns)
    before = decoder_state(pico.board).frames
    pico.board.run_for(_FRAME_NS + 100e3)
    after = decoder_state(pico.board)
    equal(after.frames - before, 1, "control frames decoded of the intact one", case)
    _compare_link(pico, block[-1][1], case)
    for pin, (lowest, highest) in _LIMITS_NS.items():
        for pulse in pico.meter.pulses[pin]:
            right = lowest - _STEP_NS <= pulse.width_ns <= highest + _STEP_NS
            expect(right, f"a pulse of {pulse.width_ns / 1e3} us on GP{pin}", case)
    return after.frames


def _compare_link(pico: Pico, intact: bytes, case: Case) -> None:
    model, shown = Model(), Shown()
    model.feed(intact)
    memory = decoder_memory(pico.board)
    assert memory is not None
    shown.look(pico.board, memory)
    for name in _LINK:
        found, wanted = getattr(shown.receiver, name), getattr(model, name)
        equal(found, wanted, f"{name} behind the intact frame", case)


def fuzz_application(pico: Pico, seed: int, total: int) -> dict[str, int]:
    """`total` bytes to the application; what was counted."""
    found = {"bytes": 0, "blocks": 0, "pulses": 0, "telemetry": 0, "frames": 0}
    driven = 0
    connect_battery(pico)
    # What is loaded when it is used is loaded.
    one_block(pico, 1000.0, [(0.0, _BEGIN)])
    pico.board.run_for(300e6)
    for begin_us, block in blocks(seed, total):
        found["frames"] = one_block(pico, begin_us, block)
        found["blocks"] += 1
        found["bytes"] += sum(len(data) for _, data in block)
        found["pulses"] += check_outputs(pico, application_case(begin_us, block))
        driven += len(pico.driven)
        pico.driven.clear()
        pico.wire.edges.clear()
    found["telemetry"] = driven // 2
    pico.board.run_for(20e6)
    said = pico.reply_to_enter()
    no_exception(pico)
    expect("main loop: stood still 0 times" in said, f"the main loop stood still: {said}")
    expect(found["telemetry"] > 0, "no telemetry frame was sent")
    return found


def application_case(begin_us: float, block: Sequence[Send]) -> Case:
    """A block as a case that can be saved."""
    return {
        "kind": "application",
        "begin_us": begin_us,
        "sends": [[pause_us, data.hex()] for pause_us, data in block],
    }


def replay(case: Case, picos: Picos) -> None:
    """Run a saved case on a started board; raises Wrong."""
    pico = picos.boot(CONFIGURATION, READY)

    def trial() -> None:
        connect_battery(pico)
        # Telemetry needs a link that has named its mode.
        one_block(pico, 1000.0, [(0.0, _BEGIN)])
        for one in again.blocks_of(case):
            block = [(pause_us, bytes.fromhex(data)) for pause_us, data in one["sends"]]
            one_block(pico, one["begin_us"], block)
        no_exception(pico)

    forked(trial)


def fuzz(picos: Picos, seed: int, total: int) -> list[Row]:
    """`total` bytes over the wire to the application."""
    pico = picos.boot(CONFIGURATION, READY)

    def case_of(block: tuple[float, list[Send]]) -> tuple[Case, int]:
        return application_case(*block), sum(len(data) for _, data in block[1])

    with again.among(blocks(seed, total), case_of, "application_bytes"):
        found = forked(lambda: fuzz_application(pico, seed, total))
    return [
        Row(
            "bytes, whole firmware",
            f"{found['bytes']:,} bytes of the same kinds to the application with a battery, "
            f"motors, slow and reversed outputs, MSP, and {found['telemetry']} telemetry frames "
            f"that may meet them; {INTACT_US:.0f} us of pause before the intact frame behind each "
            "block",
            f"each of {found['blocks']} intact frames decoded, with the link values that the "
            f"model has; all {found['pulses']} pulses within the limits of their output; no fault "
            "of the main loop, which never stood still; no reset",
        )
    ]
