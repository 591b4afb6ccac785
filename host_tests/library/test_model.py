"""The library against an independent model, on random frames and streams."""

import pytest
from behaviour.support import unfinished
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import any_frames, chunked, frames, raw_bytes, raw_primaries, streams

from ghst import Receiver, crc8
from ghst_tools.campaign.model import CONTROL_TYPES, Model, control, crc, differences, frame

thorough = settings(max_examples=250, deadline=None, derandomize=True)
each_type = settings(max_examples=60, deadline=None, derandomize=True)


def compare(chunks: list[bytes]) -> None:
    receiver, model = Receiver(), Model()
    count = 0
    for chunk in chunks:
        assert receiver.feed(chunk) == model.feed(chunk)
        count += len(chunk)
        assert differences(model, receiver) == []
        assert unfinished(receiver) == len(model.pending)
        assert count == model.frame_bytes + receiver.skipped_bytes + unfinished(receiver)


def test_the_model_s_crc_is_dvb_s2() -> None:
    assert crc(b"123456789") == 0xBC
    assert crc(bytes.fromhex("11d8277e5c87747d7c7c7c")) == 0xCD


def test_the_model_builds_the_sample_frames() -> None:
    legacy = control(0x10, (344, 3624, 1984, 2784), (22, 124, 226, 174))
    assert legacy.hex() == "820c105881e2c007ae167ce2aef7"
    vtx = frame(0x80, 0x20, bytes.fromhex("00a81619004800000000"))
    assert vtx.hex() == "800c2000a8161900480000000006"


@thorough
@given(data=st.binary(max_size=300), start=st.integers(0, 300), stop=st.integers(0, 300))
def test_crc_of_any_bytes(data: bytes, start: int, stop: int) -> None:
    start, stop = sorted((min(start, len(data)), min(stop, len(data))))
    assert crc8(data, start, stop) == crc(data[start:stop])


@pytest.mark.parametrize("kind", CONTROL_TYPES, ids=hex)
@each_type
@given(primaries=raw_primaries, tail=raw_bytes)
def test_every_control_type(kind: int, primaries: tuple[int, ...], tail: tuple[int, ...]) -> None:
    receiver, model = Receiver(), Model()
    data = control(kind, primaries, tail)
    assert receiver.feed(data) == model.feed(data) == 1
    assert differences(model, receiver) == []


@thorough
@given(data=any_frames)
def test_any_other_frame(data: bytes) -> None:
    compare([data])


@thorough
@given(chunks=chunked())
def test_streams_in_chunks(chunks: list[bytes]) -> None:
    compare(chunks)


@thorough
@given(stream=streams)
def test_streams_byte_by_byte(stream: bytes) -> None:
    compare([bytes([byte]) for byte in stream])


@thorough
@given(chunks=chunked(), after=st.lists(frames, max_size=4))
def test_discarding_what_is_unfinished(chunks: list[bytes], after: list[bytes]) -> None:
    receiver, model = Receiver(), Model()
    for chunk in chunks:
        receiver.feed(chunk)
        model.feed(chunk)
    lost = unfinished(receiver)
    before = receiver.skipped_bytes
    receiver.discard_partial()
    assert unfinished(receiver) == 0
    assert receiver.skipped_bytes == before + lost
    model.discard_partial()
    for data in after:
        assert receiver.feed(data) == model.feed(data)
        assert differences(model, receiver) == []
