"""What happens when the link dies, and when it comes back."""

import pytest
from rig import FAILSAFE_NS, NO_SENSORS, PERIOD_NS, SERVOS, Pico

import ghst

CENTRE = ghst.encode.channels(0x30, (2048,) * 4, (128,) * 4)
ENDS = ghst.encode.channels(0x30, (48, 4048, 48, 4048), (3, 253, 3, 253))
TICK_NS = 10e6
# The last pulse may have begun just before failsafe.
LAST_PULSE_NS = 2.2e6


def lose_the_link(pico: Pico, after_ns: float = 100e6) -> float:
    """Fly centred sticks, then silence; returns the end of the last frame."""
    receiver = pico.fly(lambda index, t: CENTRE, 250)
    pico.board.run_for(after_ns)
    receiver.stop()
    pico.board.run_for(5e6)
    return receiver.sent[-1].end_ns


def failsafe_delay_ns(pico: Pico, last_frame_ns: float) -> float:
    """From the last frame to the write of the failsafe values; there must be one only."""
    writes = [c.t_ns for c in pico.compares if c.t_ns > last_frame_ns + 1e6]
    assert len(writes) == 4
    return writes[-1] - last_frame_ns


@pytest.mark.boot()
def test_pulses_end_within_20_ms_of_the_limit(pico: Pico) -> None:
    last = lose_the_link(pico)
    pico.board.run_for(800e6)
    assert FAILSAFE_NS < failsafe_delay_ns(pico, last) <= FAILSAFE_NS + 20e6
    for pin in SERVOS:
        pulses = pico.meter.pulses[pin]
        assert {round(pulse.width_ns) for pulse in pulses} == {1_500_000}
        assert FAILSAFE_NS - PERIOD_NS < pulses[-1].rise_ns - last <= FAILSAFE_NS + 20e6
    assert pico.no_pulses_since(last + FAILSAFE_NS + 20e6 + LAST_PULSE_NS)
    assert b"link: failsafe" in pico.board.console.output


@pytest.mark.parametrize(
    "loop",
    [
        "while True: pass",
        "time.sleep(60)",
        "[bytearray(100) for n in range(50)]",
    ],
    ids=["spinning", "sleeping", "allocating"],
)
def test_it_needs_no_main_loop(pico: Pico, loop: str) -> None:
    pico.run(loop, options="failsafe_ms=110")
    last = lose_the_link(pico, 40e6)
    pico.board.run_for(150e6)
    assert 110e6 < failsafe_delay_ns(pico, last) <= 130e6
    assert pico.no_pulses_since(last + 130e6 + LAST_PULSE_NS)


@pytest.mark.run(options="failsafe={6: -1, 7: 0, 8: 4000, 13: 8800}, failsafe_ms=110")
def test_hold_none_and_a_width_for_each_output(pico: Pico) -> None:
    last = lose_the_link(pico)
    pico.board.run_for(300e6)
    assert 110e6 < failsafe_delay_ns(pico, last) <= 130e6
    expected = {6: 1_500_000, 8: 1_000_000, 13: 2_200_000}
    for pin in SERVOS:
        after = pico.meter.since(last + 130e6 + PERIOD_NS, pin)
        held = [expected[pin]] * 5 if pin in expected else []
        assert [round(pulse.width_ns) for pulse in after[:5]] == held


def test_the_configuration_names_failsafe_by_pin(pico: Pico) -> None:
    outputs = {"6": {"failsafe": "hold"}, "8": {"failsafe": 1000.25}}
    pico.boot(NO_SENSORS | {"outputs": outputs, "failsafe": {"time_ms": 110}})
    last = lose_the_link(pico)
    pico.board.run_for(200e6)
    assert 110e6 < failsafe_delay_ns(pico, last) <= 130e6
    widths = {pin: pico.meter.since(last + 150e6, pin)[:1] for pin in (6, 7, 8)}
    assert round(widths[6][0].width_ns) == 1_500_000
    assert widths[7] == []
    assert widths[8][0].width_ns == pytest.approx(3201 * 312.5, abs=8)


@pytest.mark.run(options="failsafe_ms=110")
def test_only_control_frames_keep_the_link(pico: Pico) -> None:
    last = lose_the_link(pico)
    others = [
        ghst.encode.msp(0x21, bytes(10)),
        ghst.encode.vtx_setup(0, 5800, 25, 0x48),
        ghst.encode.frame(0x89, 0x23, bytes(10)),
        CENTRE[:-1] + bytes([CENTRE[-1] ^ 0x80]),
        ghst.encode.frame(0x82, 0x4F, bytes(10)),
    ]
    pico.fly(lambda index, t: others[index % len(others)], 250)
    pico.board.run_for(130e6)
    assert 110e6 < failsafe_delay_ns(pico, last) <= 130e6


