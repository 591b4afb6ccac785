"""`ghst.encode`: what it builds is what the receiver and the model read."""

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import raw_bytes, raw_primaries

import ghst
from ghst import encode
from ghst_tools.campaign import model

quick = settings(max_examples=300, deadline=None, derandomize=True)

control_types = st.sampled_from(model.CONTROL_TYPES)
auxiliary_types = st.sampled_from((0x10, 0x11, 0x12, 0x30, 0x31, 0x32))
centred = (1984, 1984, 1984, 1984)

SAMPLES: list[tuple[str, Callable[[], bytes]]] = [
    (
        "820c11d8277e5c87747d7c7c7ccd",
        lambda: encode.channels(0x11, (2008, 2018, 1884, 1864), (125, 124, 124, 124)),
    ),
    (
        "820c10d8277e5c87747c7c1b1bea",
        lambda: encode.channels(0x10, (2008, 2018, 1884, 1864), (124, 124, 27, 27)),
    ),
    (
        "820c105881e2c007ae167ce2aef7",
        lambda: encode.channels(0x10, (344, 3624, 1984, 2784), (22, 124, 226, 174)),
    ),
    ("820c11c0077cc0077c7c7c7c7cf5", lambda: encode.channels(0x11, centred, (124,) * 4)),
    (
        "820c128001e0c0077c18e07c7c5c",
        lambda: encode.channels(0x12, (384, 3584, 1984, 1984), (24, 224, 124, 124)),
    ),
    ("820c13c0077c58017c643c061437", lambda: encode.link_data(0x13, (1984, 1984, 344, 1984))),
    (
        "820c13c0077c58017c256528f87b",
        lambda: encode.link_data(
            0x13,
            (1984, 1984, 344, 1984),
            lq=37,
            rssi_dbm=-101,
            rf_mode=8,
            telemetry=True,
            tx_power_dbm=-8,
        ),
    ),
    ("820c14c0077c58017c000000001c", lambda: encode.channels(0x14, (1984, 1984, 344, 1984))),
    ("800c2000a8161900480000000006", lambda: encode.vtx_setup(0, 5800, 25, 0x48)),
    (
        "820c213000010100000000000078",
        lambda: encode.msp(0x21, bytes.fromhex("30000101000000000000")),
    ),
    (
        "820c223104591f010100420000c8",
        lambda: encode.msp(0x22, bytes.fromhex("3104591f010100420000")),
    ),
    (
        "820c3000f0ff0008400080ff4069",
        lambda: encode.channels(0x30, (0, 4095, 2048, 1024), (0, 128, 255, 64)),
    ),
    (
        "820c3100088000088080808080e6",
        lambda: encode.channels_from_pulses(0x31, [6000] * 16),
    ),
    (
        "820c323000fd00088003fd808068",
        lambda: encode.channels(0x32, (48, 4048, 2048, 2048), (3, 253, 128, 128)),
    ),
    (
        "820c33000880000080634b6a1ba1",
        lambda: encode.link_data(
            0x33,
            (2048, 2048, 0, 2048),
            lq=99,
            rssi_dbm=-75,
            rf_mode=10,
            telemetry=True,
            alt_scale=True,
            tx_power_dbm=27,
        ),
    ),
    (
        "890c239006900b7b000000000069",
        lambda: encode.frame(0x89, 0x23, bytes.fromhex("9006900b7b0000000000")),
    ),
    (
        "890c258e0b3a1ca319ecfa98019b",
        lambda: encode.frame(0x89, 0x25, bytes.fromhex("8e0b3a1ca319ecfa9801")),
    ),
    (
        "890c26d204910a117b000d070361",
        lambda: encode.frame(0x89, 0x26, bytes.fromhex("d204910a117b000d0703")),
    ),
    (
        "890c2777fcf4ffceff0000000761",
        lambda: encode.frame(0x89, 0x27, bytes.fromhex("77fcf4ffceff00000007")),
    ),
    (
        "890c283007010102030000000056",
        lambda: encode.frame(0x89, 0x28, bytes.fromhex("30070101020300000000")),
    ),
]


