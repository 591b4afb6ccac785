"""What may happen on the wire: noise, cut frames, breaks, wrong speeds, gaps, our own echo."""

import random

import pytest
from rig import Pico

import ghst
from ghst import decoder

FRAME = ghst.encode.channels(0x30, (48, 4048, 1048, 3048), (3, 253, 64, 192))
PULSES = [4000, 8000, 5000, 7000, 4000, 8000, 4976, 7024]
OTHER = ghst.encode.channels(0x30, (2048,) * 4, (128,) * 4)
ECHO = bytes.fromhex("890c239006900b7b000000000069")


def counters(pico: Pico) -> dict[str, int]:
    """The decoder's counters."""
    names = ("FRAMES", "CRC_ERRORS", "LENGTH_ERRORS", "FOREIGN_FRAMES", "SKIPPED_BYTES")
    return {name: pico.word(getattr(decoder, name)) for name in names}


def decoded(pico: Pico) -> bool:
    """Whether FRAME is what the channels show."""
    return pico.pulses()[:8] == PULSES


@pytest.mark.run()
@pytest.mark.parametrize("baud", [400_000, 410_000, 415_000, 420_000, 425_000, 430_000])
def test_baud_rates_of_real_receivers(pico: Pico, baud: int) -> None:
    for index in range(40):
        # Odd distances: the start bit falls at every phase of the state machine's clock.
        pico.wire.send(FRAME, pico.at(1.9e6 + 37.3 * index), baud=baud)
        pico.board.run_for(2e6 + 400e3)
    assert counters(pico)["FRAMES"] == 40
    assert counters(pico)["SKIPPED_BYTES"] == 0
    assert decoded(pico)


@pytest.mark.run()
@pytest.mark.parametrize("gap_us", [1, 10, 50, 100])
def test_gaps_between_the_bytes_of_a_frame(pico: Pico, gap_us: int) -> None:
    for index in range(20):
        pico.wire.send(FRAME, pico.at(2e6 + 71.7 * index), gap_ns=gap_us * 1e3)
        pico.board.run_for(6e6)
    assert counters(pico)["FRAMES"] == 20
    assert counters(pico)["SKIPPED_BYTES"] == 0


@pytest.mark.run()
def test_frames_back_to_back(pico: Pico) -> None:
    pico.wire.send(OTHER + FRAME, pico.at(1e6))
    pico.board.run_for(3e6)
    assert counters(pico)["FRAMES"] == 2
    assert decoded(pico)
    # Far more than every buffer on the way holds, without a pause.
    pico.wire.send((OTHER + FRAME) * 60, pico.at(1e6))
    pico.board.run_for(50e6)
    assert counters(pico) == {
        "FRAMES": 122,
        "CRC_ERRORS": 0,
        "LENGTH_ERRORS": 0,
        "FOREIGN_FRAMES": 0,
        "SKIPPED_BYTES": 0,
    }


@pytest.mark.run()
@pytest.mark.parametrize("length", [1, 2, 3, 7, 13])
def test_a_cut_off_frame_costs_no_other(pico: Pico, length: int) -> None:
    # At once behind it, inside the time of a gap, behind a gap, and in the next slot.
    for index, pause_ns in enumerate((0.0, 60e3, 170e3, 1.6e6)):
        end = pico.wire.send(OTHER[:length], pico.at(1e6))
        pico.wire.send(FRAME, end + pause_ns)
        pico.board.run_for(4e6)
        assert counters(pico)["FRAMES"] == index + 1, pause_ns
        assert decoded(pico)
    assert counters(pico)["SKIPPED_BYTES"] == 4 * length


@pytest.mark.run()
@pytest.mark.parametrize("pause_us", [1000, 1333])
@pytest.mark.parametrize("before", [0, 7, 21], ids=["gap", "one frame long", "two frames long"])
def test_bytes_before_a_pause_never_join_a_later_frame(
    pico: Pico, before: int, pause_us: int
) -> None:
    # The halves of one frame, CRC right for the whole; the interrupt comes behind 14 bytes of a
    # burst as it does behind a frame.
    end = pico.wire.send(bytes(before) + FRAME[:7], pico.at(1e6))
    pico.wire.send(FRAME[7:], end + pause_us * 1e3)
    pico.board.run_for(6e6)
    assert counters(pico)["FRAMES"] == 0
    assert counters(pico)["SKIPPED_BYTES"] == before + 14
    assert pico.compares == []
    # The next one is whole, at once.
    pico.wire.send(FRAME, pico.at(1e6))
    pico.board.run_for(2e6)
    assert counters(pico)["FRAMES"] == 1
    assert counters(pico)["SKIPPED_BYTES"] == before + 14


