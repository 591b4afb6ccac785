"""What `ghst simulate` makes of the wire: echo, collisions, telemetry, slots, MSP, the log."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paced_port import BEGUN_S, PacedPort
from recordings import BYTE_S, FRAME_S, pack, uplink

import ghst
from ghst_tools.simulate.echo import EchoFilter, Stretch
from ghst_tools.simulate.faults import Faults
from ghst_tools.simulate.listening import Listening
from ghst_tools.simulate.msp_client import MspClient, number, request
from ghst_tools.simulate.send import Rhythm, Sender, Sent
from ghst_tools.simulate.sticks import Pattern
from ghst_tools.simulate.uplink import Link, StickUplink
from ghst_tools.simulate.wire_log import WireLog
from ghst_tools.sniff.log_file import LogFile
from ghst_tools.tool_docs.flight_controller import FlightController

BAUD = 420_000
RACE250 = Link(10)
FRAMES = uplink(9)


def joined(stretches: list[Stretch]) -> list[tuple[bytes, bool]]:
    """The stretches, those that follow each other without an echo between them as one."""
    found: list[tuple[bytes, bool]] = []
    for octets, is_echo in stretches:
        if found and not is_echo and not found[-1][1]:
            found[-1] = (found[-1][0] + octets, False)
        else:
            found.append((octets, is_echo))
    return found


# What a flight controller says in a slot: nothing, a frame, or bytes that are none; and what
# becomes of the echo before it: whole, or damaged by something.
SLOTS = st.tuples(
    st.sampled_from(FRAMES),
    st.one_of(st.just(b""), st.builds(pack, st.integers(0, 9)), st.binary(max_size=20)),
    st.booleans(),
)


@settings(max_examples=300, deadline=None)
@given(st.lists(SLOTS, max_size=12), st.lists(st.integers(1, 30), min_size=1), st.booleans())
def test_every_byte_is_either_echo_or_not(
    slots: list[tuple[bytes, bytes, bool]], sizes: list[int], separate: bool
) -> None:
    """Whatever the reads: with one wire, with separate wires, and with collisions."""
    echo = EchoFilter()
    stretches: list[Stretch] = []
    stream = b""
    broken = 0
    for index, (frame, said, damaged) in enumerate(slots):
        echo.sent(index * 4e-3, frame)
        if not separate:
            stream += frame[:5] + bytes((frame[5] ^ 1,)) + frame[6:] if damaged else frame
            broken += damaged
        stream += said
    rest = stream
    for at in range(len(stream)):
        if not rest:
            break
        size = sizes[at % len(sizes)]
        stretches += echo.read(rest[:size], len(slots) * 4e-3)
        rest = rest[size:]
    stretches += echo.finish(1.0)
    assert b"".join(octets for octets, _ in stretches) == stream
    assert all(octets in FRAMES for octets, is_echo in stretches if is_echo)
    whole = 0 if separate else len(slots) - broken
    assert echo.intact == sum(is_echo for _, is_echo in stretches) >= whole
    if whole == len(slots) and slots:
        assert (echo.present, echo.broken) == (True, 0)
    assert echo.settled == len(slots)


def test_telemetry_before_and_behind_the_echo() -> None:
    echo = EchoFilter()
    echo.sent(0.0, FRAMES[0])
    assert echo.read(FRAMES[0][:6], 0.001) == []
    assert joined(echo.read(FRAMES[0][6:] + pack(1)[:3], 0.002)) == [
        (FRAMES[0], True),
        (pack(1)[:3], False),
    ]
    echo.sent(0.004, FRAMES[1])
    # Until the next echo is there it is not known what this belongs to.
    assert echo.read(pack(1)[3:], 0.005) == []
    assert joined(echo.read(FRAMES[1], 0.006)) == [(pack(1)[3:], False), (FRAMES[1], True)]
    assert (echo.present, echo.intact, echo.broken, echo.settled) == (True, 2, 0, 2)


def test_a_broken_echo_is_a_collision() -> None:
    echo = EchoFilter()
    for index in range(4):
        echo.sent(index * 0.004, FRAMES[index])
    torn = bytes(14)
    found = echo.read(FRAMES[0] + torn + FRAMES[2] + torn[:5], 0.02)
    assert joined(found) == [(FRAMES[0], True), (torn, False), (FRAMES[2], True)]
    assert (echo.intact, echo.broken) == (2, 1)
    # No other frame comes that would tell: the time does.
    assert echo.read(b"", 0.012 + 0.29) == []
    assert echo.read(b"", 0.012 + 0.31) == [Stretch(torn[:5], False)]
    assert (echo.intact, echo.broken, echo.settled) == (2, 2, 4)


def test_what_is_on_its_way_at_the_end_is_no_collision() -> None:
    echo = EchoFilter()
    echo.sent(0.0, FRAMES[0])
    echo.read(FRAMES[0], 0.001)
    echo.sent(0.1, FRAMES[1])
    echo.sent(0.2, FRAMES[2])
    assert echo.read(FRAMES[2][:4], 0.21) == []
    assert echo.finish(0.21) == [Stretch(FRAMES[2][:4], False)]
    assert (echo.intact, echo.broken) == (1, 1)


def test_separate_wires_have_no_echo_until_somebody_joins_them() -> None:
    echo = EchoFilter()
    for index in range(8):
        echo.sent(index * 0.004, FRAMES[index])
        assert echo.read(b"", index * 0.004) == []
    assert echo.read(pack(1), 0.1) == [] and echo.present is None
    assert echo.read(pack(2), 0.301) == [Stretch(pack(1) + pack(2), False)]
    assert (echo.present, echo.broken) == (False, 0)
    # What could be the beginning of an echo waits; all else is told at once.
    echo.sent(0.31, FRAMES[8])
    assert echo.read(pack(3) + FRAMES[8][:2], 0.311) == [Stretch(pack(3), False)]
    assert echo.read(FRAMES[8][2:], 0.312) == [Stretch(FRAMES[8], True)]
    assert (echo.present, echo.intact, echo.broken) == (True, 1, 0)


def sent(number: int, time_s: float, octets: bytes) -> Sent:
    return Sent(number, time_s, time_s, octets)


def test_slots_are_from_the_end_of_the_echo_to_the_first_start_bit() -> None:
    listening = Listening(BAUD)
    heard = []
    for index, slot_us in enumerate((1000, 1010, 1500)):
        begin_s = 0.01 + index * 0.004
        end_s = begin_s + FRAME_S
        answer_s = end_s + slot_us * 1e-6 + FRAME_S
        heard += listening.add([sent(index, begin_s - 1e-4, FRAMES[index])], [], begin_s)
        reads = [(end_s - 5 * BYTE_S, FRAMES[index][:9]), (end_s, FRAMES[index][9:])]
        heard += listening.add([], [*reads, (answer_s, pack(index))], answer_s)
    assert [frame.frame for frame in heard] == [pack(index) for index in range(3)]
    assert listening.slots_us == pytest.approx([1000, 1010, 1500], abs=1e-3)
    assert [frame.slot_us for frame in heard] == list(listening.slots_us)
    assert heard[0].time_s == pytest.approx(0.01 + FRAME_S + 1e-3)
    # One read with both: nothing was measured.
    listening.add([sent(3, 0.1, FRAMES[3])], [], 0.1)
    (frame,) = listening.add([], [(0.102, FRAMES[3] + pack(4))], 0.102)
    assert frame.slot_us is None and listening.slots_unknown == 1
    assert listening.frames == {"pack_status": 4}


def test_without_an_echo_slots_begin_with_writing() -> None:
    listening = Listening(BAUD)
    heard = []
    for index in range(9):
        begin_s = index * 0.05
        answer = [(begin_s + FRAME_S + 0.0025 + FRAME_S, pack(index))] if index in (2, 8) else []
        heard += listening.add([sent(index, begin_s, FRAMES[index])], [], begin_s)
        heard += listening.add([], answer, begin_s + 0.01)
    assert [frame.frame for frame in heard] == [pack(2), pack(8)]
    assert listening.slots_us == pytest.approx([2500, 2500], abs=1e-3)
    # Over a network no time is that of a wire.
    listening = Listening(BAUD, network=True)
    listening.add([sent(0, 0.0, FRAMES[0])], [(0.001, FRAMES[0])], 0.001)
    (frame,) = listening.add([], [(0.004, pack(1))], 0.004)
    assert (frame.slot_us, listening.slots_unknown, len(listening.slots_us)) == (None, 1, 0)


def test_what_is_not_understood_is_counted_and_the_rest_still_found() -> None:
    listening = Listening(BAUD)
    bad = bytearray(pack(1))
    bad[-1] ^= 1
    foreign = ghst.encode.vtx_setup(0, 5800, 25, 0x48)
    reads = [(0.01, FRAMES[0]), (0.02, bytes(bad)), (0.03, b"\x00\x01"), (0.04, foreign)]
    heard = listening.add([sent(0, 0.0, FRAMES[0])], reads, 0.04)
    heard += listening.add([], [(0.05, pack(2)[:7])], 0.05)
    heard += listening.add([], [(0.06, pack(2)[7:])], 0.06)
    heard += listening.finish(0.06)
    assert [frame.frame for frame in heard] == [pack(2)]
    assert (listening.damaged, listening.garbage_bytes, listening.others) == (1, 2, 1)


class Time(PacedPort):
    """Some writes take their time: the number of the write, and seconds."""

    stalls: ClassVar[dict[int, float]] = {}

    def write(self, data: bytes) -> None:
        super().write(data)
        self.now_s += self.stalls.get(len(self.written), 0.0)


def sender(time: Time, waits: Callable[[int], bool] = lambda bursts: False) -> Sender:
    made = StickUplink(Pattern("centre"), RACE250, Faults(), 500, duration_s=0.02)
    return Sender(time, made, time.clock, time.sleep, BEGUN_S + 0.001, waits)


def test_slots_keep_their_absolute_times() -> None:
    time = Time()
    sending = sender(time)
    while sending.send_next():
        pass
    assert [begin_s for begin_s, _ in time.written] == pytest.approx(
        [0.001 + 0.002 * index for index in range(10)]
    )
    rhythm = Rhythm()
    for slot in sending.take():
        rhythm.add(slot)
    assert (rhythm.slots, rhythm.skipped) == (10, 0)
    assert rhythm.rate_hz == pytest.approx(500)
    assert rhythm.late_us == pytest.approx((0, 0, 0), abs=1e-3)


def test_a_slot_that_is_over_is_left_out_and_no_burst_makes_up_for_it() -> None:
    time = Time()
    time.stalls = {3: 0.0093, 5: 0.0005}  # more than four slots; a quarter of one
    sending = sender(time)
    while sending.send_next():
        pass
    slots = sending.take()
    assert [slot.number for slot in slots] == [0, 1, 2, 6, 7, 8, 9]
    rhythm = Rhythm()
    for slot in slots:
        rhythm.add(slot)
    assert rhythm.skipped == 3
    assert rhythm.late_us[2] == pytest.approx(1300)
    # The frames are those of their slots.
    made = StickUplink(Pattern("centre"), RACE250, Faults(), 500, duration_s=0.02)
    assert [data for _, data in time.written] == [
        made.octets(slot.number, slot.due_s) for slot in slots
    ]


def test_slots_are_left_out_while_an_echo_is_awaited() -> None:
    time = Time()
    sending = sender(time, lambda bursts: bursts > 0 and time.now_s < BEGUN_S + 0.0079)
    while sending.send_next():
        pass
    assert [slot.number for slot in sending.take()] == [0, 4, 5, 6, 7, 8, 9]


def test_the_end_of_a_sleep_may_be_the_end_of_all() -> None:
    time = Time()
    made = StickUplink(Pattern("centre"), RACE250, Faults(), 500, duration_s=0.02)
    sending = Sender(time, made, time.clock, lambda seconds: True, BEGUN_S + 0.001)
    assert not sending.send_next()
    assert (time.written, sending.take()) == ([], [])


def test_an_error_comes_behind_what_was_sent() -> None:
    sending = sender(Time())
    sending.send_next()
    sending.failed(OSError("gone"))
    assert len(sending.take()) == 1
    with pytest.raises(OSError, match="gone"):
        sending.take()


def exchange(client: MspClient, drop: set[int], until_s: float = 60.0) -> list[float]:
    """Eight slots a second with the library's flight controller; returns when was asked."""
    flight_controller = FlightController()
    link = ghst.encode.link_data(0x13, (1984,) * 4, rf_mode=10)
    asked: list[float] = []
    slot = 0
    while (time_s := slot / 8) < until_s and not client.done:
        slot += 1
        if question := client.question(time_s):
            asked.append(time_s)
            if len(asked) - 1 not in drop:
                flight_controller.hear(question)
        frame = flight_controller.hear(link)
        if frame and frame[2] == 0x28:
            client.take(frame[3:9], time_s)
    return asked