@pytest.mark.parametrize(("wanted", "build"), SAMPLES, ids=[text for text, _ in SAMPLES])
def test_sample_frames_byte_for_byte(wanted: str, build: Callable[[], bytes]) -> None:
    built = build()
    assert type(built) is bytes
    assert built.hex() == wanted


@quick
@given(kind=control_types, primaries=raw_primaries, tail=raw_bytes)
def test_channels_from_raw_values(
    kind: int, primaries: tuple[int, ...], tail: tuple[int, ...]
) -> None:
    assert encode.channels(kind, primaries, tail) == model.control(kind, primaries, tail)


@quick
@given(address=st.integers(0, 255), kind=st.integers(0, 255), payload=st.binary(max_size=10))
def test_any_frame(address: int, kind: int, payload: bytes) -> None:
    assert encode.frame(address, kind, payload) == model.frame(address, kind, payload)


@pytest.mark.parametrize("kind", [0x10, 0x30], ids=hex)
def test_every_raw_value_survives_the_way_over_its_pulse_width(kind: int) -> None:
    for raw in range(4096):
        pulse = model.quarter_us(kind, raw, primary=True)
        assert encode.raw_primary(kind, pulse) == raw
    for raw in range(256):
        pulse = model.quarter_us(kind, raw, primary=False)
        assert encode.raw_auxiliary(kind, pulse) == raw


@pytest.mark.parametrize("kind", [0x10, 0x30], ids=hex)
def test_raw_values_are_the_nearest_to_any_pulse_width(kind: int) -> None:
    primaries = [model.quarter_us(kind, raw, primary=True) for raw in range(4096)]
    auxiliaries = [model.quarter_us(kind, raw, primary=False) for raw in range(256)]
    for pulse in range(0, 12001, 7):
        best = min(abs(value - pulse) for value in primaries)
        assert abs(primaries[encode.raw_primary(kind, pulse)] - pulse) == best, pulse
        best = min(abs(value - pulse) for value in auxiliaries)
        assert abs(auxiliaries[encode.raw_auxiliary(kind, pulse)] - pulse) == best, pulse


@quick
@given(kind=auxiliary_types, pulses=st.lists(st.integers(0, 12000), min_size=16, max_size=16))
def test_channels_from_pulse_widths(kind: int, pulses: list[int]) -> None:
    receiver = ghst.Receiver()
    assert receiver.feed(encode.channels_from_pulses(kind, pulses)) == 1
    first = 4 * (kind % 16 + 1)
    for channel in range(16):
        if channel < 4:
            raw = encode.raw_primary(kind, pulses[channel])
            assert receiver.pulses[channel] == model.quarter_us(kind, raw, primary=True)
        elif first <= channel < first + 4:
            raw = encode.raw_auxiliary(kind, pulses[channel])
            assert receiver.pulses[channel] == model.quarter_us(kind, raw, primary=False)
        else:
            assert receiver.pulses[channel] == 0


@quick
@given(
    kind=st.sampled_from((0x13, 0x33)),
    primaries=raw_primaries,
    lq=st.integers(0, 255),
    rssi_dbm=st.integers(-255, 0),
    rf_mode=st.integers(0, 31),
    telemetry=st.booleans(),
    alt_scale=st.booleans(),
    tx_power_dbm=st.integers(-128, 127),
)
def test_link_data(kind: int, primaries: tuple[int, ...], **values: int) -> None:
    reader = model.Model()
    assert reader.feed(encode.link_data(kind, primaries, **values)) == 1
    assert reader.lq == values["lq"]
    assert reader.rssi_dbm == values["rssi_dbm"]
    assert reader.rf_mode == values["rf_mode"]
    assert reader.telemetry_requested == values["telemetry"]
    assert reader.alt_scale == values["alt_scale"]
    assert reader.tx_power_dbm == values["tx_power_dbm"]


