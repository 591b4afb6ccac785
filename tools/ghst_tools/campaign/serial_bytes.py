"""Bytes on the USB console of the running application: nothing of it moves an output."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import partial

from ghst_tools.campaign import again, console_bytes, serial_streams
from ghst_tools.campaign.line import CENTRE
from ghst_tools.campaign.periods import Periods
from ghst_tools.campaign.pico import NO_SENSORS, SERVOS, Pico
from ghst_tools.campaign.picos import Picos, forked, no_exception
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Case, Row, Trial, equal, expect

_NAME = re.compile(rb"^\(?(\w+)\)?", re.MULTILINE)
_RATE_HZ = 100
_SLICES = 4
# A magnetometer that is waited for has a command of its own.
_CONFIGURATION = NO_SENSORS | {"name": "Campaign", "magnetometer": {"enabled": True}}
_BOTH_CENTRED = 4800 << 16 | 4800  # counts of 0.3125 us
_COMMANDS = (b"calibrate", b"config", b"help", b"status")
_DONE = re.compile(rb'"ghst": "ok".*"to": "(save|restart)')
_REFUSED = b"the link is up"


def documented(pico: Pico) -> list[bytes]:
    """The names of the commands that `help` lists."""
    start = len(pico.board.console.output)
    pico.board.console.write(b"help\r~\r")
    pico.board.run_until(lambda: b"no command '~'" in pico.board.console.output[start:])
    lines = bytes(pico.board.console.output[start:]).splitlines()
    names = [found[1] for line in lines if b":" in line and (found := _NAME.match(line))]
    names = [name for name in names if name not in (b"Enter", b"no")]
    equal(tuple(sorted(names)), _COMMANDS, "the commands")
    return names


def type_in(pico: Pico, batch: bytes, number: int, flying: bool) -> int:
    """Type a batch and wait until the application has taken all of it; how much was refused."""
    mark = f"~{number}"
    start = len(pico.board.console.output)
    pico.board.console.write(batch + b"\x15\r" + mark.encode() + b"\r")
    answer = f"no command '{mark}'".encode()
    case = serial_case([batch], flying)
    try:
        pico.board.run_until(lambda: answer in pico.board.console.output[start:], 40e9, 2e6)
    except TimeoutError as error:
        expect(False, f"the console does not answer: {error}", case)
    no_exception(pico, case)
    said = bytes(pico.board.console.output[start:])
    done = _DONE.search(said)
    expect(done is None, f"the board says {done[0] if done else b''!r}", case)
    return said.count(_REFUSED)


def check_still(pico: Pico, case: Case) -> None:
    """No output has moved, and no compare register was written."""
    equal(pico.compares, [], "compare writes without a link", case)
    for pin in SERVOS:
        equal(pico.meter.pulses[pin], [], f"pulses on GP{pin} without a link", case)


class Flight:
    """A flight with all channels in the middle, whatever is typed meanwhile."""

    def __init__(self, pico: Pico) -> None:
        self._pico = pico
        self._receiver = pico.fly(lambda index, t: CENTRE, _RATE_HZ)
        pico.board.run_for(100e6)
        self._periods = Periods(pico, self._receiver.sent[0].end_ns)

    def check(self, case: Case) -> int:
        """Each frame since the last call was written to the outputs; how many these were."""
        pico, receiver = self._pico, self._receiver
        # The last frame may be on its way.
        while (left_ns := receiver.sent[-1].end_ns + 300e3 - pico.board.now_ns) > 0:
            pico.board.run_for(left_ns)
        count = len(receiver.sent)
        equal(len(pico.compares), _SLICES * count, "compare writes", case)
        equal({write.value for write in pico.compares}, {_BOTH_CENTRED}, "compare values", case)
        self._periods.check(case)
        for pin in SERVOS:
            widths = {round(pulse.width_ns) for pulse in pico.meter.pulses[pin]}
            equal(widths - {1_500_000}, set(), f"other pulses on GP{pin}", case)
            pico.meter.pulses[pin].clear()
        last = receiver.sent[-1]
        receiver.trim()
        pico.compares.clear()
        pico.wire.edges.clear()
        expect(pico.board.now_ns - last.end_ns < 2e9 / _RATE_HZ, "the receiver sends", case)
        return count


def fuzz_console(pico: Pico, seed: int, total: int, flying: bool) -> tuple[int, int, int]:
    """`total` bytes; how many, control frames that came meanwhile, what the board refused."""
    names = documented(pico)
    before = pico.board.flash_filesystem()
    flight = Flight(pico) if flying else None
    count = frames = refused = 0
    batches = partial(serial_streams.batches, seed, total, names, flying)

    def case_of(batch: bytes) -> tuple[Case, int]:
        # The trials with and without a link have half of the bytes each.
        return serial_case([batch], flying), 2 * len(batch)

    with again.among(batches(), case_of, "serial_bytes"):
        for number, batch in enumerate(batches()):
            refused += type_in(pico, batch, number, flying)
            count += len(batch)
            case = serial_case([batch], flying)
            if flight:
                frames += flight.check(case)
            else:
                check_still(pico, case)
            pico.board.console.output.clear()
    equal(pico.board.flash_filesystem() == before, True, "the file system is as it was")
    expect("stood still 0 times" in pico.reply_to_enter(), "the main loop stood still")
    expect(not pico.board.resets, "the watchdog has reset the board")
    return count, frames, refused


def serial_case(pieces: Sequence[bytes], flying: bool) -> Case:
    """What was typed as a case that can be saved."""
    return {"kind": "serial", "pieces": [piece.hex() for piece in pieces], "flying": flying}


def replay(case: Case, picos: Picos) -> None:
    """Type a saved case into a started board; raises Wrong."""
    pico = picos.boot(_CONFIGURATION)

    def trial() -> None:
        pico.board.run_for(300e6)
        flight = Flight(pico) if case["flying"] else None
        pieces = [piece for one in again.blocks_of(case) for piece in one["pieces"]]
        for number, piece in enumerate(pieces):
            type_in(pico, bytes.fromhex(piece), number, case["flying"])
            if flight:
                flight.check(case)
            else:
                check_still(pico, case)

    forked(trial)


def fuzz(setting: Setting, flying: bool) -> list[Row]:
    """Bytes on the console, with or without a link."""
    pico = setting.picos.boot(_CONFIGURATION)
    total = setting.effort.serial_bytes // 2
    seed = setting.seed + flying

    def trial() -> tuple[int, int, int]:
        pico.board.run_for(300e6)
        return fuzz_console(pico, seed, total, flying)

    count, frames, refused = forked(trial)
    kinds = serial_streams.WITH_LINK if flying else serial_streams.KINDS
    restart = "`config restart force`" if flying else "`config restart`"
    done = f"{count:,} bytes: {', '.join(kinds)}; without Ctrl-C, Ctrl-D and {restart}"
    happened = (
        "no file changed, no fault of the main loop, which answered after each batch; no reset; "
        f"there are the commands {', '.join(name.decode() for name in _COMMANDS)}, none of which "
        "drives an output, and no bench mode"
    )
    if flying:
        happened = (
            f"each of {frames:,} control frames written to the outputs meanwhile, and nothing "
            f"else; no pulse missing or different; {refused:,} times `the link is up` to a "
            f"restart or a whole new configuration; {happened}"
        )
        return [Row("USB console, link up", done, happened)]
    return [Row("USB console, no link", done, f"no output moved; {happened}")]


def fuzz_reading(setting: Setting) -> list[Row]:
    """Bytes on the console as the unix port runs it: which lines are commands."""
    made = list(serial_streams.everything(setting.seed, setting.effort.console_bytes, _COMMANDS))
    commands = ["", *(name.decode() for name in _COMMANDS)]
    return console_bytes.fuzz(made, commands, ", ".join(serial_streams.WITH_LINK))


def trials(setting: Setting) -> Iterator[tuple[str, Trial]]:
    """The trials, by name."""
    yield "unix port", partial(fuzz_reading, setting)
    yield "no link", partial(fuzz, setting, False)
    yield "link up", partial(fuzz, setting, True)
