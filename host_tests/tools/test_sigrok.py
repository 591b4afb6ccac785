"""The decoder for PulseView and sigrok-cli: its facts, and the real sigrok-cli with it."""

from __future__ import annotations

import ast
import importlib.util
import os
import shutil
import subprocess
from pathlib import Path
from types import ModuleType

import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import BEGUN, BYTE_S
from strategies import any_frames, raw_bytes, raw_primaries

from ghst import Receiver, protocol
from ghst_tools import boards
from ghst_tools.campaign.model import CONTROL_TYPES, control, crc
from ghst_tools.cli import ghst
from ghst_tools.frames import kinds, text
from ghst_tools.frames.log import header, line

FOLDER = boards.checkout() / "tools" / "sigrok" / "ghst"
needs_sigrok = pytest.mark.skipif(
    shutil.which("sigrok-cli") is None, reason="sigrok-cli is not installed"
)
thorough = settings(max_examples=300, deadline=None, derandomize=True)


def _load() -> ModuleType:
    spec = importlib.util.spec_from_file_location("sigrok_fields", FOLDER / "fields.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


fields = _load()


def test_the_facts_are_those_of_the_library() -> None:
    assert {number: mode[0] for number, mode in protocol.RF_MODES.items()} == fields.RF_MODES
    assert (fields.FC, fields.RX) == (protocol.ADDRESS_FC, protocol.ADDRESS_RX)
    assert (fields.WHOLE, fields.LENGTHS[-1]) == (protocol.FRAME_LENGTH,) * 2
    assert (fields.ADDRESSES[0], fields.ADDRESSES[-1]) == (
        protocol.ADDRESS_RADIO,
        protocol.ADDRESS_RX,
    )
    for address in range(0x80, 0x8A):
        for kind in range(256):
            assert fields.title(address, kind) == kinds.title(kinds.name(address, kind))


@thorough
@given(data=st.binary(max_size=20))
def test_the_crc(data: bytes) -> None:
    assert fields.crc8(data) == crc(data)


@pytest.mark.parametrize("kind", CONTROL_TYPES, ids=hex)
@settings(max_examples=40, deadline=None, derandomize=True)
@given(primaries=raw_primaries, tail=raw_bytes)
def test_the_channels(kind: int, primaries: tuple[int, ...], tail: tuple[int, ...]) -> None:
    frame = control(kind, primaries, tail)
    receiver = Receiver()
    receiver.feed(frame)
    wanted = [
        f"ch{number} {pulse / 4:.2f} us"
        for number, pulse in enumerate(receiver.pulses, 1)
        if pulse
    ]
    shown = [texts[0] for _, _, what, texts in fields.describe(frame) if what == fields.CHANNEL]
    assert shown == wanted
    assert fields.is_control(frame)
    if kind & 0xDF == 0x13:
        told = [texts[0] for _, _, _, texts in fields.describe(frame)[7:-1]]
        line_ = text.TextLines().frame(None, 0, frame).split(" us  ")[1]
        assert ", ".join(told).replace(" ", "") == line_.replace(" ", "")


@thorough
@given(frame=any_frames)
def test_fields_are_in_order_and_inside_the_frame(frame: bytes) -> None:
    at = 0
    for bit, size, what, texts in fields.describe(frame):
        assert bit >= at and size > 0 and texts and what in (fields.FIELD, fields.CHANNEL)
        at = bit + size
    assert at == 8 * len(frame)
    assert fields.is_control(frame) == (Receiver().feed(frame) == 1)


def test_telemetry_in_plain_units() -> None:
    def told(frame: str) -> list[str]:
        return [texts[0] for _, _, _, texts in fields.describe(bytes.fromhex(frame))[3:-1]]

    assert told("890c239006900b7b000000000069") == [
        "16.80 V",
        "29.60 A",
        "1230 mAh",
        "receiver 0.0 V",
        "armed",
    ]
    assert told("890c258e0b3a1ca319ecfa98019b") == [
        "latitude 47.3566094 deg",
        "longitude -8.5190237 deg",
        "altitude 408 m",
    ]
    assert told("890c26d204910a117b000d070361") == [
        "12.34 m/s",
        "course 270.5 deg",
        "17 satellites",
        "home 1230 m",
        "home at 180.5 deg",
        "fix, home fix",
    ]
    assert told("890c2777fcf4ffceff0000000761") == [
        "heading -90.5 deg",
        "altitude -12 m",
        "vario -0.50 m/s",
        "valid 0x07",
    ]
    assert told("890c283007010102030000000056") == [
        "sequence 0, start, MSP v1",
        "7 bytes",
        "command 1",
        "0x01",
        "0x02",
        "0x03",
    ]
    assert told("800c2000a8161900480000000006") == [
        "flags 0x00",
        "5800 MHz",
        "25 mW",
        "band and channel 0x48",
    ]


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.name)
def test_pulseview_s_old_python_can_read_it(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="ascii"), feature_version=(3, 4))
    for node in ast.walk(tree):
        assert not isinstance(node, ast.JoinedStr | ast.AnnAssign | ast.NamedExpr)
        if isinstance(node, ast.List | ast.Tuple | ast.Call):
            items = node.args if isinstance(node, ast.Call) else node.elts
            assert not any(isinstance(item, ast.Starred) for item in items)


