"""When telemetry is sent: 1000 us behind a control frame, or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest
from rig import Pico

import ghst
from forked import forked
from ghst_tools import boards
from ghst_tools.campaign.pico import TALKING as IDLE
from ghst_tools.campaign.pico import TALKING_SETUP as SETUP
from ghst_tools.emulator import GhostReceiver

BYTE_NS = 10e9 / 420_000
FRAME_NS = 14 * BYTE_NS
# Sticks in one frame, link data in the other.
STICKS = ghst.encode.channels(0x30, (2048,) * 4, (128,) * 4)
FIRST = bytes(ghst.encode.frame(0x89, 0x23, bytes(10)))  # what SETUP sends first
# Words of firmware.interrupts.
PIO1_IRQ_FORCE = 0x50300034
FRAMES = ghst.decoder.FRAMES
FOREIGN = ghst.decoder.FOREIGN_FRAMES
SKIPPED = ghst.decoder.SKIPPED_BYTES

# The same frame all the time costs the emulator less than a new one each time.
RESEND = "words[16] = 1; machine.idle()"
LOADS = {
    "idle": IDLE,
    "garbage": "import gc; adapter.poll(); refill(); gc.collect()",
    "printing": "adapter.poll(); refill(); print('x' * 400)",
    "allocating": "adapter.poll(); refill(); [bytearray(100) for n in range(50)]",
}


def new_pico(image: Path, files: dict[str, bytes], loop: str, setup: str) -> Pico:
    """A Pico that runs an adapter with `loop`, for forked tests only."""
    pico = Pico(image, files, boards.load("rpi_pico").filesystem_size)
    pico.run(loop, setup=setup)
    return pico


def link_data(rf_mode: int, telemetry: bool = False, alt_scale: bool = False) -> bytes:
    """A frame that names the RF mode."""
    return bytes(
        ghst.encode.link_data(
            0x13, (1984,) * 4, rf_mode=rf_mode, telemetry=telemetry, alt_scale=alt_scale
        )
    )


@pytest.fixture(scope="module")
def talking(micropython_image: Path, firmware_files: dict[str, bytes]) -> Pico:
    """A Pico that has always something new to send; for forked tests only."""
    return new_pico(micropython_image, firmware_files, IDLE, SETUP)


@pytest.fixture(scope="module")
def repeating(micropython_image: Path, firmware_files: dict[str, bytes]) -> Pico:
    """A Pico that sends one frame over and over; for forked tests only."""
    setup = SETUP + "refill()\nwords = adapter.control._words\n"
    return new_pico(micropython_image, firmware_files, RESEND, setup)


def slots_us(receiver: GhostReceiver) -> list[float]:
    """When each telemetry frame began, from the last stop bit before it."""
    assert all(frame.after_ns is not None for frame in receiver.downlink)
    return [(frame.after_ns or 0.0) / 1e3 for frame in receiver.downlink]


def fly(pico: Pico, rate_hz: float, count: int, rf_mode: int, telemetry: bool) -> GhostReceiver:
    """Send `count` frames, each fourth of them link data, and wait for the last slot."""
    link = link_data(rf_mode, telemetry)
    receiver = pico.fly(
        lambda index, t: None if index >= count else STICKS if index % 4 else link, rate_hz
    )
    pico.board.run_for(1e6 + count * 1e9 / rate_hz + 2e6)
    return receiver


def check_flight(pico: Pico, receiver: GhostReceiver, count: int) -> None:
    """Every frame decoded, no collision, at most one telemetry frame a slot, all on time."""
    assert len(receiver.sent) == count
    assert pico.word(FRAMES) == count
    assert (pico.word(FOREIGN), pico.word(SKIPPED), pico.word(ghst.decoder.CRC_ERRORS)) == (0,) * 3
    assert pico.wire.contention == []
    assert receiver.noise == []
    assert pico.control("TELEMETRY_FRAMES") == len(receiver.downlink)
    assert pico.control("COLLISIONS") == 0
    times = slots_us(receiver)
    assert min(times) >= 990.0 and max(times) <= 1010.0
    assert all(frame.ok for frame in receiver.downlink)
    ends = [end for end, _ in receiver.sent]
    slots = [max(end for end in ends if end < frame.t_ns) for frame in receiver.downlink]
    assert len(set(slots)) == len(slots)


def check_numbers(receiver: GhostReceiver) -> None:
    """Each frame once, in order, none made up."""
    numbers = [ghst.downlink.decode(frame.frame).voltage_mv // 10 for frame in receiver.downlink]
    assert numbers == list(range(len(numbers)))


@pytest.mark.parametrize(
    ("rate_hz", "count", "rf_mode", "telemetry"),
    [(500, 5000, 11, True), (250, 1000, 10, False), (55, 1000, 5, False), (19, 200, 8, False)],
)
@forked
def test_no_frame_is_lost_at_any_rate(
    repeating: Pico, rate_hz: float, count: int, rf_mode: int, telemetry: bool
) -> None:
    receiver = fly(repeating, rate_hz, count, rf_mode, telemetry)
    check_flight(repeating, receiver, count)
    assert len(receiver.downlink) == count
    # 14 bytes long, and the wire is released at all other times.
    assert len(repeating.driven) == 2 * count
    times = [t_ns for t_ns, _ in repeating.driven]
    for start, end, frame in zip(times[::2], times[1::2], receiver.downlink, strict=True):
        assert 0 <= frame.t_ns - start < 1e3
        assert abs(end - frame.t_ns - FRAME_NS) < 500.0


@pytest.mark.parametrize("load", LOADS)
def test_the_slot_is_kept_under_every_load(pico: Pico, load: str) -> None:
    pico.run(LOADS[load], setup=SETUP)
    receiver = fly(pico, 500, 150, 11, True)
    check_flight(pico, receiver, 150)
    check_numbers(receiver)
    assert len(receiver.downlink) >= 10


@pytest.mark.run(
    "adapter.poll(); time.sleep_ms(5)", setup=SETUP + "refill(); adapter.control.discard()"
)
def test_what_is_queued_too_late_waits_for_the_next_slot(pico: Pico) -> None:
    # The frame lies ready; the word that has it sent is written from outside, at a time of ours.
    slot = pico.control_place("SLOT")
    for after_us in (-50, 0, 40, 100, 500, 990, 1000, 1010, 1300, 1900):
        end = pico.wire.send(link_data(6), pico.at(200e3))
        pico.board.run_for(end + after_us * 1e3 - pico.board.now_ns)
        pico.board.write32(slot, 1)
        pico.board.run_for(end + 3e6 - pico.board.now_ns)
        if after_us > 0:
            assert pico.wire.decode(since=end) == []
            end = pico.wire.send(link_data(6), pico.at(10e3))
            pico.board.run_for(5e6)
        sent = pico.wire.decode(since=end)
        assert len(sent) == 14
        assert abs(sent[0].t_ns - end - 1e6) < 10e3


@pytest.mark.parametrize("rf_mode", range(16))
@forked
def test_only_modes_with_a_downlink(talking: Pico, rf_mode: int) -> None:
    plain = fly(talking, 250, 8, rf_mode, False)
    expected = 8 if rf_mode in (5, 6, 8, 10) else 0
    assert len(plain.downlink) == expected
    scaled = talking.fly(lambda index, t: link_data(rf_mode, alt_scale=True), 250)
    talking.board.run_for(18e6)
    scaled.stop()
    talking.board.run_for(4e6)
    assert len(scaled.downlink) == (len(scaled.sent) if expected else 0)


@forked
def test_the_request_bit_is_enough(talking: Pico) -> None:
    receiver = fly(talking, 500, 20, 12, True)
    assert len(receiver.downlink) == 20


@forked
def test_nothing_before_link_data_and_after_failsafe(talking: Pico) -> None:
    blind = talking.fly(lambda index, t: STICKS, 250)
    talking.board.run_for(41e6)
    blind.stop()
    assert blind.downlink == []
    linked = fly(talking, 250, 4, 6, False)
    assert len(linked.downlink) == 4
    talking.board.run_for(600e6)
    again = talking.fly(lambda index, t: STICKS, 250)
    talking.board.run_for(41e6)
    again.stop()
    assert again.downlink == []
    assert len(fly(talking, 250, 4, 6, False).downlink) == 4


@forked
def test_nothing_behind_a_frame_that_is_not_valid(talking: Pico) -> None:
    link = link_data(6)
    broken = bytes((*link[:13], link[13] ^ 1))
    foreign = bytes.fromhex("800c2000a8161900480000000006")
    frames = [link, broken, foreign, link, broken]
    receiver = talking.fly(lambda index, t: frames[index] if index < 5 else None, 250)
    talking.board.run_for(25e6)
    assert len(receiver.sent) == 5
    ends = [end for end, frame in receiver.sent if frame == link]
    starts = [frame.t_ns for frame in receiver.downlink]
    assert [round((t - end) / 1e3) for t, end in zip(starts, ends, strict=True)] == [1000, 1000]


@pytest.mark.parametrize("after_us", [1, 20, 40, 100, 500, 660, 900, 990])
@pytest.mark.parametrize(
    "what", [b"\x55", b"\x00", bytes.fromhex("820c213000010100000000000078")], ids=str
)
@forked
def test_a_line_that_is_not_quiet(talking: Pico, after_us: int, what: bytes) -> None:
    end = talking.wire.send(link_data(6), talking.at(1e6))
    talking.wire.send(what, end + after_us * 1e3)
    talking.board.run_for(5e6)
    # Nothing is sent in this slot: it goes out in the next one, unchanged.
    assert talking.wire.decode() == []
    end = talking.wire.send(link_data(6), talking.at(1e6))
    talking.board.run_for(5e6)
    sent = talking.wire.decode()
    assert bytes(byte.value for byte in sent) == FIRST
    assert abs(sent[0].t_ns - end - 1e6) < 10e3


@pytest.mark.parametrize("after_us", [2, 30, 200, 600, 980])
@pytest.mark.parametrize("width_ns", [400, 1000])
@forked
def test_a_glitch_silences_the_slot(talking: Pico, after_us: int, width_ns: int) -> None:
    end = talking.wire.send(link_data(6), talking.at(1e6))
    talking.wire.glitch(end + after_us * 1e3, width_ns)
    talking.board.run_for(6e6)
    assert talking.wire.decode() == []
    receiver = fly(talking, 250, 5, 6, False)
    assert len(receiver.downlink) == 5
    assert min(slots_us(receiver)) >= 990 and max(slots_us(receiver)) <= 1010


@pytest.mark.parametrize("baud", [400_000, 410_000, 430_000])
@forked
def test_receivers_that_are_off_the_rate(talking: Pico, baud: int) -> None:
    ends = []
    for _ in range(10):
        ends.append(talking.wire.send(link_data(6), talking.at(2e6), baud=baud))
        talking.board.run_for(5e6)
    starts = [byte.t_ns for byte in talking.wire.decode()][::14]
    assert len(starts) == 10
    late = [start - end for start, end in zip(starts, ends, strict=True)]
    assert min(late) >= 990e3 and max(late) <= 1010e3
    assert talking.control("COLLISIONS") == 0


@forked
def test_a_second_talker_in_the_slot_is_a_collision(talking: Pico) -> None:
    end = talking.wire.send(link_data(6), talking.at(1e6))
    # It begins behind our fourth byte and ends behind our last.
    talking.wire.send(STICKS, end + 1e6 + 4.3 * BYTE_NS)
    talking.board.run_for(6e6)
    assert talking.control("COLLISIONS") == 1
    assert talking.control("TELEMETRY_FRAMES") == 1
    assert talking.word(FRAMES) == 1
    receiver = fly(talking, 250, 10, 6, False)
    assert len(receiver.downlink) == 10
    assert talking.word(FRAMES) == 11
    assert talking.control("COLLISIONS") == 1


@forked
def test_our_echo_is_never_an_uplink_frame(talking: Pico) -> None:
    # What is heard is a valid control frame for us, in place of the echo: it is not obeyed. Its
    # last two bytes are those that we send.
    frames = (ghst.encode.channels(0x30, (48,) * 4, (raw, 3, 3, 0)) for raw in range(256))
    forged = next(frame for frame in frames if frame[12:] == FIRST[12:])
    before = talking.pulses()
    end = talking.wire.send(link_data(6), talking.at(1e6))
    talking.board.run_for(end + 0.9e6 - talking.board.now_ns)
    pulses = talking.pulses()
    assert pulses != before
    ring = talking.memory_address + ghst.decoder.RING
    talking.board.run_for(1e5 + FRAME_NS - 2 * BYTE_NS)
    # Thirteen of the bytes are there: replace the twelve that DMA has written for sure.
    for at in range(14, 26):
        address = (ring + at) & ~3
        shift = 8 * ((ring + at) & 3)
        word = talking.board.read32(address) & ~(0xFF << shift)
        talking.board.write32(address, word | forged[at - 14] << shift)
    talking.board.run_for(3e6)
    assert talking.control("COLLISIONS") == 1
    assert talking.pulses() == pulses
    assert talking.word(FRAMES) == 1


@forked
def test_an_echo_that_is_cut_short(talking: Pico) -> None:
    end = talking.wire.send(link_data(6), talking.at(1e6))
    talking.wire.hold(False, end + 1e6 + 5.5 * BYTE_NS, end + 1e6 + 15 * BYTE_NS)
    talking.board.run_for(6e6)
    assert talking.control("COLLISIONS") == 1
    assert talking.word(FRAMES) == 1
    assert len(fly(talking, 250, 10, 6, False).downlink) == 10
    assert talking.control("COLLISIONS") == 1


@forked
def test_an_echo_that_is_missing(talking: Pico) -> None:
    # The state machine says that it sends, and nothing is heard.
    link = link_data(12)
    receiver = talking.fly(lambda index, t: link if index < 20 else None, 500)
    talking.board.run_for(6.5e6)
    talking.board.write32(PIO1_IRQ_FORCE, 1 << 4)
    talking.board.run_for(50e6)
    assert talking.control("COLLISIONS") == 1
    assert talking.word(FRAMES) == len(receiver.sent) == 20


@pytest.mark.run(
    "refill()\n"
    "    if machine.mem32[0x50300030] & 16:\n"
    "        adapter.stop()\n"
    "        raise SystemExit",
    setup=SETUP,
)
def test_stopping_in_the_middle_of_a_frame_releases_the_wire(pico: Pico) -> None:
    end = pico.wire.send(link_data(6), pico.at(1e6))
    pico.board.run_for(60e6)
    assert [driving for _, driving in pico.driven] == [True, False]
    begun, ended = (t_ns for t_ns, _ in pico.driven)
    assert 990e3 < begun - end < 1010e3
    assert 50e3 < ended - begun < 325e3
    assert pico.wire.level


@pytest.mark.run(IDLE, setup=SETUP)
def test_the_wire_is_not_driven_before_there_is_a_link(pico: Pico) -> None:
    pico.board.run_for(50e6)
    assert pico.driven == []
