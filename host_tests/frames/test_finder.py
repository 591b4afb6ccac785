"""Cutting a stream into pieces: what the library's decoder finds, nothing lost, nothing twice."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import chunked, streams

from ghst import Receiver
from ghst_tools.campaign.model import frame
from ghst_tools.frames import finder
from ghst_tools.frames.finder import DAMAGED, FRAME, GARBAGE, UNFINISHED, Finder

thorough = settings(max_examples=250, deadline=None, derandomize=True)

Piece = tuple[int, bytes, int]

CHANNELS = bytes.fromhex("820c10d8277e5c87747c7c1b1bea")
PACK = bytes.fromhex("890c239006900b7b000000000069")


def cut(*chunks: bytes) -> list[Piece]:
    """Where each piece begins, its bytes and its verdict; compares the counters on the way."""
    found: list[Piece] = []
    receiver, subject = Receiver(), Finder()
    for chunk in chunks:
        receiver.feed(chunk)
        found += pieces(subject.feed(chunk))
        for name, count in subject.counters.lines():
            assert count == getattr(receiver, name), name
    return found + pieces(subject.finish())


def pieces(given: finder.Pieces) -> list[Piece]:
    limits = zip(given.starts.tolist(), given.stops.tolist(), given.verdicts.tolist(), strict=True)
    return [(given.offset + start, given.data[start:stop], what) for start, stop, what in limits]


def verdicts(*chunks: bytes) -> list[tuple[int, int]]:
    """Length and verdict of each piece."""
    return [(len(octets), what) for _, octets, what in cut(*chunks)]


@thorough
@given(chunks=chunked())
def test_the_counters_are_the_library_s_and_every_byte_is_in_one_piece(
    chunks: list[bytes],
) -> None:
    at = 0
    for offset, octets, _ in cut(*chunks):
        assert offset == at
        assert octets
        at += len(octets)
    assert at == sum(map(len, chunks))


@thorough
@given(stream=streams, cuts=st.lists(st.integers(0, 400), max_size=20), longest=st.integers(1, 40))
def test_pieces_do_not_depend_on_the_chunks(stream: bytes, cuts: list[int], longest: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(finder, "LONGEST_GARBAGE", longest)
        edges = sorted((0, *(min(cut_, len(stream)) for cut_ in cuts), len(stream)))
        chunks = [stream[start:stop] for start, stop in pairwise(edges)]
        assert cut(*chunks) == cut(stream) == cut(*(bytes([octet]) for octet in stream))


@thorough
@given(stream=streams)
def test_frames_and_only_frames_are_taken_by_a_receiver(stream: bytes) -> None:
    for _, octets, what in cut(stream):
        receiver = Receiver()
        receiver.feed(octets)
        taken = len(octets) - receiver.skipped_bytes
        if what == FRAME:
            assert taken == len(octets) and receiver.skipped_bytes == 0
        if what == DAMAGED:
            assert receiver.crc_errors >= 1 and octets[1] + 2 == len(octets)


def test_frames_between_garbage() -> None:
    stream = b"\x00\x01" + CHANNELS + b"\xff" + PACK + PACK + b"\x82"
    assert cut(stream) == [
        (0, b"\x00\x01", GARBAGE),
        (2, CHANNELS, FRAME),
        (16, b"\xff", GARBAGE),
        (17, PACK, FRAME),
        (31, PACK, FRAME),
        (45, b"\x82", UNFINISHED),
    ]


def test_a_damaged_frame_is_a_piece_of_its_own() -> None:
    wrong = CHANNELS[:-1] + b"\x00"
    assert verdicts(wrong) == [(14, DAMAGED)]
    assert verdicts(wrong + CHANNELS) == [(14, DAMAGED), (14, FRAME)]
    assert verdicts(b"\x07" + wrong + b"\x07" + PACK) == [
        (1, GARBAGE),
        (14, DAMAGED),
        (1, GARBAGE),
        (14, FRAME),
    ]


def test_a_frame_that_lost_a_byte_takes_nothing_of_the_next_one() -> None:
    short = CHANNELS[:6] + CHANNELS[7:]
    assert verdicts(short + CHANNELS) == [(13, GARBAGE), (14, FRAME)]


def test_a_frame_inside_what_began_as_another_is_found() -> None:
    inner = frame(0x82, 0x10, b"")
    assert verdicts(b"\x82\x0c\x13" + inner + bytes(10)) == [
        (3, GARBAGE),
        (4, FRAME),
        (10, GARBAGE),
    ]


def test_the_beginning_of_a_frame_waits_and_garbage_at_the_end_does_not() -> None:
    assert verdicts(CHANNELS + PACK[:13]) == [(14, FRAME), (13, UNFINISHED)]
    assert verdicts(b"\x01\x02\x03") == [(3, GARBAGE)]
    assert verdicts(b"") == []


def test_garbage_is_reported_before_it_ends() -> None:
    subject = Finder()
    given_ = subject.feed(bytes(2 * finder.LONGEST_GARBAGE + 100))
    assert [len(octets) for _, octets, _ in pieces(given_)] == [finder.LONGEST_GARBAGE] * 2
    assert [len(octets) for _, octets, _ in pieces(subject.finish())] == [100]
