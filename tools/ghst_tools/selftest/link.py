"""The checks of the wire: nothing moves before a frame and for bad ones, each type is decoded."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ghst import Receiver, encode  # type: ignore[import-not-found]
from ghst_tools.selftest import transmissions
from ghst_tools.selftest.context import Context, link_frame
from ghst_tools.selftest.result import Result, judged
from ghst_tools.selftest.session import ask

_QUIET_MS = 100
_BAD = 5
_BROKEN_BYTE = 6
_COUNTED = ("frames", "crc_errors", "length_errors", "unknown_frames", "foreign_frames")
_ALSO = ("msp_frames", "vtx_setups")
_STATE = ("lq", "rssi_dbm", "rf_mode")
_LEGACY = range(0x10, 0x20)
_PRIMARIES = (344, 3624, 1984, 2784)
_AUXILIARIES = (22, 124, 226, 174)


def bad_transmissions() -> dict[str, list[str]]:
    """What has to be counted and move nothing; all of it for other sticks than any good frame."""
    frame = bytes(encode.channels(0x10, (3000, 700, 3100, 600), (200, 60, 190, 70)))
    wrong = frame[:-1] + bytes((frame[-1] ^ 0x55,))
    return {
        "wrong CRC": [transmissions.of_frame(wrong)] * _BAD,
        "broken stop bit": [transmissions.of_frame(frame, _BROKEN_BYTE)] * _BAD,
        "noise": [transmissions.of_noise(seed) for seed in range(_BAD)],
    }


def before_frames(context: Context) -> Iterator[Result]:
    """No pulses from the start on, nor for anything that is no frame."""
    rose = ask(context.session, f"bench.wait({_QUIET_MS})")
    yield judged(
        "no pulses before a frame",
        "no edge at any servo pin",
        context.edges(rose),
        not rose,
        "a servo pin moved by itself, or is tied to something that does",
    )
    for what, sent in bad_transmissions().items():
        yield _bad(context, what, sent)


def _bad(context: Context, what: str, sent: list[str]) -> Result:
    before = ask(context.session, "bench.counters()")
    ask(context.session, "bench.rose()")
    after = ask(context.session, f"bench.play({sent})")
    rose = ask(context.session, f"bench.wait({_QUIET_MS // 2})")
    keys = ("crc_errors", "length_errors", "skipped_bytes")
    counted = {key: after[key] - before[key] for key in keys}
    frames = after["frames"] - before["frames"]
    moved = rose or frames or after["link"] != before["link"]
    enough = counted["crc_errors"] == _BAD if what == "wrong CRC" else any(counted.values())
    measured = (
        f"{counted['crc_errors']} CRC errors, {counted['length_errors']} length errors, "
        f"{counted['skipped_bytes']} bytes skipped; {frames} frames, {context.edges(rose)}"
    )
    expected = f"{_BAD} CRC errors" if what == "wrong CRC" else "counted"
    return judged(what, f"{expected}; nothing moves", measured, not moved and enough)


def types(context: Context) -> Iterator[Result]:
    """Frames of all types, decoded as the library on this computer does."""
    groups = {
        "legacy frames": [_control(kind) for kind in _LEGACY],
        "12-bit frames": [_control(kind | 0x20) for kind in _LEGACY],
        "VTX and MSP frames": [
            bytes(encode.vtx_setup(0, 5800, 25, 0x48)),
            bytes(encode.vtx_setup(0, 5800, 25, 0x48, address=0x83)),
            bytes(encode.msp(0x21, bytes((0x30, 0, 1, 0, 0, 0, 0, 0, 0, 0)))),
        ],
    }
    for name, frames in groups.items():
        yield _decoded(context, name, frames)


def _control(kind: int) -> bytes:
    if kind & 0xDF == 0x13:
        return bytes(encode.link_data(kind, _PRIMARIES, lq=93, rssi_dbm=-71, rf_mode=6))
    return bytes(encode.channels(kind, _PRIMARIES, _AUXILIARIES))


def _decoded(context: Context, name: str, frames: list[bytes]) -> Result:
    receiver = Receiver()
    # Both begin with the same state: that of before is not the same in each run.
    first = link_frame()
    before = ask(context.session, f"bench.play({[transmissions.of_frame(first)] * 2})")
    receiver.feed(first)
    before_here = {key: getattr(receiver, key) for key in _COUNTED + _ALSO}
    sent = [transmissions.of_frame(frame) for frame in frames]
    after = ask(context.session, f"bench.play({sent})")
    for frame in frames:
        receiver.feed(frame)
    here = {key: getattr(receiver, key) - before_here[key] for key in _COUNTED + _ALSO}
    there = {key: after[key] - before[key] for key in _COUNTED + _ALSO}
    wrong = [key for key in here if here[key] != there[key]]
    wrong += [key for key in _STATE if getattr(receiver, key) != after[key]]
    # Channels that these frames do not carry are from other checks.
    channels = [
        number
        for number, (mine, theirs) in enumerate(zip(receiver.pulses, after["pulses"], strict=True))
        if mine and mine != theirs
    ]
    kinds = sorted({frame[2] for frame in frames})
    span = f"types 0x{kinds[0]:02x} to 0x{kinds[-1]:02x}"
    return judged(
        name,
        f"{len(frames)} decoded, {span}",
        _measured(there, wrong, channels),
        not wrong and not channels,
        f"bits are lost on the way: look at the jumper {context.name(context.wire_pin)} - "
        f"{context.name(context.pin)}, and take anything else off these pins",
    )


def _measured(there: dict[str, Any], wrong: list[str], channels: list[int]) -> str:
    decoded = there["frames"] + there["msp_frames"] + there["vtx_setups"]
    text = f"{decoded} decoded, {there['crc_errors']} CRC errors"
    if wrong:
        text += f", different: {', '.join(wrong)}"
    if channels:
        text += f", wrong channels: {', '.join(str(channel + 1) for channel in channels)}"
    return text
