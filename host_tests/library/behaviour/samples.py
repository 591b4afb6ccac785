"""The sample frames of the protocol's description, each with every value it must leave behind."""

from behaviour.support import expect, received


def _received(text, controls=1):
    return received(bytes.fromhex(text), controls)


def crc_check_value():
    from ghst import crc8

    assert crc8(b"123456789", 0, 9) == 0xBC
    assert crc8(b"..123456789..", 2, 11) == 0xBC
    assert crc8(bytearray(b"123456789"), 0, 9) == 0xBC


def crc_of_no_bytes():
    from ghst import crc8

    for start, stop in ((0, 0), (2, 2), (2, 1), (4, 3)):
        assert crc8(b"abcdef", start, stop) == 0, (start, stop)


def capture_channels_9_to_12():
    receiver = _received("820c11d8277e5c87747d7c7c7ccd")
    expect(receiver, [(1, 6030, 6042, 5875, 5850), (9, 6020, 6000, 6000, 6000)], frames=1)


def capture_channels_5_to_8():
    receiver = _received("820c10d8277e5c87747c7c1b1bea")
    expect(receiver, [(1, 6030, 6042, 5875, 5850, 6000, 6000, 4060, 4060)], frames=1)


def legacy_5_to_8_at_full_throw():
    receiver = _received("820c105881e2c007ae167ce2aef7")
    expect(receiver, [(1, 3950, 8050, 6000, 7000, 3960, 6000, 8040, 7000)], frames=1)


def legacy_9_to_12_centred():
    receiver = _received("820c11c0077cc0077c7c7c7c7cf5")
    expect(receiver, [(1, 6000, 6000, 6000, 6000), (9, 6000, 6000, 6000, 6000)], frames=1)


def legacy_13_to_16():
    receiver = _received("820c128001e0c0077c18e07c7c5c")
    expect(receiver, [(1, 4000, 8000, 6000, 6000), (13, 4000, 8000, 6000, 6000)], frames=1)


def link_data_race():
    receiver = _received("820c13c0077c58017c643c061437")
    expect(
        receiver,
        [(1, 6000, 6000, 3950, 6000)],
        frames=1,
        lq=100,
        rssi_dbm=-60,
        rssi_percent=100,
        rf_mode=6,
        tx_power_dbm=20,
    )


def link_data_long_range_with_telemetry():
    receiver = _received("820c13c0077c58017c256528f87b")
    expect(
        receiver,
        [(1, 6000, 6000, 3950, 6000)],
        frames=1,
        lq=37,
        rssi_dbm=-101,
        rssi_percent=28,
        rf_mode=8,
        telemetry_requested=True,
        tx_power_dbm=-8,
    )


def vtx_control_with_zero_tail():
    receiver = _received("820c14c0077c58017c000000001c")
    expect(receiver, [(1, 6000, 6000, 3950, 6000)], frames=1, vtx_controls=1)


def vtx_setup():
    receiver = _received("800c2000a8161900480000000006", 0)
    expect(
        receiver,
        foreign_frames=1,
        vtx_setups=1,
        vtx_freq_mhz=5800,
        vtx_power_mw=25,
        vtx_band_channel=0x48,
    )


def msp_request():
    expect(_received("820c213000010100000000000078", 0), msp_frames=1)


def msp_write():
    expect(_received("820c223104591f010100420000c8", 0), msp_frames=1)


def twelve_bit_5_to_8():
    receiver = _received("820c3000f0ff0008400080ff4069")
    expect(receiver, [(1, 3952, 8047, 6000, 4976, 3952, 6000, 8032, 4976)], frames=1)


def twelve_bit_9_to_12_centred():
    receiver = _received("820c3100088000088080808080e6")
    expect(receiver, [(1, 6000, 6000, 6000, 6000), (9, 6000, 6000, 6000, 6000)], frames=1)


def twelve_bit_13_to_16():
    receiver = _received("820c323000fd00088003fd808068")
    expect(receiver, [(1, 4000, 8000, 6000, 6000), (13, 4000, 8000, 6000, 6000)], frames=1)


def twelve_bit_link_data():
    receiver = _received("820c33000880000080634b6a1ba1")
    expect(
        receiver,
        [(1, 6000, 6000, 3952, 6000)],
        frames=1,
        lq=99,
        rssi_dbm=-75,
        rssi_percent=74,
        rf_mode=10,
        telemetry_requested=True,
        alt_scale=True,
        tx_power_dbm=27,
    )


def own_pack_status_is_foreign():
    expect(_received("890c239006900b7b000000000069", 0), foreign_frames=1)


def own_gps_position_is_foreign():
    expect(_received("890c258e0b3a1ca319ecfa98019b", 0), foreign_frames=1)


def own_gps_motion_is_foreign():
    expect(_received("890c26d204910a117b000d070361", 0), foreign_frames=1)


def own_magnetometer_is_foreign():
    expect(_received("890c2777fcf4ffceff0000000761", 0), foreign_frames=1)


def own_msp_response_is_foreign():
    expect(_received("890c283007010102030000000056", 0), foreign_frames=1)