def test_questions_are_asked_one_after_the_other() -> None:
    client = MspClient([1, number("fc-variant"), number("0x1234"), 4, 3])
    asked = exchange(client, set())
    assert [answer.text() for answer in client.answers] == [
        "MSP 1 api_version: protocol 0, API 1.44",
        "MSP 2 fc_variant: GHMP",
        "MSP 4660: error, the flight controller does not answer this command",
        f"MSP 4 board_info: {client.answers[3].data.hex(' ')}",  # type: ignore[union-attr]
        "MSP 3 fc_version: 0.1.0",
    ]
    # Eleven chunks, and a twelfth since they are full.
    assert len(client.answers[3].data or b"") == 53
    assert asked[0] == 0.25 and len(asked) == 5 and client.unanswered == []


def test_a_question_is_repeated_and_given_up() -> None:
    client = MspClient([2, 1])
    assert exchange(client, {0, 1}) == [0.25, 1.25, 2.25, 2.5]
    assert [answer.command for answer in client.answers] == [2, 1]
    client = MspClient([2, 1])
    assert exchange(client, {0, 1, 2}) == [0.25, 1.25, 2.25, 3.25]
    assert client.unanswered == [2]
    assert [answer.command for answer in client.answers] == [1]
    client = MspClient([2, 1])
    client.give_up()
    assert client.done and client.unanswered == [2, 1]


