"""RAM that the running firmware keeps, and its start with the link up: both of its forms.

As a user has it: without a configuration, nothing connected. One board of each form is powered on
with a receiver that sends all the time; the frozen one has nothing in its file system but the
meter of the RAM.
"""

import ast
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest
from rig import FAILSAFE_NS, PERIOD_NS, SERVOS, Pico, steps

import ghst
from forked import forked
from ghst_tools import boards, device_files, filesystem, frozen, kept_memory
from ghst_tools.emulator import GhostReceiver

FORMS = (".mpy", "frozen")
KEPT = {".mpy": 40 * 1024, "frozen": 16 * 1024}
FIRST_PULSE_NS = {".mpy": 0.6e9, "frozen": 0.6e9}
RATE_HZ = 250
FRAMES = (
    ghst.encode.channels(0x30, (48, 4048, 1048, 3048), (3, 253, 64, 192)),
    ghst.encode.link_data(0x33, (48, 4048, 1048, 3048), lq=97, rssi_dbm=-71, rf_mode=10),
)


class Flown(NamedTuple):
    """A board that has flown for a second and more, and what its application keeps."""

    pico: Pico
    receiver: GhostReceiver
    kept: int


@pytest.fixture(scope="module")
def flown(micropython_image: Path, firmware_files: dict[str, bytes]) -> Callable[[str], Flown]:
    """One board of each form."""
    made: dict[str, Flown] = {}
    board = boards.load("rpi_pico")

    def fly(form: str) -> Flown:
        if form not in made:
            image, files = micropython_image, firmware_files
            if form == "frozen":
                # Of this tree: nothing is compiled anew behind `make test`.
                image, files = frozen.build(report=lambda line: None), {}
            pico = Pico(image, files, board.filesystem_size)
            receiver = pico.power_on(
                kept_memory.meter(board), lambda index, t: FRAMES[index % 2], RATE_HZ
            )
            made[form] = Flown(pico, receiver, kept_memory.kept(pico.board))
        return made[form]

    return fly


@pytest.mark.parametrize("form", FORMS)
def test_the_ram_that_is_kept(
    flown: Callable[[str], Flown], form: str, record_property: Callable[[str, object], None]
) -> None:
    kept = flown(form).kept
    record_property("figure", f"RAM kept, {form}: {kept} bytes of {KEPT[form]}")
    assert kept <= KEPT[form]


@pytest.mark.parametrize("form", FORMS)
def test_the_time_to_the_first_pulse(
    flown: Callable[[str], Flown], form: str, record_property: Callable[[str, object], None]
) -> None:
    pico = flown(form).pico
    first = max(pico.meter.pulses[pin][0].rise_ns for pin in SERVOS)
    record_property("figure", f"power-on to pulses, {form}: {first / 1e6:.1f} ms")
    assert 0.05e9 < first <= FIRST_PULSE_NS[form]


@pytest.mark.parametrize("form", FORMS)
def test_the_pulses_are_exact_and_on_time(flown: Callable[[str], Flown], form: str) -> None:
    pico, receiver, _ = flown(form)
    library = ghst.Receiver()
    for frame in FRAMES:
        library.feed(frame)
    for pin, channel in SERVOS.items():
        # No other since power-on.
        widths = {pulse.width_ns for pulse in pico.meter.pulses[pin]}
        wanted = 312.5 * steps(min(max(library.pulses[channel - 1], 3200), 8800))
        assert all(abs(width - wanted) <= 8 for width in widths) and widths
    started = pico.compares[-1].t_ns - 500e6
    latencies = [
        latency
        for latency, (end_ns, _) in zip(pico.latencies_us(receiver), receiver.sent, strict=True)
        if started < end_ns < pico.board.now_ns - 1e6
    ]
    assert len(latencies) > 100
    assert None not in latencies
    assert max(latency or 0 for latency in latencies) <= 35.0


@pytest.mark.parametrize("form", FORMS)
@forked
def test_failsafe(flown: Callable[[str], Flown], form: str) -> None:
    pico, receiver, _ = flown(form)
    receiver.stop()
    end_ns = receiver.sent[-1].end_ns
    pico.board.run_for(600e6)
    for pin in SERVOS:
        last = pico.meter.pulses[pin][-1].rise_ns
        # Up to a tick, and a pulse that has begun is finished.
        assert end_ns + FAILSAFE_NS - PERIOD_NS < last < end_ns + FAILSAFE_NS + 10e6 + PERIOD_NS
    assert b"link: failsafe" in pico.board.console.output


@forked
def test_the_frozen_firmware_leaves_the_files_to_the_user(
    flown: Callable[[str], Flown],
) -> None:
    pico, receiver, _ = flown("frozen")
    board = boards.load("rpi_pico")
    meter = kept_memory.meter(board)
    assert filesystem.read(pico.board.flash_filesystem()) == meter
    # A configuration of the user counts at the next start.
    receiver.stop()
    text = b'{"outputs": {"6": {"channel": 2, "reverse": true}}, "battery": {"enabled": false}}'
    again = Pico(frozen.build(report=lambda line: None), {}, board.filesystem_size)
    again.power_on({"/ghst.json": text}, lambda index, t: FRAMES[0], RATE_HZ)
    again.board.run_until(lambda: b"link: linked" in again.board.console.output, 3e9)
    assert b"sensors: barometer, gps, magnetometer\r\n" in again.board.console.output
    again.board.run_for(60e6)
    pulse = ghst.Receiver()
    pulse.feed(FRAMES[0])
    width = again.meter.pulses[6][-1].width_ns
    assert abs(width - 312.5 * steps(12000 - pulse.pulses[1])) <= 313


def test_what_the_start_forgets_is_there() -> None:
    """A name that was changed would stay in the RAM, and nobody would see it."""
    root = boards.checkout()
    tree = ast.parse((root / "firmware/equip.py").read_text())
    table = next(
        ast.literal_eval(statement.value)
        for statement in tree.body
        if isinstance(statement, ast.Assign)
        and isinstance(statement.targets[0], ast.Name)
        and statement.targets[0].id == "_START_ONLY"
    )
    sources = device_files.sources(root)
    for module, names, owner, members in table:
        body = ast.parse(sources[module.replace(".", "/") + ".py"].read_text()).body
        found = {name for statement in body for name in _bound(statement)}
        assert set(names.split()) <= found, module
        for statement in body:
            if isinstance(statement, ast.ClassDef) and statement.name == owner:
                assert set(members.split()) <= {
                    each.name for each in statement.body if isinstance(each, ast.FunctionDef)
                }
                break
        else:
            assert owner is None


def _bound(statement: object) -> list[str]:
    match statement:
        case ast.Import(names=names) | ast.ImportFrom(names=names):
            return [alias.asname or alias.name for alias in names]
        case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
            return [name]
        case ast.Assign(targets=[ast.Name(id=name)]):
            return [name]
    return []