def annotations(vcd: Path, home: Path, *classes: str) -> list[str]:
    """What sigrok-cli prints: begin and end in samples of 100 ns, and the text."""
    made = subprocess.run(
        ["make", "-s", "-C", str(boards.checkout()), "sigrok"],
        env={**os.environ, "XDG_DATA_HOME": str(home)},
        capture_output=True,
        text=True,
    )
    assert made.stdout == f"{home}/libsigrokdecode/decoders/ghst\n", made.stderr
    done = subprocess.run(
        [
            "sigrok-cli",
            *("-I", "vcd", "-i", str(vcd), "--protocol-decoder-samplenum"),
            *("-P", "uart:rx=wire:baudrate=420000,ghst"),
            *("-A", "=".join(["ghst", ":".join(classes)]) if classes else "ghst"),
        ],
        env={**os.environ, "XDG_DATA_HOME": str(home)},
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return [found.replace("ghst-1: ", "") for found in done.stdout.splitlines()]


CHANNELS = bytes.fromhex("820c3000f0ff0008400080ff4069")
LINK_DATA = bytes.fromhex("820c13c0077c58017c256528f87b")
PACK = bytes.fromhex("890c239006900b7b000000000069")


def recorded(tmp_path: Path, *bursts: tuple[float, bytes]) -> Path:
    """A VCD file made by `ghst vcd` of bursts that begin at times in milliseconds."""
    log, vcd = tmp_path / "wire.log", tmp_path / "wire.vcd"
    lines = [line(ms / 1e3 + len(data) * BYTE_S, data) for ms, data in bursts]
    log.write_text(header("port", BEGUN) + "".join(lines))
    result = CliRunner().invoke(ghst, ["vcd", str(log), "-o", str(vcd)])
    assert result.exit_code == 0, result.output
    return vcd


@needs_sigrok
def test_sigrok_cli_on_a_recording(tmp_path: Path) -> None:
    damaged = CHANNELS[:6] + b"\xff" + CHANNELS[7:]
    vcd = recorded(
        tmp_path,
        (1.0, CHANNELS),
        (1.0 + 14 * BYTE_S * 1e3 + 1.0, PACK),
        (5.0, b"\x55" + damaged + b"\x56"),
        (10.0, LINK_DATA),
        # Breaks off, and does not take the next frame with it.
        (15.0, PACK[:6]),
        (20.0, PACK),
    )
    found = annotations(vcd, tmp_path)
    # A sample is 100 ns; the first burst begins at sample 1000.
    assert [one for one in found if int(one.split("-")[0]) < 18000] == [
        "1000-4333 receiver to flight controller",
        "1000-4333 channels 5-8, 12-bit",
        "1025-1213 to the flight controller",
        "1263-1451 length 12",
        "1501-1689 type 0x30 channels 5-8, 12-bit",
        "1739-2070 ch1 988.00 us",
        "2072-2403 ch2 2011.75 us",
        "2454-2785 ch3 1500.00 us",
        "2787-3118 ch4 1244.00 us",
        "3168-3356 ch5 988.00 us",
        "3406-3594 ch6 1500.00 us",
        "3644-3832 ch7 2008.00 us",
        "3882-4070 ch8 1244.00 us",
        "4120-4308 CRC 0x69",
        "14340-17673 flight controller to receiver",
        "14340-17673 pack status",
        "14365-14553 to the receiver",
        "14603-14791 length 12",
        "14841-15029 type 0x23 pack status",
        "15079-15505 16.80 V",
        "15555-15982 29.60 A",
        "16032-16458 1230 mAh",
        "16508-16696 receiver 0.0 V",
        "16746-16934 armed",
        "17460-17648 CRC 0x69",
        "4333-14340 slot 1000.7 us",
    ]
    assert annotations(vcd, tmp_path, "crc-error", "garbage", "no-stop-bit") == [
        "41004-41242 no frame, 1 byte: 55",
        "41242-44575 CRC error: 0x69, must be 0x24",
        "44575-44813 no frame, 1 byte: 56",
        "141005-142433 no frame, 6 bytes: 89 0c 23 90 06 90",
    ]
    assert annotations(vcd, tmp_path, "frame", "uplink", "downlink", "slot")[5:] == [
        "41242-44575 receiver to flight controller",
        "41242-44575 channels 5-8, 12-bit, damaged",
        "91000-94333 receiver to flight controller",
        "91000-94333 link data",
        "191000-194333 flight controller to receiver",
        "191000-194333 pack status",
    ]
    assert annotations(vcd, tmp_path, "channel")[-4:] == [
        "91739-92070 ch1 1500.00 us",
        "92072-92403 ch2 1500.00 us",
        "92454-92785 ch3 987.50 us",
        "92787-93118 ch4 1500.00 us",
    ]


@needs_sigrok
def test_a_byte_without_a_stop_bit(tmp_path: Path) -> None:
    # A byte of a slower line: 0x00 at a third of the rate holds the wire through the stop bit.
    vcd = tmp_path / "break.vcd"
    edges = ["#0", "1!", "#1000", "0!", "#1700", "1!", "#9000"]
    head = ["$timescale 100 ns $end", "$scope module x $end", "$var wire 1 ! wire $end"]
    vcd.write_text("\n".join([*head, "$upscope $end", "$enddefinitions $end", *edges, ""]))
    assert annotations(vcd, tmp_path) == ["1000-1238 no stop bit"]
