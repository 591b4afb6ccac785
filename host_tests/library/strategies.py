"""Hypothesis strategies: frames of every kind, what noise makes of them, and chunks."""

from itertools import pairwise

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from ghst_tools.campaign.model import CONTROL_TYPES, FC, control, frame

ADDRESSES = range(0x80, 0x8A)

raw_primaries = st.tuples(*[st.integers(0, 4095)] * 4)
raw_bytes = st.tuples(*[st.integers(0, 255)] * 4)
control_frames = st.builds(control, st.sampled_from(CONTROL_TYPES), raw_primaries, raw_bytes)

any_frames = st.builds(
    frame, st.sampled_from(ADDRESSES), st.integers(0, 255), st.binary(max_size=10)
)
msp_frames = st.builds(
    frame, st.just(FC), st.sampled_from((0x21, 0x22)), st.binary(min_size=8, max_size=10)
)
vtx_frames = st.builds(
    frame,
    st.sampled_from((0x80, 0x83, 0x82, 0x89)),
    st.just(0x20),
    st.binary(min_size=10, max_size=10),
)
frames = st.one_of(control_frames, any_frames, msp_frames, vtx_frames)


@st.composite
def truncated(draw: st.DrawFn) -> bytes:
    """The beginning or the end of a frame."""
    whole = draw(frames)
    cut = draw(st.integers(0, len(whole)))
    return whole[:cut] if draw(st.booleans()) else whole[cut:]


@st.composite
def flipped(draw: st.DrawFn) -> bytes:
    """A frame with one to eight wrong bits."""
    data = bytearray(draw(frames))
    bits = st.integers(0, 8 * len(data) - 1)
    for bit in draw(st.sets(bits, min_size=1, max_size=8)):
        data[bit // 8] ^= 1 << bit % 8
    return bytes(data)


# Noise that is full of addresses and lengths: false starts in plenty.
dense_noise = st.lists(
    st.one_of(st.sampled_from(ADDRESSES), st.integers(0, 14), st.integers(0, 255)), max_size=20
).map(bytes)

streams: SearchStrategy[bytes] = st.lists(
    st.one_of(frames, frames, frames, truncated(), flipped(), dense_noise, st.binary(max_size=20)),
    max_size=30,
).map(b"".join)


@st.composite
def chunked(draw: st.DrawFn) -> list[bytes]:
    """A stream in chunks of random sizes, empty ones among them."""
    stream = draw(streams)
    cuts = sorted(draw(st.lists(st.integers(0, len(stream)), max_size=30)))
    edges = [0, *cuts, len(stream)]
    return [stream[start:stop] for start, stop in pairwise(edges)]