@pytest.mark.run()
@pytest.mark.parametrize("gap_us", [0, 50, 100])
def test_noise_right_before_a_slow_frame_costs_no_frame(pico: Pico, gap_us: int) -> None:
    for length in range(1, 15):
        end = pico.wire.send(bytes(length), pico.at(1e6))
        pico.wire.send(FRAME, end + gap_us * 1e3, gap_ns=gap_us * 1e3)
        pico.board.run_for(5e6)
        assert counters(pico)["FRAMES"] == length, (length, counters(pico))
    assert counters(pico)["SKIPPED_BYTES"] == sum(range(1, 15))


@pytest.mark.run()
@pytest.mark.parametrize("count", [1, 2, 3, 8, 13])
def test_an_interrupt_within_a_slow_frame_costs_nothing(pico: Pico, count: int) -> None:
    """The tick forces one, when failsafe begins."""
    pico.wire.send(FRAME, pico.at(0), gap_ns=100e3)
    pico.board.run_for(count * (1e9 / 42_000 + 100e3))
    force = pico.control("FORCE_REGISTER"), pico.control("FORCE_BIT")
    before = pico.word(ghst.decoder.HEAD)
    pico.board.write32(*force)
    pico.board.run_for(20e3)
    assert (pico.word(ghst.decoder.HEAD) - before) & 255 == count
    pico.board.run_for(5e6)
    assert counters(pico)["FRAMES"] == 1
    assert counters(pico)["SKIPPED_BYTES"] == 0


@pytest.mark.run()
def test_noise_before_a_frame_costs_no_frame(pico: Pico) -> None:
    noise = random.Random(5)
    for index in range(60):
        junk = bytes(noise.choice((0x82, 0x0C, 0x10, noise.randrange(256))) for _ in range(20))
        end = pico.wire.send(junk[: noise.randrange(1, 21)], pico.at(1e6))
        pico.wire.send(FRAME, end + noise.choice((0.0, 30e3, 400e3)))
        pico.board.run_for(3.5e6)
        assert counters(pico)["FRAMES"] == index + 1, junk.hex()
        assert decoded(pico)


@pytest.mark.run()
def test_glitches_on_the_idle_line_are_no_start_bits(pico: Pico) -> None:
    for index, width_ns in enumerate((10, 50, 100, 200, 400, 800)):
        start = pico.at(1e6)
        # 5 us before the start bit: a receiver that takes the glitch for one loses the frame.
        pico.wire.glitch(start - 5e3, width_ns)
        pico.wire.send(FRAME, start)
        pico.board.run_for(3e6)
        assert counters(pico)["FRAMES"] == index + 1, width_ns
    assert counters(pico)["SKIPPED_BYTES"] == 0


@pytest.mark.run()
@pytest.mark.parametrize("break_us", [25, 40, 300, 5000])
def test_a_break_costs_what_it_covers(pico: Pico, break_us: int) -> None:
    start = pico.at(1e6)
    pico.wire.send(OTHER, start)
    pico.wire.hold(False, start + 100e3, start + 100e3 + break_us * 1e3)
    end = max(start + 400e3, start + 100e3 + break_us * 1e3)
    pico.wire.send(FRAME, end + 300e3)
    pico.board.run_for(end + 2e6 - start + 1e6)
    assert counters(pico)["FRAMES"] == 1
    assert decoded(pico)


@pytest.mark.run(options="failsafe_ms=110")
def test_our_own_echo_is_somebody_elses_frame(pico: Pico) -> None:
    pico.wire.send(FRAME, pico.at(1e6))
    pico.board.run_for(3e6)
    for _ in range(50):
        pico.wire.send(ECHO, pico.at(1e6))
        pico.board.run_for(3e6)
    assert counters(pico)["FOREIGN_FRAMES"] == 50
    assert counters(pico)["FRAMES"] == 1
    # Failsafe: an echo keeps no link, and brings no channel back.
    assert pico.compares[-1].value == 0
    assert pico.pulses() == [0] * 16


@pytest.mark.run()
def test_the_ring_and_its_transfer_count_go_round(pico: Pico) -> None:
    # The data channel's count of 2^14 bytes runs out after 1170 frames and is written anew.
    pico.fly(lambda index, t: FRAME if index < 1300 else None, 500)
    pico.board.run_for(2.62e9)
    assert counters(pico)["FRAMES"] == 1300
    assert counters(pico)["SKIPPED_BYTES"] == 0
