"""Link data, VTX set-up and VTX control."""

from behaviour.support import FC, control, equal, expect, frame, received, sample
from ghst import Receiver

_CONTROL = tuple(range(0x10, 0x20)) + tuple(range(0x30, 0x40))
_CENTRED = (2048, 2048, 2048, 2048)
_PERCENT = {0: 100, 60: 100, 61: 98, 75: 74, 88: 51, 89: 49, 116: 2, 117: 0, 118: 0, 255: 0}
_PULSES = [(1, 6000, 6000, 6000, 6000)]


def _link(lq=0, rssi=0, protocol=0, power=0, kind=0x33):
    return control(kind, _CENTRED, (lq, rssi, protocol, power))


def sticks_work_before_any_link_data():
    receiver = received(control(0x31, _CENTRED, (128, 128, 128, 128)))
    expect(receiver, [_PULSES[0], (9, 6000, 6000, 6000, 6000)], frames=1)
    equal(receiver.rf_mode, 0)


def every_protocol_byte_is_split_by_its_bits():
    receiver = Receiver()
    for protocol in sample(range(256), 7):
        receiver.feed(_link(protocol=protocol))
        found = receiver.rf_mode, receiver.telemetry_requested, receiver.alt_scale
        equal(found, (protocol % 32, protocol // 32 % 2 == 1, protocol // 64 % 2 == 1), protocol)
        assert type(receiver.telemetry_requested) is bool
        assert type(receiver.alt_scale) is bool


def transmitter_power_is_signed():
    receiver = Receiver()
    for power in sample(range(-128, 128), 5):
        receiver.feed(_link(power=power & 255))
        equal(receiver.tx_power_dbm, power)


def link_quality_is_passed_on_as_it_is():
    receiver = Receiver()
    for lq in sample(range(256), 7):
        receiver.feed(_link(lq=lq))
        equal(receiver.lq, lq)


def rssi_is_clamped_at_both_ends_and_rises_between():
    receiver = Receiver()
    before = 100
    for rssi in sample(range(256), 7):
        receiver.feed(_link(rssi=rssi, protocol=5))
        equal(receiver.rssi_dbm, -rssi)
        assert 0 <= receiver.rssi_percent <= before, rssi
        before = receiver.rssi_percent
    for rssi, percent in _PERCENT.items():
        receiver.feed(_link(rssi=rssi, protocol=5))
        equal(receiver.rssi_percent, percent, rssi)


def zero_rssi_counts_once_the_rf_mode_is_known():
    equal(received(_link(rssi=0, protocol=0)).rssi_percent, 0)
    equal(received(_link(rssi=1, protocol=0)).rssi_percent, 100)
    equal(received(_link(rssi=0, protocol=5)).rssi_percent, 100)


def both_link_data_types_are_alike():
    for kind in (0x13, 0x33):
        receiver = received(_link(80, 117, 0x6D, 0xFF, kind))
        pulse = 6000 if kind == 0x33 else 6080
        expect(
            receiver,
            [(1, pulse, pulse, pulse, pulse)],
            frames=1,
            lq=80,
            rssi_dbm=-117,
            rf_mode=13,
            telemetry_requested=True,
            alt_scale=True,
            tx_power_dbm=-1,
        )


def no_other_type_touches_link_data():
    for kind in sample(_CONTROL, 3):
        if kind & 15 != 3:
            receiver = received(control(kind, _CENTRED, (99, 99, 99, 99)))
            found = receiver.lq, receiver.rssi_dbm, receiver.rf_mode, receiver.tx_power_dbm
            equal(found, (0, 0, 0, 0), hex(kind))


def link_data_stays_until_the_next():
    receiver = received(_link(80, 90, 5, 10))
    receiver.feed(control(0x30, _CENTRED, (1, 2, 3, 4)))
    equal(
        (receiver.lq, receiver.rssi_dbm, receiver.rf_mode, receiver.tx_power_dbm), (80, -90, 5, 10)
    )
    receiver.feed(_link(0, 120, 8, 0))
    equal(
        (receiver.lq, receiver.rssi_dbm, receiver.rf_mode, receiver.tx_power_dbm), (0, -120, 8, 0)
    )


_VTX = bytes((0xA5, 0x34, 0x12, 0xFF, 0xFE, 0x4F, 1, 2, 3, 4))


def vtx_setup_at_the_radio_and_at_the_goggles():
    for address in (0x80, 0x83):
        receiver = received(frame(0x20, _VTX, address), 0)
        expect(
            receiver,
            foreign_frames=1,
            vtx_setups=1,
            vtx_flags=0xA5,
            vtx_freq_mhz=0x1234,
            vtx_power_mw=0xFEFF,
            vtx_band_channel=0x4F,
        )


def vtx_setup_at_any_other_address_is_not_ours():
    for address in sample((0x81, 0x84, 0x85, 0x86, 0x87, 0x88, 0x89), 2):
        expect(received(frame(0x20, _VTX, address), 0), foreign_frames=1)
    expect(received(frame(0x20, _VTX, FC), 0), unknown_frames=1)


def a_short_vtx_setup_changes_nothing():
    for size in sample(range(10), 2):
        expect(received(frame(0x20, _VTX[:size], 0x83), 0), foreign_frames=1)


def vtx_control_keeps_its_four_raw_bytes():
    receiver = received(control(0x14, (1984, 1984, 1984, 1984), (1, 0x80, 0xFF, 0)))
    expect(receiver, _PULSES, frames=1, vtx_controls=1, vtx_control=b"\x01\x80\xff\x00")


def no_other_type_touches_vtx_control():
    for kind in sample(_CONTROL, 3):
        if kind != 0x14:
            receiver = received(control(kind, _CENTRED, (99, 99, 99, 99)))
            equal(receiver.vtx_control, bytes(4), hex(kind))
