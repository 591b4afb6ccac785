"""SET_VTX_CONFIG: the settings of the video transmitter, kept and reported as an event."""

from behaviour.msp_support import answer_to, chunks_of, payloads, v1
from behaviour.support import equal
from ghst.msp import Responder
from ghst.msp_commands import answer
from ghst.msp_state import State


def _set(data, **before):
    """The state after SET_VTX_CONFIG, and what the events saw of it."""
    state = State()
    for name, value in before.items():
        setattr(state, name, value)
    events = []
    responder = Responder()
    answer(
        responder,
        state,
        lambda state: events.append((state.vtx_band, state.vtx_channel, state.vtx_freq_mhz)),
    )
    equal(answer_to(responder, v1(89, data)), b"")
    equal(events, [(state.vtx_band, state.vtx_channel, state.vtx_freq_mhz)])
    return state


def _vtx(state):
    return (
        state.vtx_band,
        state.vtx_channel,
        state.vtx_freq_mhz,
        state.vtx_power,
        state.vtx_pit_mode,
        state.vtx_low_power_disarm,
        state.vtx_pit_freq_mhz,
    )


def setting_the_vtx():
    # Band 4, channel 8; as the sample frame of 0x22 does it, with power 1 and pit mode off.
    equal(_vtx(_set(b"\x1f\x00\x01\x00", vtx_freq_mhz=5800)), (4, 8, 0, 1, False, 0, 0))
    equal(_vtx(_set(b"\x00\x00")), (1, 1, 0, 0, False, 0, 0))
    equal(_vtx(_set(b"\x3f\x00", vtx_power=3)), (8, 8, 0, 3, False, 0, 0))
    equal(_vtx(_set(b"\xa8\x16", vtx_band=2, vtx_channel=3)), (0, 0, 5800, 0, False, 0, 0))
    # No frequency of a video transmitter: the rest counts all the same.
    equal(_vtx(_set(b"\xff\xff\x02\x01", vtx_freq_mhz=5800)), (0, 0, 5800, 2, True, 0, 0))
    equal(_vtx(_set(b"\xa8\x16\x02\x01\x02", vtx_pit_freq_mhz=1)), (0, 0, 5800, 2, True, 2, 1))
    equal(_vtx(_set(b"\xa8\x16\x02\x01\x02\xd0\x15")), (0, 0, 5800, 2, True, 2, 5584))
    # What there is no such setting for leaves it as it was: saved, it would ground the model.
    equal(_vtx(_set(b"\xa8\x16\x02\x01\x03", vtx_low_power_disarm=1)), (0, 0, 5800, 2, True, 1, 0))


def setting_the_vtx_with_separate_fields():
    data = b"\x00\x00\x03\x00\x01\xd0\x15"
    equal(_vtx(_set(data + b"\x05\x08\x1d\x17")), (5, 8, 0, 3, False, 1, 5584))
    equal(_vtx(_set(data + b"\x00\x00\x1d\x17\x06\x08\x05\x01")), (0, 0, 5917, 3, False, 1, 5584))


def what_was_set_is_answered():
    state = State()
    responder = Responder()
    answer(responder, state)
    equal(answer_to(responder, v1(89, b"\x1f\x00\x02\x01")), b"")
    wanted = bytes.fromhex("05 04 08 02 01 0000 00 00 0000 00 00 00 00")
    equal(answer_to(responder, v1(88)), wanted)


def setting_the_vtx_without_data_is_an_error():
    for data in (b"", b"\x1f"):
        events = []
        responder = Responder()
        answer(responder, State(), events.append)
        responder.feed(payloads(v1(89, data))[0])
        equal(chunks_of(responder), [b"\xb0\0\x59\0\0\0"])
        equal(events, [])
