"""The Ghost wire on a UART: TX (GP20) and RX (GP21) of UART 1 tied together, straight."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from uart_rig import (
    BYTE_NS,
    LATENCY_US,
    LOOP,
    MSP_REQUEST,
    NVIC_DISABLE,
    OUR_FRAME_US,
    PULSES,
    RACE,
    SETUP,
    STICKS,
    UART1,
    WATCHDOG,
    UartPico,
    check_flight,
    fly,
    link_data,
    new_pico,
    slots_us,
)

import ghst
from forked import forked
from ghst import decoder


@pytest.fixture(scope="module")
def talking(micropython_image: Path, firmware_files: dict[str, bytes]) -> UartPico:
    """A Pico that has always something to send; for forked tests only."""
    pico = new_pico(micropython_image, firmware_files)
    pico.run(LOOP, options='wire="uart"', setup=SETUP, watchdog=True)
    # TX was high while MicroPython set the UART up, and is released since.
    assert [driving for _, driving in pico.driven] == [True, False]
    assert pico.driven[1][0] - pico.driven[0][0] < 200e3
    pico.driven.clear()
    return pico


@pytest.mark.parametrize(
    ("rate_hz", "count", "link"),
    [
        (500, 30, link_data(11, True)),
        (250, 15, link_data(10)),
        (55, 6, link_data(5)),
        (19, 4, link_data(8)),
    ],
)
@forked
def test_all_rates(talking: UartPico, rate_hz: float, count: int, link: bytes) -> None:
    receiver = fly(talking, rate_hz, count, link)
    check_flight(talking, receiver, count)
    assert len(receiver.downlink) >= count / 2  # at 500 Hz the main loop needs its time, too
    latencies = talking.latencies_us(receiver)
    assert None not in latencies
    assert max(latencies) <= LATENCY_US
    assert talking.pulses()[:4] == PULSES[:4] or count % 4 == 1
    # Nobody is busy: the slot is where the state machine has it.
    assert max(slots_us(receiver)) < 1030.0
    # TX is driven from just before the start bit until the last stop bit is over.
    assert len(talking.driven) == 2 * len(receiver.downlink)
    times = [t_ns for t_ns, _ in talking.driven]
    for start, end, frame in zip(times[::2], times[1::2], receiver.downlink, strict=True):
        assert 0 <= frame.t_ns - start < 20e3
        assert 0 <= end - frame.t_ns - OUR_FRAME_US * 1e3 < 25e3


@pytest.mark.parametrize("load", [1, 2, 3], ids=["garbage", "printing", "masked"])
@forked
def test_under_load(talking: UartPico, load: int) -> None:
    talking.load(load)
    talking.board.run_for(5e6)
    receiver = fly(talking, 500, 24, link_data(11, True))
    check_flight(talking, receiver, 24)
    assert len(receiver.downlink) >= 6
    # Interrupts are off for 100 us at a time in the last case, and nothing else delays them.
    limit_us = LATENCY_US + (110.0 if load == 3 else 5.0)
    for end_ns, _ in receiver.sent:
        later = [write.t_ns - end_ns for write in talking.compares if write.t_ns > end_ns]
        assert later[3] <= limit_us * 1e3  # four slices


@forked
def test_only_modes_with_a_downlink(talking: UartPico) -> None:
    assert fly(talking, 250, 3, STICKS).downlink == []
    for rf_mode in (0, 5, 6, 7, 8, 10, 11, 12, 13):
        plain = fly(talking, 250, 2, link_data(rf_mode))
        assert len(plain.downlink) == (2 if rf_mode in (5, 6, 8, 10) else 0), rf_mode
        asked = fly(talking, 250, 2, link_data(rf_mode, True))
        assert len(asked.downlink) == 2, rf_mode


@forked
def test_a_line_that_is_not_quiet(talking: UartPico) -> None:
    for after_us in (0, 30, 100, 500, 900, 990):
        for what in (b"\x55", b"\x00", b"\xff", STICKS[:6], MSP_REQUEST):
            end = talking.wire.send(RACE, talking.at(1e6))
            talking.wire.send(what, end + after_us * 1e3)
            talking.board.run_for(end + 2.5e6 - talking.board.now_ns)
            assert talking.driven == [], (after_us, what)
    # It goes out in the next slot, unchanged.
    receiver = fly(talking, 250, 1)
    assert [ghst.downlink.decode(frame.frame).voltage_mv for frame in receiver.downlink] == [0]
    assert 1000.0 <= slots_us(receiver)[0] < 1030.0


@forked
def test_a_glitch_silences_the_slot(talking: UartPico) -> None:
    # The state machine looks every 0.3 us.
    for width_ns in (350, 1000):
        for after_us in (30, 100, 600, 980):
            end = talking.wire.send(RACE, talking.at(1e6))
            talking.wire.glitch(end + after_us * 1e3, width_ns)
            talking.board.run_for(end + 3e6 - talking.board.now_ns)
            assert talking.driven == [], (width_ns, after_us)
    assert len(fly(talking, 250, 3).downlink) == 3


@forked
def test_nothing_behind_a_frame_that_is_not_valid(talking: UartPico) -> None:
    broken = bytes((*RACE[:13], RACE[13] ^ 1))
    foreign = bytes.fromhex("800c2000a8161900480000000006")
    frames = [RACE, broken, foreign, RACE, broken]
    receiver = talking.fly(lambda index, t: frames[index] if index < 5 else None, 250)
    talking.board.run_for(25e6)
    assert len(receiver.sent) == 5
    ends = [end for end, frame in receiver.sent if frame == RACE]
    starts = [frame.t_ns for frame in receiver.downlink]
    late = [(start - end) / 1e3 for start, end in zip(starts, ends, strict=True)]
    assert min(late) >= 1000.0 and max(late) < 1030.0


@forked
def test_garbage_before_a_frame_costs_neither_it_nor_its_slot(talking: UartPico) -> None:
    noise = random.Random(7)
    for index in range(12):
        junk = bytes(noise.choice((0x82, 0x0C, 0x10, noise.randrange(256))) for _ in range(20))
        end = talking.wire.send(junk[: noise.randrange(1, 21)], talking.at(1e6))
        frame_end = talking.wire.send(RACE, end + noise.choice((0.0, 30e3, 90e3, 400e3)))
        talking.board.run_for(frame_end + 2e6 - talking.board.now_ns)
        assert talking.word(decoder.FRAMES) == index + 1, junk.hex()
        sent = talking.wire.decode(since=frame_end)
        assert len(sent) == 14
        assert 1000e3 <= sent[0].t_ns - frame_end < 1030e3


@forked
def test_gaps_between_the_bytes_of_a_frame(talking: UartPico) -> None:
    gaps = random.Random(3)
    choices = [(gap_us,) for gap_us in (1, 50, 70, 80, 100)] + 12 * [(0, 60, 80, 100)]
    for index, gap_us in enumerate(choices):
        end = talking.at(2e6)
        for value in STICKS:
            end = talking.wire.send(bytes((value,)), end + gaps.choice(gap_us) * 1e3)
        talking.board.run_for(end + 300e3 - talking.board.now_ns)
        assert talking.word(decoder.FRAMES) == index + 1, gap_us
    assert talking.word(decoder.SKIPPED_BYTES) == 0
    assert talking.pulses()[:8] == PULSES


@forked
def test_bytes_before_a_pause_never_join_a_later_frame(talking: UartPico) -> None:
    # The first half of one frame and the second half of another, CRC right for the whole.
    for length in (1, 7, 13):
        end = talking.wire.send(STICKS[:length], talking.at(1e6))
        talking.wire.send(STICKS[length:], end + 1.7e6)
        talking.board.run_for(6e6)
    assert talking.word(decoder.FRAMES) == 0
    assert talking.compares == []


@forked
def test_a_pause_in_the_first_of_some_frames_costs_none(talking: UartPico) -> None:
    for index, length in enumerate((1, 6, 13)):
        end = talking.wire.send(STICKS[:length], talking.at(1e6))
        talking.wire.send(STICKS[length:] + STICKS * 5, end + 95e3)
        talking.board.run_for(6e6)
        assert talking.word(decoder.FRAMES) == 6 * (index + 1)
    assert talking.word(decoder.SKIPPED_BYTES) == 0


@forked
def test_frames_back_to_back_and_more_than_the_buffers_hold(talking: UartPico) -> None:
    talking.wire.send(STICKS * 11, talking.at(1e6))
    talking.board.run_for(6e6)
    assert talking.word(decoder.FRAMES) == 11
    # What does not fit is lost, and nothing else; the tick and the next frame go on.
    talking.wire.send(STICKS * 40, talking.at(1e6))
    talking.board.run_for(18e6)
    assert 21 <= talking.word(decoder.FRAMES) < 40
    before = talking.word(decoder.FRAMES)
    assert len(fly(talking, 250, 4).downlink) == 4
    assert talking.word(decoder.FRAMES) == before + 4


@forked
def test_a_break_costs_what_it_covers(talking: UartPico) -> None:
    for count, break_us in enumerate((25, 40, 300, 5000), 1):
        start = talking.at(1e6)
        talking.wire.send(STICKS, start)
        talking.wire.hold(False, start + 100e3, start + 100e3 + break_us * 1e3)
        end = max(start + 400e3, start + 100e3 + break_us * 1e3)
        talking.board.run_for(end + 300e3 - talking.board.now_ns)
        receiver = fly(talking, 250, 2)
        assert talking.word(decoder.FRAMES) == 2 * count, break_us
        assert len(receiver.downlink) == 2


@forked
def test_receivers_that_are_off_the_rate(talking: UartPico) -> None:
    for baud in (400_000, 410_000, 430_000):
        receiver = fly(talking, 250.13, 8, RACE, baud)
        times = slots_us(receiver)
        assert len(times) == 8
        assert min(times) >= 1000.0 and max(times) < 1030.0
    assert talking.word(decoder.FRAMES) == 24
    assert talking.word(decoder.SKIPPED_BYTES) == 0
    assert talking.control("COLLISIONS") == 0


@forked
def test_a_second_talker_in_the_slot_is_a_collision(talking: UartPico) -> None:
    end = talking.wire.send(RACE, talking.at(1e6))
    # It begins behind our fourth byte and ends behind our last.
    talking.wire.send(STICKS, end + 1.02e6 + 4.3 * BYTE_NS)
    talking.board.run_for(6e6)
    assert talking.control("COLLISIONS") == 1
    assert talking.control("TELEMETRY_FRAMES") == 1
    assert talking.word(decoder.FRAMES) == 1
    assert len(fly(talking, 250, 6).downlink) == 6
    assert talking.word(decoder.FRAMES) == 7
    assert talking.control("COLLISIONS") == 1


@forked
def test_our_echo_is_never_an_uplink_frame(talking: UartPico) -> None:
    # A control frame takes the place of our frame, on its way out: what is heard is not obeyed.
    end = talking.wire.send(RACE, talking.at(1e6))
    talking.board.run_for(end + 0.99e6 - talking.board.now_ns)
    pulses = talking.pulses()
    forged = iter(STICKS)
    transmit = talking.pins.transmit
    talking.pins.transmit = lambda value, baud: transmit(next(forged), baud)
    talking.board.run_for(3e6)
    assert next(forged, None) is None
    assert talking.control("COLLISIONS") == 1
    assert talking.control("TELEMETRY_FRAMES") == 1
    assert talking.pulses() == pulses
    assert talking.word(decoder.FRAMES) == 1


@forked
def test_an_echo_that_is_missing(talking: UartPico) -> None:
    # The wire to TX has come off: nothing of what we send is heard.
    transmit = talking.pins.transmit
    talking.pins.transmit = lambda value, baud: None
    receiver = fly(talking, 500, 1)
    assert len(talking.driven) == 2
    assert receiver.downlink == []
    # It is on again.
    talking.pins.transmit = transmit
    receiver = fly(talking, 500, 10)
    assert talking.control("COLLISIONS") == 1
    assert talking.word(decoder.FRAMES) == 11
    assert len(receiver.downlink) >= 4
    # TX was released all the same.
    assert talking.driven[1][0] - talking.driven[0][0] < 380e3


@forked
def test_failsafe_and_what_it_forgets(talking: UartPico) -> None:
    linked = fly(talking, 250, 4)
    assert len(linked.downlink) == 4
    assert talking.control("LINK") == 1
    talking.board.run_for(520e6)
    assert talking.control("LINK") == 2
    assert talking.pulses() == [0] * 16
    talking.board.run_for(25e6)
    assert talking.no_pulses_since(talking.board.now_ns - 1e6)
    assert fly(talking, 250, 3, STICKS).downlink == []
    assert len(fly(talking, 250, 4).downlink) == 4
    assert talking.board.resets == []


@pytest.mark.parametrize("what", ["nothing", "handler", "receiver", "interrupt"])
@forked
def test_the_watchdog_sees_a_dead_uart(talking: UartPico, what: str) -> None:
    if what == "handler":  # as MicroPython leaves it behind an exception in our handler
        talking.board.write32(UART1 + 0x34, 0x10)
    elif what == "receiver":
        talking.board.write32(UART1 + 0x30, 0x101)
    elif what == "interrupt":
        talking.board.write32(NVIC_DISABLE, 1 << 21)
    talking.board.run_for(40e6)
    # Two counts a microsecond are left of a second; the tick comes every 10 ms.
    fed_us = 1_000_000 - (talking.board.read32(WATCHDOG) & 0xFFFFFF) / 2
    assert fed_us <= 10_100 if what == "nothing" else 29_000 <= fed_us <= 51_000