@quick
@given(
    flags=st.integers(0, 255),
    freq_mhz=st.integers(0, 65535),
    power_mw=st.integers(0, 65535),
    band_channel=st.integers(0, 255),
    address=st.sampled_from((0x80, 0x83)),
)
def test_vtx_setup(
    flags: int, freq_mhz: int, power_mw: int, band_channel: int, address: int
) -> None:
    reader = model.Model()
    data = encode.vtx_setup(flags, freq_mhz, power_mw, band_channel, address)
    assert reader.feed(data) == 0
    assert (data[0], len(data)) == (address, 14)
    assert (reader.vtx_flags, reader.vtx_freq_mhz) == (flags, freq_mhz)
    assert (reader.vtx_power_mw, reader.vtx_band_channel) == (power_mw, band_channel)


ERRORS: list[tuple[Callable[[], bytes], str]] = [
    (lambda: encode.frame(0x82, 0x21, bytes(11)), "payload has 11 bytes, at most 10 fit"),
    (
        lambda: encode.channels(0x10, (0, 4096, 0, 0)),
        "primary channel is 4096, must be 0..4095",
    ),
    (lambda: encode.channels(0x10, (-1, 0, 0, 0)), "primary channel is -1, must be 0..4095"),
    (lambda: encode.channels(0x10, (0, 0, 0)), "3 primary channels given, must be 4"),
    (lambda: encode.channels(0x10, centred, (0, 0, 0, 256)), "byte is 256, must be 0..255"),
    (lambda: encode.channels(0x10, centred, (0, -1, 0, 0)), "byte is -1, must be 0..255"),
    (lambda: encode.channels(0x10, centred, (0,)), "1 bytes follow the primaries, must be 4"),
    (
        lambda: encode.channels(0x20, centred),
        "type 0x20 is no control frame (0x10-0x1f, 0x30-0x3f)",
    ),
    (
        lambda: encode.channels(0x50, centred),
        "type 0x50 is no control frame (0x10-0x1f, 0x30-0x3f)",
    ),
    (
        lambda: encode.channels_from_pulses(0x13, [6000] * 16),
        "type 0x13 carries no auxiliary channels",
    ),
    (
        lambda: encode.channels_from_pulses(0x10, [6000] * 3),
        "3 pulse widths given, must be 16",
    ),
    (
        lambda: encode.channels_from_pulses(0x12, [6000] * 14),
        "14 pulse widths given, must be 16",
    ),
    (lambda: encode.link_data(0x10, centred), "type 0x10 is no link data (0x13, 0x33)"),
    (lambda: encode.link_data(0x13, centred, lq=256), "lq is 256, must be 0..255"),
    (lambda: encode.link_data(0x13, centred, rssi_dbm=1), "rssi_dbm is 1, must be -255..0"),
    (lambda: encode.link_data(0x13, centred, rf_mode=32), "rf_mode is 32, must be 0..31"),
    (
        lambda: encode.link_data(0x13, centred, tx_power_dbm=128),
        "tx_power_dbm is 128, must be -128..127",
    ),
    (lambda: encode.vtx_setup(256, 0, 0, 0), "flags is 256, must be 0..255"),
    (lambda: encode.vtx_setup(0, 65536, 0, 0), "freq_mhz is 65536, must be 0..65535"),
    (lambda: encode.vtx_setup(0, 0, -1, 0), "power_mw is -1, must be 0..65535"),
    (lambda: encode.vtx_setup(0, 0, 0, 256), "band_channel is 256, must be 0..255"),
    (lambda: encode.msp(0x23, bytes(10)), "type 0x23 is no MSP frame (0x21, 0x22)"),
    (lambda: encode.msp(0x21, bytes(9)), "payload has 9 bytes, must be 10"),
]


@pytest.mark.parametrize(("build", "message"), ERRORS, ids=[text for _, text in ERRORS])
def test_values_that_do_not_fit(build: Callable[[], bytes], message: str) -> None:
    with pytest.raises(ValueError) as caught:
        build()
    assert str(caught.value) == message
