"""Configuration files that are broken, read by the firmware on host and board."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from ghst_tools import boards
from ghst_tools.campaign import corruption
from ghst_tools.campaign.configuration_readers import (
    BOARD,
    USER,
    configuration_case,
    on_board,
    on_host,
    on_unix,
)
from ghst_tools.campaign.line import ENDS, LINK
from ghst_tools.campaign.pico import SERVOS
from ghst_tools.campaign.picos import Picos, forked
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Row, Trial, Wrong, equal, expect

_SHORTENED = {"servo": 1, "servo_760": 2, "oneshot125": 8}


def judge(values: dict[str, Any], which: str) -> None:
    """Raise Wrong unless a configuration that was taken is one that may fly."""
    outputs = values["outputs"]
    equal(bool(outputs), values[""]["role"] == "flight", "outputs of a flight controller")
    expect(110 <= values["failsafe"]["time_ms"] <= 10_000, "failsafe.time_ms")
    if which == USER:
        able = boards.load(boards.DEFAULT_BOARD).pins
        for pin in outputs:
            expect(pin in able, f"GP{pin} is no pin of this board")
    expect(values["wire"]["pin"] not in outputs, "the wire is an output")
    expect(values["led"]["pin"] not in outputs, "the LED is an output")
    equal(len({pin % 16 for pin in outputs}), len(outputs), "PWM channels in use")
    for pin, output in outputs.items():
        expect(output["channel"] in range(1, 17), f"GP{pin}: channel {output['channel']}")
        expect(50 <= output["frequency_hz"] <= 400, f"GP{pin}: {output['frequency_hz']} Hz")
        failsafe = output["failsafe"]
        if output["kind"] == "switch":
            expect(failsafe in ("hold", "none", "on", "off"), f"GP{pin}: failsafe {failsafe}")
            continue
        shortened = _SHORTENED[output["kind"]]
        pulses = [output[name] for name in ("minimum_us", "centre_us", "maximum_us")]
        if failsafe not in ("hold", "none"):
            pulses.append(failsafe)
        for pulse in pulses:
            right = pulse is None or 800 <= pulse * shortened <= 2200
            expect(right, f"GP{pin}: a pulse of {pulse} us")
        if output["motor"]:
            expect(values["arming"]["channel"] is not None, f"GP{pin}: a motor without arming")
            equal(failsafe, "none", f"GP{pin}: failsafe of a motor")


def _judged(outcome: tuple[Any, ...], which: str, text: bytes, where: str) -> str:
    """Raise Wrong unless it is a clear error or a valid configuration; which of them it is."""
    case = configuration_case(which, text)
    kind, said = outcome[:2]
    if kind == "valid":
        try:
            judge(said, which)
        except Wrong as wrong:
            raise Wrong(f"{where}: {wrong}", case) from wrong
        except (KeyError, TypeError) as error:
            raise Wrong(f"{where}: {type(error).__name__}: {error}", case) from error
        return "valid"
    expect(kind in ("board", "problems"), f"{where}: {said}", case)
    expect(bool(said) and "\n" not in said, f"{where}: {said!r} is not a line", case)
    if kind == "problems":
        equal(outcome[2], 0, f"{where}: outputs that move in spite of {said!r}", case)
    return "error"


def _is_json(text: bytes) -> bool:
    try:
        json.loads(text)
    except (ValueError, RecursionError):
        return False
    return True


def fuzz(setting: Setting, which: str, where: str) -> list[Row]:
    """Broken files read on `where`: host, unix port or emulated board."""
    effort = setting.effort
    count = effort.board_files if where == "emulated board" else effort.files
    text = corruption.user_file() if which == USER else corruption.board_file()
    texts = list(corruption.corrupted(setting.seed, text, count))
    read: dict[str, Callable[[], list[tuple[Any, ...]]]] = {
        "host": partial(on_host, which, texts),
        "unix port": partial(on_unix, which, texts),
        "emulated board": lambda: on_board(setting.picos, which, texts),
    }
    found: Counter[str] = Counter()
    for broken, outcome in zip(texts, read[where](), strict=True):
        verdict = _judged(outcome, which, broken, where)
        found[verdict] += 1
        found["lenient"] += verdict == "valid" and not _is_json(broken)
    return [
        Row(
            f"{which} corrupted, {where}",
            f"{count:,} ways: {', '.join(corruption.KINDS)}",
            f"{found['error']:,} times an error in one line and no output moves, "
            f"{found['valid']:,} times a configuration in which every value is within its limits, "
            f"{found['lenient']:,} of them no strict JSON",
        )
    ]


def booted(picos: Picos, text: bytes) -> str:
    """Start the application with a file, and fly: what was told, and what moved."""
    (outcome,) = on_unix(USER, [text])
    pico = picos.new()
    pico.boot(files={f"/{USER}": text}, until=b"link: searching")
    case = configuration_case(USER, text)
    told = "Nothing moves" in bytes(pico.board.console.output).decode(errors="replace")
    pico.fly(lambda index, t: ENDS if index % 10 else LINK, 250)
    pico.board.run_for(60e6)
    pulses = {pin: pico.meter.pulses[pin] for pin in SERVOS}
    if told:
        for pin, found in pulses.items():
            equal(found, [], f"pulses on GP{pin} with a broken file", case)
        equal(pico.compares, [], "compare writes with a broken file", case)
        return "error"
    equal(outcome[0], "valid", "what the unix port makes of a file that flies", case)
    outputs = outcome[1]["outputs"]
    for pin, found in pulses.items():
        expect(pin in outputs or not found, f"pulses on GP{pin}, which is not in the file", case)
        if found and outputs[pin]["kind"] != "switch":
            shortened = _SHORTENED[outputs[pin]["kind"]]
            for pulse in found:
                right = 799.5e3 <= pulse.width_ns * shortened <= 2203e3
                expect(right, f"a pulse of {pulse.width_ns / 1e3} us on GP{pin}", case)
    expect(any(pulses.values()) or not outputs, "no pulse with a file that is valid", case)
    return "valid"


def boots(setting: Setting) -> list[Row]:
    """Whole starts with a receiver on the wire: half of the files are valid in spite of all."""
    count = setting.effort.boots
    texts = list(corruption.corrupted(setting.seed + 1, corruption.user_file(), 60 * count))
    kinds: dict[bool, list[bytes]] = {True: [], False: []}
    for text, outcome in zip(texts, on_unix(USER, texts), strict=True):
        kinds[outcome[0] == "valid"].append(text)
    chosen = kinds[False][: count - count // 2] + kinds[True][: count // 2]
    equal(len(chosen), count, "files that were found")
    found = Counter(forked(partial(booted, setting.picos, text)) for text in chosen)
    return [
        Row(
            f"{USER} corrupted, whole start",
            f"{count} ways, the application started with each, a receiver on the wire",
            f"{found['error']} times no pulse and the reason on the console, {found['valid']} "
            "times pulses within the limits, and only on the pins that the file names",
        )
    ]


def replay(case: dict[str, Any], picos: Picos) -> None:
    """Read a saved case on all three; raises Wrong."""
    which, text = case["file"], bytes.fromhex(case["text"])
    for where, read in (("host", on_host), ("unix port", on_unix)):
        _judged(read(which, [text])[0], which, text, where)
    _judged(forked(lambda: on_board(picos, which, [text]))[0], which, text, "emulated board")


def trials(setting: Setting) -> Iterator[tuple[str, Trial]]:
    """The trials, by name."""
    for which in (USER, BOARD):
        for where in ("host", "unix port", "emulated board"):
            yield f"{which}, {where}", partial(fuzz, setting, which, where)
    yield "whole start", partial(boots, setting)
