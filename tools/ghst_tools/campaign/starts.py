"""Whole starts with configuration files that are broken or different, and what the pins do."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from functools import partial
from typing import Any

import ghst  # type: ignore[import-not-found]
from ghst_tools import boards
from ghst_tools.campaign import corruption
from ghst_tools.campaign.configuration_files import SHORTENED, defaults
from ghst_tools.campaign.configuration_readers import BOARD, USER, on_unix
from ghst_tools.campaign.line import LINK
from ghst_tools.campaign.picos import Picos, forked, no_exception
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Row, Trial, equal, expect
from ghst_tools.emulator import PulseMeter

_RATE_HZ = 250
_START_NS = 3e9
_LOOK_NS = 100e6
# Sticks and all twelve other channels at both ends of their ranges; the wire's mode.
_FRAMES = (
    LINK,
    *(
        bytes(ghst.encode.channels(kind, sticks, others))
        for sticks, others in (
            ((0, 4095, 0, 4095), (0, 255, 0, 255)),
            ((4095, 0, 4095, 0), (255, 0, 255, 0)),
        )
        for kind in (0x30, 0x31, 0x32)
    ),
)
_LOWEST_US, _HIGHEST_US = 800, 2200
_MOTOR_LOWEST_US, _MOTOR_HIGHEST_US = 988, 2012
# A quarter of a microsecond of a servo's pulse, and a count of the PWM.
_ROUNDING_US = 0.5
_OTHER_CHIP = f"/{BOARD} is for an "
_DRIVEN = {
    "wire": ("pin", "tx_pin"),
    "led": ("pin",),
    "gps": ("tx_pin", "rx_pin"),
    "i2c": ("sda_pin", "scl_pin"),
    "rx5808": ("clock_pin", "data_pin", "select_pin"),
}
"""Pins that are no outputs for servos, but may be driven."""


def start_case(which: str, text: bytes) -> dict[str, Any]:
    """A file that a board is to start with, as a case that can be saved."""
    return {"kind": "start", "file": which, "text": text.hex()}


def _driven(values: dict[str, Any]) -> set[int]:
    found = set()
    for section, names in _DRIVEN.items():
        given = values.get(section)
        pins = [given.get(name) for name in names] if isinstance(given, dict) else []
        found |= {pin for pin in pins if type(pin) is int}
    return found


def _not_metered(which: str, text: bytes, values: dict[str, Any] | None) -> set[int]:
    """The pins of wire, LED and sensors: those of the values in force, or of all defaults."""
    if values is not None:
        return _driven(values)
    pins = _driven(defaults())
    if which == BOARD:
        try:
            board = json.loads(text)
        except (ValueError, RecursionError):
            board = None
        if isinstance(board, dict) and isinstance(board.get("defaults"), dict):
            pins |= _driven(board["defaults"])
    return pins


def _limits_us(output: dict[str, Any]) -> tuple[float, float]:
    """The shortest and the longest pulse that the file allows an output."""
    shortened = SHORTENED[output["kind"]]
    lowest, highest = _LOWEST_US / shortened, _HIGHEST_US / shortened
    if output["motor"]:
        lowest, highest = _MOTOR_LOWEST_US / shortened, _MOTOR_HIGHEST_US / shortened
    if output["minimum_us"] is not None:
        lowest = output["minimum_us"]
    if output["maximum_us"] is not None:
        highest = output["maximum_us"]
    return lowest, highest


def started(picos: Picos, which: str, text: bytes) -> tuple[str, int]:
    """Start a board with a file and a receiver on the wire. Raises Wrong.

    Returns "error" or "valid", and how many pins were looked at.
    """
    case = start_case(which, text)
    ((kind, *said),) = on_unix(which, [text])
    values = said[0] if kind == "valid" else None
    files = {f"/{USER}": corruption.user_file(), f"/{BOARD}": corruption.board_file()}
    pico = picos.new()
    receiver = pico.power_on(
        files | {f"/{which}": text}, lambda index, t: _FRAMES[index % len(_FRAMES)], _RATE_HZ
    )
    able = set(boards.load(boards.DEFAULT_BOARD).pins)
    pins = sorted(able - _not_metered(which, text, values))
    meter = PulseMeter(pico.board, pins)
    output = pico.board.console.output
    pico.board.run_until(lambda: b"Nothing moves" in output or b"link: " in output, _START_NS)
    pico.board.run_for(_LOOK_NS)
    expect(receiver.running, "the receiver has stopped", case)
    no_exception(pico, case)
    told = [line for line in output.decode(errors="replace").split("\n") if "Nothing mov" in line]
    if told:
        names = [f"/{USER}", f"/{BOARD}"]
        expect(any(name in told[0] for name in names), f"{told[0]!r} names no file", case)
        # Only the chip itself knows that a file is for another one.
        right = values is None or _OTHER_CHIP in told[0]
        expect(right, f"the board refuses a file that the unix port takes: {told[0]!r}", case)
        for pin in pins:
            equal(meter.pulses[pin], [], f"pulses on GP{pin} with a broken file", case)
            expect(not meter.level(pin), f"GP{pin} is high with a broken file", case)
        equal(pico.compares, [], "compare writes with a broken file", case)
        return "error", len(pins)
    expect(values is not None, f"the board flies a file that the unix port refuses: {said}", case)
    assert values is not None
    outputs = values["outputs"]
    for pin in pins:
        found = meter.pulses[pin]
        if pin not in outputs:
            equal(found, [], f"pulses on GP{pin}, which is no output", case)
            expect(not meter.level(pin), f"GP{pin} is high, and is no output", case)
        elif outputs[pin]["kind"] != "switch":
            lowest, highest = _limits_us(outputs[pin])
            for pulse in found:
                us = pulse.width_ns / 1e3
                right = lowest - _ROUNDING_US <= us <= highest + _ROUNDING_US
                expect(right, f"a pulse of {us} us on GP{pin}, not {lowest}..{highest}", case)
            # A link that is too weak by the file moves nothing.
            weak = values["failsafe"]["minimum_rssi_dbm"] is not None
            expect(bool(found) or weak, f"no pulse on GP{pin}", case)
    return "valid", len(pins)


def _chosen(setting: Setting, which: str) -> list[bytes]:
    """Files, half of them valid in spite of all and with the wire as it is connected."""
    count = setting.effort.boots
    text = corruption.user_file() if which == USER else corruption.board_file()
    texts = list(corruption.corrupted(setting.seed + 1, text, 60 * count))
    kinds: dict[bool, list[bytes]] = {True: [], False: []}
    for broken, (kind, *said) in zip(texts, on_unix(which, texts), strict=True):
        if kind != "valid":
            kinds[False].append(broken)
        elif said[0]["wire"] == defaults()["wire"]:
            kinds[True].append(broken)
    chosen = kinds[False][: count - count // 2] + kinds[True][: count // 2]
    equal(len(chosen), count, "files that were found")
    return chosen


def starts(setting: Setting, which: str) -> list[Row]:
    """Whole starts with a receiver on the wire, each with another `which`."""
    found: Counter[str] = Counter()
    pins = set()
    chosen = _chosen(setting, which)
    for text in chosen:
        verdict, looked_at = forked(partial(started, setting.picos, which, text))
        found[verdict] += 1
        pins.add(looked_at)
    return [
        Row(
            f"{which} corrupted, whole start",
            f"{len(chosen)} ways, a board powered on with each, a receiver on the wire sends "
            "all 16 channels from end to end; looked at: all pins of the board but those of "
            f"wire, LED and sensors, at least {min(pins)}",
            f"{found['error']} times no pulse and no pin high, and a line on the console that "
            f"names the file; {found['valid']} times pulses on the outputs that are in force and "
            "on no other pin, none outside of what minimum_us and maximum_us allow (or the limits "
            "of the kind); outputs of kind switch were not judged",
        )
    ]


def replay(case: dict[str, Any], picos: Picos) -> None:
    """Start a board with a saved file; raises Wrong."""
    forked(partial(started, picos, case["file"], bytes.fromhex(case["text"])))


def trials(setting: Setting) -> Iterator[tuple[str, Trial]]:
    """The trials, by name."""
    for which in (USER, BOARD):
        yield which, partial(starts, setting, which)
