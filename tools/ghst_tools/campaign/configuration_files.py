"""Configuration files that are broken, read by the firmware on host and board."""

from __future__ import annotations

import ast
import json
import subprocess
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from ghst_tools import boards, filesystem, micropython_image
from ghst_tools.campaign import corruption
from ghst_tools.campaign.line import ENDS
from ghst_tools.campaign.pico import SERVOS
from ghst_tools.campaign.picos import Picos, forked
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Row, Trial, Wrong, equal, expect
from ghst_tools.configuration.validator import firmware_module
from ghst_tools.emulator import Board

# What the firmware makes of the two files, as a tuple: read by `ast.literal_eval`.
_OUTCOME = """
from firmware.configuration import load
def outcome():
    try:
        made = load.load()
    except load.BoardError as error:
        return ("board", str(error))
    except Exception as error:
        return ("raised", type(error).__name__ + ": " + str(error))
    if made.problems:
        return ("problems", made.problems[0], len(made.values["outputs"]))
    return ("valid", made.values)
"""
_UNIX = """
load.FILE, load.BOARD_FILE = {paths!r}
size = bytearray(4)
with open({source!r}, "rb") as source:
    while source.readinto(size):
        with open({target!r}, "wb") as target:
            target.write(source.read(size[0] | size[1] << 8 | size[2] << 16))
        print(repr(outcome()))
"""
USER, BOARD = "ghst.json", "board.json"
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


class _Files:
    """The two files in a folder, one of them to be written by a trial."""

    def __init__(self, folder: Path) -> None:
        self.paths = (str(folder / USER), str(folder / BOARD))
        self.write(USER, corruption.user_file())
        self.write(BOARD, corruption.board_file())

    def path(self, which: str) -> str:
        return self.paths[0] if which == USER else self.paths[1]

    def write(self, which: str, text: bytes) -> None:
        Path(self.path(which)).write_bytes(text)


def on_host(which: str, texts: Sequence[bytes]) -> list[tuple[Any, ...]]:
    """What the firmware's code makes of each text on CPython."""
    load: Any = firmware_module("configuration.load")
    names: dict[str, Any] = {}
    exec(_OUTCOME, names)
    before = load.FILE, load.BOARD_FILE
    outcomes = []
    with tempfile.TemporaryDirectory() as folder:
        files = _Files(Path(folder))
        load.FILE, load.BOARD_FILE = files.paths
        try:
            for text in texts:
                files.write(which, text)
                outcomes.append(names["outcome"]())
        finally:
            load.FILE, load.BOARD_FILE = before
    return outcomes


def on_unix(which: str, texts: Sequence[bytes]) -> list[tuple[Any, ...]]:
    """The same on MicroPython's unix port."""
    root = boards.checkout()
    with tempfile.TemporaryDirectory() as folder:
        files = _Files(Path(folder))
        source = Path(folder) / "texts"
        source.write_bytes(b"".join(len(text).to_bytes(4, "little") + text for text in texts))
        program = _OUTCOME + _UNIX.format(
            paths=files.paths, source=str(source), target=files.path(which)
        )
        done = subprocess.run(
            [micropython_image.unix_micropython(), "-c", program],
            env={"MICROPYPATH": f"{root / 'lib'}:{root}:.frozen"},
            capture_output=True,
            text=True,
        )
    lines = done.stdout.splitlines()
    if done.returncode or len(lines) != len(texts):
        case = configuration_case(which, texts[min(len(lines), len(texts) - 1)])
        raise Wrong(f"unix port: {done.stdout[-300:]}{done.stderr[-300:]}", case)
    return [ast.literal_eval(line) for line in lines]


def on_board(picos: Picos, which: str, texts: Sequence[bytes]) -> list[tuple[Any, ...]]:
    """The same on the emulated board, from its flash."""
    files = {path: data for path, data in picos.files.items() if path != "/main.py"}
    files |= {f"/{USER}": corruption.user_file(), f"/{BOARD}": corruption.board_file()}
    board = Board(picos.image, filesystem.build(files, picos.filesystem_size))
    board.boot()
    board.exec(_OUTCOME)
    outcomes = []
    for text in texts:
        board.exec(f"with open('/{which}', 'wb') as file:\n    file.write({text!r})\n")
        outcomes.append(ast.literal_eval(board.exec("import gc; gc.collect(); print(outcome())")))
    return outcomes


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
    (outcome,) = on_host(USER, [text])
    pico = picos.new()
    pico.boot(files={f"/{USER}": text}, until=b"link: searching")
    case = configuration_case(USER, text)
    told = "Nothing moves" in bytes(pico.board.console.output).decode(errors="replace")
    pico.fly(lambda index, t: ENDS, 250)
    pico.board.run_for(60e6)
    pulses = {pin: pico.meter.pulses[pin] for pin in SERVOS}
    if told:
        for pin, found in pulses.items():
            equal(found, [], f"pulses on GP{pin} with a broken file", case)
        equal(pico.compares, [], "compare writes with a broken file", case)
        return "error"
    equal(outcome[0], "valid", "what the host makes of a file that the board flies with", case)
    outputs = outcome[1]["outputs"]
    for pin, found in pulses.items():
        expect(pin in outputs or not found, f"pulses on GP{pin}, which is not in the file", case)
        if found and outputs[pin]["kind"] != "switch":
            shortened = _SHORTENED[outputs[pin]["kind"]]
            for pulse in found:
                right = 799.5e3 <= pulse.width_ns * shortened <= 2203e3
                expect(right, f"a pulse of {pulse.width_ns / 1e3} us on GP{pin}", case)
    return "valid"


def boots(setting: Setting) -> list[Row]:
    """Whole starts with broken files and a receiver on the wire."""
    count = setting.effort.boots
    texts = list(corruption.corrupted(setting.seed + 1, corruption.user_file(), count))
    found = Counter(forked(partial(booted, setting.picos, text)) for text in texts)
    return [
        Row(
            f"{USER} corrupted, whole start",
            f"{count} ways, the application started with each, a receiver on the wire",
            f"{found['error']} times no pulse and the reason on the console, {found['valid']} "
            "times pulses within the limits, and only on the pins that the file names",
        )
    ]


def configuration_case(which: str, text: bytes) -> dict[str, Any]:
    """A broken file as a case that can be saved."""
    return {"kind": "configuration", "file": which, "text": text.hex()}


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
