"""Frames as text and as JSON: the values are the library's."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import raw_bytes, raw_primaries, streams

from ghst import Receiver, downlink, protocol, telemetry
from ghst_tools.campaign.model import CONTROL_TYPES, control, frame
from ghst_tools.frames import kinds
from ghst_tools.frames.finder import FRAME, Finder, Pieces
from ghst_tools.frames.json_lines import JsonLines
from ghst_tools.frames.lines import LineWriter
from ghst_tools.frames.text import TextLines

thorough = settings(max_examples=150, deadline=None, derandomize=True)


def written(writer: LineWriter, stream: bytes, times_s: list[float] | None = None) -> list[str]:
    """A line for each piece of a whole stream."""
    subject = Finder()
    lines: list[str] = []
    for pieces in (subject.feed(stream), subject.finish()):
        times = times_s[len(lines) : len(lines) + len(pieces.starts)] if times_s else None
        lines += writer.lines(pieces, times)
    return lines


def objects(stream: bytes) -> list[dict[str, Any]]:
    return [json.loads(line) for line in written(JsonLines(), stream)]


def text(frame: str) -> str:
    """The line of one frame, without where it begins."""
    (line,) = written(TextLines(), bytes.fromhex(frame))
    assert line.startswith("byte         0  ")
    return re.sub(" +", " ", line.removeprefix("byte         0  "))


def known(receiver: Receiver) -> list[float | None]:
    return [pulse / 4 if pulse else None for pulse in receiver.pulses]


def check(given: dict[str, Any], octets: bytes, receiver: Receiver) -> None:
    """Compare an object with what a receiver, or the reader of downlink frames, makes of it."""
    before = receiver.frames, receiver.vtx_setups, receiver.msp_frames
    receiver.feed(octets)
    assert given["crc_ok"] is True
    assert (given["addr"], given["type"]) == (octets[0], octets[2])
    assert given["name"] == kinds.name(octets[0], octets[2])
    if receiver.frames > before[0]:
        assert given["channels_us"] == known(receiver)
        fresh = Receiver()
        fresh.feed(octets)
        carried = [number for number, us in enumerate(known(fresh), 1) if us is not None]
        assert given["carries"] == carried
        if "lq_percent" in given:
            assert octets[2] & 0xDF == protocol.TYPE_LINK_DATA
            mode = protocol.RF_MODES.get(receiver.rf_mode)
            assert given["lq_percent"] == receiver.lq
            assert given["rssi_dbm"] == receiver.rssi_dbm
            assert given["rf_mode"] == receiver.rf_mode
            assert given["rf_mode_name"] == (mode[0] if mode else None)
            assert given["telemetry_requested"] == receiver.telemetry_requested
            assert given["alt_scale"] == receiver.alt_scale
            assert given["tx_power_dbm"] == receiver.tx_power_dbm
        else:
            assert octets[2] & 0xDF != protocol.TYPE_LINK_DATA
            assert given.get("payload") == (None if len(carried) == 8 else octets[9:13].hex())
        return
    assert "channels_us" not in given
    if receiver.vtx_setups > before[1]:
        assert given["vtx_freq_mhz"] == receiver.vtx_freq_mhz
        assert given["vtx_power_mw"] == receiver.vtx_power_mw
        assert given["vtx_band_channel"] == receiver.vtx_band_channel
        assert given["vtx_flags"] == receiver.vtx_flags
    elif receiver.msp_frames > before[2]:
        assert given["msp_sequence"] == octets[3] & 15
    else:
        check_downlink(given, octets)


def check_downlink(given: dict[str, Any], octets: bytes) -> None:
    try:
        values = downlink.decode(octets)
    except ValueError:
        assert given["payload"] == octets[3:-1].hex()
        return
    if isinstance(values, downlink.MspResponse):
        assert given["msp_sequence"] == octets[3] & 15
        return
    assert {name: given[name] for name in values._fields} == values._asdict()


@thorough
@given(stream=streams)
def test_streams_have_the_values_of_the_library(stream: bytes) -> None:
    receiver = Receiver()
    for given_ in objects(stream):
        begin = given_["offset_bytes"]
        if given_["crc_ok"]:
            size = stream[begin + 1] + 2
            check(given_, stream[begin : begin + size], receiver)
        else:
            octets = bytes.fromhex(given_["bytes"])
            assert stream[begin : begin + len(octets)] == octets
            assert given_["length_bytes"] == len(octets)


@pytest.mark.parametrize("kind", CONTROL_TYPES, ids=hex)
@settings(max_examples=40, deadline=None, derandomize=True)
@given(primaries=raw_primaries, tail=raw_bytes)
def test_every_control_type(kind: int, primaries: tuple[int, ...], tail: tuple[int, ...]) -> None:
    octets = control(kind, primaries, tail)
    check(objects(octets)[0], octets, Receiver())


@thorough
@given(
    kind=st.sampled_from((0x23, 0x25, 0x26, 0x27, 0x28)),
    payload=st.binary(min_size=10, max_size=10),
)
def test_every_downlink_type(kind: int, payload: bytes) -> None:
    octets = frame(protocol.ADDRESS_RX, kind, payload)
    check_downlink(objects(octets)[0], octets)


@pytest.mark.parametrize(
    ("frame", "line"),
    [
        (
            "820c105881e2c007ae167ce2aef7",
            "up 0x10 channels 5-8 CRC ok 1-4 987.50 2012.50 1500.00 1750.00 us "
            "5-8 990 1500 2010 1750 us",
        ),
        (
            "820c323000fd00088003fd808068",
            "up 0x32 channels 13-16, 12-bit CRC ok 1-4 1000.00 2000.00 1500.00 1500.00 us "
            "13-16 1000 2000 1500 1500 us",
        ),
        (
            "820c33000880000080634b6a1ba1",
            "up 0x33 link data, 12-bit CRC ok 1-4 1500.00 1500.00 988.00 1500.00 us "
            "LQ 99 %, RSSI -75 dBm, Race250, telemetry requested, new scaling, +27 dBm",
        ),
        (
            "820c14c0077c58017c000000001c",
            "up 0x14 VTX control CRC ok 1-4 1500.00 1500.00 987.50 1500.00 us 00 00 00 00",
        ),
        (
            "800c2000a8161900480000000006",
            "up 0x20 VTX setup CRC ok to 0x80: 5800 MHz, 25 mW, band and channel 0x48, flags 0x00",
        ),
        (
            "820c213000010100000000000078",
            "up 0x21 MSP request CRC ok sequence 0, MSP v1, command 1 api_version, 0 bytes: "
            "01 00 00 00 00 00 00",
        ),
        (
            "890c239006900b7b000000000069",
            "down 0x23 pack status CRC ok 16.80 V, 29.60 A, 1230 mAh, armed",
        ),
        (
            "890c258e0b3a1ca319ecfa98019b",
            "down 0x25 GPS primary CRC ok 47.3566094 -8.5190237 deg, 408 m",
        ),
        (
            "890c26d204910a117b000d070361",
            "down 0x26 GPS secondary CRC ok 12.34 m/s, course 270.5 deg, 17 satellites, fix, "
            "home 1230 m at 180.5 deg",
        ),
        (
            "890c2777fcf4ffceff0000000761",
            "down 0x27 mag baro CRC ok heading -90.5 deg, altitude -12 m, vario -0.50 m/s",
        ),
        (
            "890c283007010102030000000056",
            "down 0x28 MSP response CRC ok sequence 0, MSP v1, command 1 api_version, 7 bytes: "
            "01 02 03",
        ),
        (
            "820c10d8277e5c87747c7c1b1beb",
            "up 0x10 channels 5-8 CRC BAD 82 0c 10 d8 27 7e 5c 87 74 7c 7c 1b 1b eb",
        ),
        ("0102", "- garbage 2 bytes 01 02"),
        ("01" * 17, f"- garbage 17 bytes {'01 ' * 16}..."),
        ("820c10", "- unfinished 3 bytes 82 0c 10"),
    ],
)
def test_lines_of_text(frame: str, line: str) -> None:
    assert text(frame) == line


def test_frames_that_nobody_has_defined() -> None:
    assert text(frame(0x82, 0x40, b"\x01\x02").hex()) == "up 0x40 unknown CRC ok 01 02"
    short = frame(0x82, 0x10, b"\x01\x02").hex()
    assert text(short) == "up 0x10 channels 5-8 CRC ok length 4 instead of 12: 01 02"
    to_goggles = frame(0x83, 0x13, bytes(10)).hex()
    assert text(to_goggles) == "up 0x13 unknown CRC ok to 0x83: 00 00 00 00 00 00 00 00 00 00"
    reserved = control(0x35, (2048,) * 4, (1, 2, 3, 4)).hex()
    assert text(reserved) == (
        "up 0x35 channels 1-4, 12-bit CRC ok 1-4 1500.00 1500.00 1500.00 1500.00 us 01 02 03 04"
    )


def test_what_is_not_valid_in_telemetry_is_not_shown() -> None:
    octets = bytearray(14)
    telemetry.mag_baro(octets, None, -3, None)
    assert text(octets.hex()) == ("down 0x27 mag baro CRC ok heading -, altitude -3 m, vario -")
    assert objects(bytes(octets))[0]["heading_decideg"] is None
    telemetry.pack_status(octets, 0, 0, 0, False)
    assert text(octets.hex()).endswith("0.00 V, 0.00 A, 0 mAh, disarmed")
    telemetry.gps_secondary(octets, 0, 0, 0, 0, 0, False, False)
    assert text(octets.hex()).endswith("0.00 m/s, course 0.0 deg, 0 satellites, no fix, no home")


def test_headers_of_msp_messages() -> None:
    def message(payload: str) -> dict[str, Any]:
        octets = frame(0x82, 0x21, bytes.fromhex(payload))
        return {
            name.removeprefix("msp_"): value
            for name, value in objects(octets)[0].items()
            if name.startswith("msp_")
        }

    assert message("50 00 5900 0400 01020304") == {
        "sequence": 0,
        "start": True,
        "version": 2,
        "error": False,
        "command": 89,
        "command_name": "set_vtx_config",
        "size_bytes": 4,
        "data": "01020304",
    }
    jumbo = message("30 ff 59 0102 0102030405")
    assert (jumbo["size_bytes"], jumbo["data"]) == (0x0201, "0102030405")
    assert message("a5 010203040506070809") == {
        "sequence": 5,
        "start": False,
        "version": 1,
        "error": True,
        "data": "010203040506070809",
    }
    assert message("70 010203040506070809")["version"] is None


def test_times_are_shown_in_seconds() -> None:
    octets = control(0x11, (1984,) * 4, (124,) * 4)
    lines = written(TextLines(), octets * 2, [0.0125, 3601.000001])
    assert [line[:16] for line in lines] == ["    0.012500 s  ", " 3601.000001 s  "]
    (line,) = written(JsonLines(), octets, [0.0125])
    assert json.loads(line)["t"] == 0.0125


def test_an_object_begins_with_what_all_have_in_common() -> None:
    names = ["t", "offset_bytes", "addr", "type", "name", "crc_ok"]
    for given_ in objects(b"\x01" + control(0x11, (1984,) * 4, (124,) * 4) + b"\x82\x0c\x10"):
        assert list(given_)[:6] == names


def test_pieces_of_a_line_writer_are_counted() -> None:
    subject = Finder()
    pieces: Pieces = subject.feed(control(0x13, (0,) * 4, (0,) * 4))
    assert pieces.verdicts.tolist() == [FRAME]
    with pytest.raises(ValueError):
        TextLines().lines(pieces, [])
