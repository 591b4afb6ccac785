"""Configuration files that are broken, read by the firmware on host and board."""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from ghst_tools import boards
from ghst_tools.campaign import corruption
from ghst_tools.campaign.configuration_readers import (
    BOARD,
    ON_BOARD,
    USER,
    configuration_case,
    on_board,
    on_host,
    on_unix,
)
from ghst_tools.campaign.merge import compare, is_strict
from ghst_tools.campaign.picos import Picos, forked
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Row, Trial, Wrong, equal, expect

SHORTENED = {"servo": 1, "servo_760": 2, "oneshot125": 8}


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
        shortened = SHORTENED[output["kind"]]
        pulses = [output[name] for name in ("minimum_us", "centre_us", "maximum_us")]
        if failsafe not in ("hold", "none"):
            pulses.append(failsafe)
        for pulse in pulses:
            right = pulse is None or 800 <= pulse * shortened <= 2200
            expect(right, f"GP{pin}: a pulse of {pulse} us")
        if output["motor"]:
            expect(values["arming"]["channel"] is not None, f"GP{pin}: a motor without arming")
            equal(failsafe, "none", f"GP{pin}: failsafe of a motor")


@functools.cache
def defaults() -> dict[str, Any]:
    """All values of a `ghst.json` in which there is nothing."""
    ((kind, values),) = on_host(USER, [b"{}"])
    equal(kind, "valid", "an empty ghst.json")
    return dict(values)


def _judged(outcome: tuple[Any, ...], which: str, text: bytes, where: str) -> str:
    """Raise Wrong unless it is a clear error or a valid configuration; which of them it is."""
    case = configuration_case(which, text)
    kind, said = outcome[:2]
    if kind == "valid":
        try:
            expect(is_strict(text), "taken, and no JSON")
            judge(said, which)
            if which == USER:
                compare(said, text, defaults())
        except Wrong as wrong:
            raise Wrong(f"{where}: {wrong}", case) from wrong
        except (KeyError, TypeError) as error:
            raise Wrong(f"{where}: {type(error).__name__}: {error}", case) from error
        return "valid"
    expect(kind in ("board", "problems"), f"{where}: {said}", case)
    expect(bool(said) and "\n" not in said, f"{where}: {said!r} is not a line", case)
    names = _names(which, where)
    expect(any(name in said for name in names), f"{where}: {said!r} names no file", case)
    if kind == "problems":
        equal(outcome[2], 0, f"{where}: outputs that move in spite of {said!r}", case)
    return "error"


def _names(which: str, where: str) -> list[str]:
    """How the files end that an error may be in: what a board lacks makes the user's one wrong."""
    names = [f"/{USER}: ", f"/{USER} is "]
    if where == "emulated board":
        names = [*names, ON_BOARD] if which == BOARD else [ON_BOARD]
    elif which == BOARD:
        names += [f"/{BOARD}: ", f"/{BOARD} is "]
    return names


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
    outcomes = read[where]()
    host = outcomes if where == "host" else read["host"]()
    for broken, outcome, there in zip(texts, outcomes, host, strict=True):
        found[_judged(outcome, which, broken, where)] += 1
        case = configuration_case(which, broken)
        equal(outcome[0] == "valid", there[0] == "valid", f"{where}: taken, as on the host", case)
    told = "all of them JSON to the letter"
    if which == USER:
        told += " and with each value that the file says, the rest defaults"
    if where != "host":
        told += "; the same files are taken as on the host"
    return [
        Row(
            f"{which} corrupted, {where}",
            f"{count:,} ways: {', '.join(corruption.KINDS)}",
            f"{found['error']:,} times an error in one line that names the file, and no outputs; "
            f"{found['valid']:,} times a configuration in which every value is within its limits, "
            f"{told}",
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
