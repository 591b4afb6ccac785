"""A board that starts from the file system that a failure of the power has left."""

from __future__ import annotations

import json
from typing import Any

from ghst_tools import filesystem
from ghst_tools.campaign.outputs import Outputs, moving
from ghst_tools.campaign.pico import SERVOS, Pico
from ghst_tools.campaign.picos import Picos, no_exception
from ghst_tools.campaign.verdict import equal, expect

_FILE, _NEW = "/ghst.json", "/ghst.json.new"
_RATE_HZ = 250
_DEFAULT_MS = 500
_LATE_NS = 20e6
# What a save has left is put in order, and everything is loaded.
_SETTLING_NS = 300e6
_FLIGHT_NS = 100e6


def start(picos: Picos, image: bytes, values: dict[str, Any], error: str | None) -> str:
    """Start with the file system `image` and fly; what it was like. Raises Wrong.

    `values`: the settings that are due; `error`: what is due instead, and then nothing moves.
    """
    pico = picos.new()
    pico.boot_from(image, b"link: searching")
    pico.board.run_for(_SETTLING_NS)
    no_exception(pico)
    told = [line for line in _lines(pico) if "Nothing moves" in line]
    equal(told, [f"micropython-ghst: {error}. Nothing moves."] if error else [], "what it tells")
    left = filesystem.read(pico.board.flash_filesystem())
    expect(_NEW not in left, f"{_NEW} is left after the start")
    if not error:
        equal(json.loads(left.get(_FILE, b"{}")), values, f"{_FILE} after the start")
    outputs = Outputs(pico)
    receiver = pico.fly(lambda index, t: moving(index), _RATE_HZ)
    pico.board.run_for(_FLIGHT_NS)
    receiver.stop()
    time_ms = values.get("failsafe", {}).get("time_ms", _DEFAULT_MS)
    pico.board.run_for(1e6 * time_ms + _LATE_NS)
    last_ns = receiver.sent[-1].end_ns
    if error:
        equal(pico.compares, [], "compare writes")
        for pin in SERVOS:
            equal(pico.meter.pulses[pin], [], f"pulses on GP{pin}")
            expect(not pico.meter.level(pin), f"GP{pin} is high")
        return "told as broken, no pulse and no pin high in flight"
    outputs.frames(receiver.sent)
    outputs.failsafe(last_ns + 1e6 * time_ms, last_ns + 1e6 * time_ms + _LATE_NS)
    outputs.finish()
    no_exception(pico)
    return f"{outputs.seen} pulses, just those due, failsafe after {time_ms} ms"


def _lines(pico: Pico) -> list[str]:
    return bytes(pico.board.console.output).decode(errors="replace").replace("\r", "").split("\n")