def test_a_question_is_what_radios_ask() -> None:
    # API_VERSION, with the xor that radios append.
    assert request(1).hex() == "820c213000010100000000000078"
    receiver = ghst.Receiver()
    receiver.feed(request(1, 5) + request(0x3000))
    payload = bytearray(10)
    assert receiver.next_msp(payload) and payload[:4] == bytes((0x35, 0, 1, 1))
    message = ghst.msp.Request()
    assert receiver.next_msp(payload)
    assert message.feed(payload) == ghst.msp.COMPLETE
    assert (message.version, message.command, message.size) == (2, 0x3000, 0)
    for word in ("nothing", "70000", "-1"):
        with pytest.raises(ValueError):
            number(word)


def logged(tmp_path: Path, echo: bool | None) -> list[str]:
    path = tmp_path / f"{echo}.log"
    log_file = LogFile(path)
    with log_file.open("port", BAUD):
        log = WireLog(log_file, BAUD)
        log.add([sent(0, 0.1, FRAMES[0])], [], None, 0.1)
        log.add([sent(1, 0.2, FRAMES[1]), sent(2, 0.3, b"")], [(0.15, pack(1))], None, 0.2)
        assert len(path.read_text().splitlines()) <= 3  # nothing is known yet
        log.add([], [(0.25, pack(2))], echo, 0.4)
        log.add([sent(3, 0.41, FRAMES[2])], [(0.405, pack(3))], echo, 0.42)
        log.finish(echo)
    return [line for line in path.read_text().splitlines() if line[0] != "#"]


def test_the_log_has_what_was_on_the_wire(tmp_path: Path) -> None:
    heard = [f"{time_s:.6f} {pack(n).hex()}" for n, time_s in ((1, 0.15), (2, 0.25), (3, 0.405))]
    assert logged(tmp_path, True) == heard
    told = [
        f"{time_s + FRAME_S:.6f} {frame.hex()}"
        for frame, time_s in zip(FRAMES, (0.1, 0.2, 0.41), strict=False)
    ]
    assert logged(tmp_path, False) == [told[0], heard[0], told[1], heard[1], heard[2], told[2]]
    # If it never becomes known, nothing is left out.
    assert logged(tmp_path, None) == [told[0], heard[0], told[1], heard[1], heard[2], told[2]]