@pytest.mark.run(options="failsafe_ms=110")
def test_the_link_comes_back_with_the_next_frame(pico: Pico) -> None:
    last = lose_the_link(pico)
    pico.board.run_for(200e6)
    assert pico.no_pulses_since(last + 130e6 + LAST_PULSE_NS)
    back = pico.fly(lambda index, t: ENDS if index == 0 else None, 250)
    pico.board.run_for(5e6)
    end = back.sent[0].end_ns
    after = [c.t_ns - end for c in pico.compares if c.t_ns > end]
    assert len(after) == 4
    assert after[-1] <= 35e3
    pico.board.run_for(40e6)
    assert round(pico.meter.since(end, 6)[0].width_ns) == 1_000_000
    assert round(pico.meter.since(end, 7)[0].width_ns) == 2_000_000


@pytest.mark.run(options="failsafe={11: -1, 12: 4000}, failsafe_ms=110")
def test_an_output_leaves_failsafe_with_its_own_channel_only(pico: Pico) -> None:
    # Channels 9 to 12 have no output: they are emptied all the same.
    pico.wire.send(ghst.encode.channels(0x31, (2048,) * 4, (128,) * 4), pico.at(1e6))
    pico.board.run_for(3e6)
    assert pico.pulses()[8:12] == [6000] * 4
    # Channels 5 to 8 are seconds old when the link comes back with a link data frame.
    lose_the_link(pico)
    pico.board.run_for(150e6)
    assert pico.pulses() == [0] * 16
    link_data = ghst.encode.link_data(0x33, (48,) * 4)
    back = pico.fly(lambda index, t: link_data if index < 40 else ENDS, 250)
    pico.board.run_for(159e6)
    since = back.sent[0].end_ns
    widths = {
        pin: {round(pulse.width_ns) for pulse in pico.meter.since(since + PERIOD_NS, pin)}
        for pin in SERVOS
    }
    expected = {6: {1_000_000}, 7: {1_000_000}, 8: {1_000_000}, 9: {1_000_000}}
    assert widths == expected | {10: set(), 11: {1_500_000}, 12: {1_000_000}, 13: set()}
    pico.board.run_for(100e6)
    assert [round(pico.meter.last(pin).width_ns) for pin in (10, 11, 12, 13)] == [
        1_000_000,
        2_000_000,
        1_000_000,
        2_000_000,
    ]


@pytest.mark.run(options="failsafe_ms=110")
@pytest.mark.parametrize("cut_us", [0.5, 13.0, 24.1, 160.0, 320.5])
def test_a_link_that_breaks_inside_a_frame(pico: Pico, cut_us: float) -> None:
    receiver = pico.fly(lambda index, t: ENDS if index == 9 else CENTRE, 250)
    # The tenth frame begins 36 ms after the first and is never complete.
    receiver.stop_at(pico.board.now_ns + 1e6 + 36e6 + cut_us * 1e3)
    pico.board.run_for(180e6)
    assert len(receiver.sent) == 9
    assert pico.word(ghst.decoder.FRAMES) == 9
    assert 110e6 < failsafe_delay_ns(pico, receiver.sent[-1].end_ns) <= 130e6
    assert {round(pulse.width_ns) for pulse in pico.meter.pulses[6]} == {1_500_000}


@pytest.mark.run(options="failsafe_ms=110")
def test_a_line_that_is_held_low_is_a_lost_link(pico: Pico) -> None:
    receiver = pico.fly(lambda index, t: CENTRE, 250)
    now = pico.board.now_ns
    pico.wire.hold(False, now + 50.1e6, now + 200e6)
    pico.board.run_for(190e6)
    ends = [sent.end_ns for sent in receiver.sent if sent.end_ns < now + 50.1e6]
    assert 110e6 < failsafe_delay_ns(pico, ends[-1]) <= 130e6
    before = pico.word(ghst.decoder.FRAMES)
    pico.board.run_for(40e6)
    # It rises inside the slot of a frame at most: no more than that one is lost.
    assert pico.word(ghst.decoder.FRAMES) - before in (6, 7, 8)


@pytest.mark.run(options="failsafe_ms=110")
@pytest.mark.parametrize("clock_us", [2**32 - 150_000, 2**30 - 150_000, 2**31 - 150_000])
def test_the_clock_may_wrap(pico: Pico, clock_us: int) -> None:
    pico.board.advance_timer(clock_us - pico.board.read32(0x40054028))
    receiver = pico.fly(lambda index, t: CENTRE, 250)
    pico.board.run_for(260e6)
    assert len(pico.compares) == 4 * len([s for s in receiver.sent if s.end_ns < pico.at(-1e5)])
    receiver.stop()
    pico.board.run_for(200e6)
    assert 110e6 < failsafe_delay_ns(pico, receiver.sent[-1].end_ns) <= 130e6


@pytest.mark.run(options="failsafe_ms=110")
def test_failsafe_stays_for_more_than_a_whole_wrap(pico: Pico) -> None:
    last = lose_the_link(pico)
    pico.board.run_for(200e6)
    for _ in range(8):
        pico.board.advance_timer(9 * 60 * 1_000_000)  # 72 minutes in all
        pico.board.run_for(30e6)
    assert failsafe_delay_ns(pico, last) <= 130e6
    assert pico.no_pulses_since(last + 130e6 + LAST_PULSE_NS)
