"""What `ghst simulate` sends: sticks, link data, and what is spoilt on purpose."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from recordings import log_text, uplink

import ghst
from ghst.protocol import RF_MODES
from ghst_tools.campaign.model import Model
from ghst_tools.cli import ghst as command
from ghst_tools.errors import GhstError
from ghst_tools.frames.formats import Source
from ghst_tools.frames.recording import load
from ghst_tools.replay import plan
from ghst_tools.simulate.faults import Faults, Loss, Ramp
from ghst_tools.simulate.stick_file import StickFile
from ghst_tools.simulate.sticks import Held, Pattern
from ghst_tools.simulate.uplink import CaptureUplink, Link, StickUplink, Uplink

RACE250 = Link(10)


def octets(made: Uplink) -> list[bytes]:
    """What is in each slot."""
    found: list[bytes] = []
    while (due_s := made.due_s(len(found))) is not None:
        found.append(made.octets(len(found), due_s))
    return found


def sticks(made: Uplink) -> list[list[float]]:
    """The channels in microseconds as an independent receiver has them after each slot."""
    model = Model()
    found = []
    for burst in octets(made):
        model.feed(burst)
        found.append([pulse / 4 for pulse in model.pulses])
    return found


def test_types_take_turns_as_in_a_real_capture() -> None:
    def kinds(**options: object) -> list[int]:
        made = StickUplink(Pattern("centre"), RACE250, Faults(), duration_s=0.02, **options)  # type: ignore[arg-type]
        return [burst[2] for burst in octets(made)]

    assert kinds() == [0x11, 0x13, 0x10, 0x11, 0x13]
    assert kinds(channels=16) == [0x11, 0x13, 0x10, 0x12, 0x11]
    assert kinds(twelve_bit=True) == [0x31, 0x33, 0x30, 0x31, 0x33]
    assert kinds(twelve_bit=True, channels=16) == [0x31, 0x33, 0x30, 0x32, 0x31]


@pytest.mark.parametrize("mode", RF_MODES)
def test_each_rf_mode_has_its_rate_and_names_itself(mode: int) -> None:
    name, rate_hz, telemetry = RF_MODES[mode]
    link = Link(mode)
    assert (link.name, link.rate_hz, link.downlink) == (name, rate_hz, telemetry)
    made = StickUplink(Pattern("sweep"), link, Faults(), duration_s=1.0)
    assert len(octets(made)) == rate_hz
    assert made.due_s(3) == pytest.approx(3 / rate_hz, abs=1e-12)
    model = Model()
    model.feed(b"".join(octets(made)[:2]))
    assert (model.rf_mode, model.telemetry_requested, model.frames) == (mode, False, 2)


def test_the_link_data_fall_evenly_and_ask_for_telemetry() -> None:
    link = Link(11, Ramp(100, 40, 0.5), Ramp(-60, -120, 0.25), -8, telemetry_requested=True)
    assert link.downlink
    made = StickUplink(Pattern("centre"), link, Faults(), rate_hz=40, duration_s=1.0)
    told = []
    for burst in octets(made):
        model = Model()
        model.feed(burst)
        if burst[2] == 0x13:
            assert (model.rf_mode, model.telemetry_requested, model.tx_power_dbm) == (11, True, -8)
            told.append((model.lq, model.rssi_dbm))
    # The second of each three, so at 25, 100, 175 ms, ...
    assert told[:4] == [(97, -66), (88, -84), (79, -102), (70, -120)]
    assert told[-1] == (40, -120)


def test_patterns() -> None:
    def seen(name: str, period_s: float, rate_hz: float) -> list[list[float]]:
        made = StickUplink(
            Pattern(name, period_s, seed=7), RACE250, Faults(), rate_hz, 16, True, period_s
        )
        return sticks(made)

    assert seen("centre", 1.0, 4)[-1] == [1500, 1500, 1000] + [1500] * 13
    sweep = [row[:4] for row in seen("sweep", 1.0, 16)]
    assert [row[0] for row in sweep[:9]] == [1000, 1125, 1250, 1375, 1500, 1625, 1750, 1875, 2000]
    assert [row[0] for row in sweep[9:]] == [1875, 1750, 1625, 1500, 1375, 1250, 1125]
    # Each channel is a sixteenth behind the one before it.
    assert [row[1] for row in sweep[1:]] == [row[0] for row in sweep[:-1]]
    assert [row[:2] for row in seen("steps", 1.0, 5)] == [
        [1000, 1250],
        [1250, 1500],
        [1500, 1750],
        [1750, 2000],
        [2000, 1000],
    ]
    assert [row[:3] for row in seen("square", 1.0, 4)] == [[1000, 2000, 1000]] * 2 + [
        [2000, 1000, 2000]
    ] * 2
    random = [row[0] for row in seen("random", 1.0, 16)]
    assert random[::2] == random[1::2] and len(set(random)) == 8
    assert random == [row[0] for row in seen("random", 1.0, 16)]
    assert all(1000 <= value <= 2000 for value in random)


def test_channels_can_be_held() -> None:
    held = Held(Pattern("square", 1.0), {1: 4 * 1750, 16: 3520})
    made = StickUplink(held, RACE250, Faults(), 4, 16, duration_s=2.0)
    seen = sticks(made)
    assert [row[0] for row in seen] == [1750] * 8
    assert [row[1] for row in seen] == [2000, 2000, 1000, 1000] * 2
    assert seen[-1][15] == 880


def test_the_link_is_lost_for_whole_slots() -> None:
    faults = Faults((Loss(0.1, 0.2), Loss(0.9, 5)))
    made = StickUplink(Pattern("centre"), RACE250, faults, 50, duration_s=1.0)
    empty = [number for number, burst in enumerate(octets(made)) if not burst]
    assert empty == [*range(5, 15), *range(45, 50)]
    assert faults.counts["lost"] == 15


def test_what_is_spoilt_is_what_a_receiver_counts() -> None:
    def made(**options: float) -> tuple[list[bytes], Faults]:
        faults = Faults(seed=3, **options)  # type: ignore[arg-type]
        return octets(StickUplink(Pattern("sweep"), RACE250, faults, duration_s=4.0)), faults

    plain, _ = made()
    dropped, faults = made(drop=20)
    assert faults.counts == {"dropped": dropped.count(b"")}
    assert 150 < dropped.count(b"") < 250
    assert [burst for burst in dropped if burst] == [
        one for one, burst in zip(plain, dropped, strict=True) if burst
    ]
    bad, faults = made(bad_crc=10)
    receiver = ghst.Receiver()
    receiver.feed(b"".join(bad))
    # One wrong byte: nothing else is wrong with any of them.
    wrong = sum(a != b for a, b in zip(plain, bad, strict=True))
    assert faults.counts == {"bad_crc": wrong} and 60 < wrong < 140
    assert all(a[:-1] == b[:-1] for a, b in zip(plain, bad, strict=True))
    assert receiver.frames == 1000 - wrong
    noisy, faults = made(noise=30)
    assert all(burst.endswith(frame) for burst, frame in zip(noisy, plain, strict=True))
    lengths = {len(burst) - 14 for burst in noisy}
    assert lengths == set(range(9))
    assert sum(map(len, noisy)) - 14_000 == faults.counts["noise_bytes"]
    # All of it together is the same every time, and with another seed another.
    everything = made(drop=10, bad_crc=10, noise=10)[0]
    assert everything == made(drop=10, bad_crc=10, noise=10)[0]
    other = Faults(drop=10, bad_crc=10, noise=10, seed=4)
    assert everything != octets(StickUplink(Pattern("sweep"), RACE250, other, duration_s=4.0))


def test_extra_frames_take_the_place_of_a_control_frame() -> None:
    made = StickUplink(Pattern("centre"), RACE250, Faults(), duration_s=0.02)
    plain = octets(made)
    made.extra.append(b"extra")
    assert octets(made) == [b"extra", *plain[1:]]


@pytest.mark.parametrize(
    "text",
    [
        "t,ch1,ch3,note\n0,1100,1200,x\n0.5,1200,,\n1.0,,1300,\n",
        "0,1100,,1200\n0.5,1200\n# nothing\n\n1.0,,,1300\n",
        "time_s,channel 3_us,CH1\n7,1200,1100\n7.5,,1200\n8,1300,\n",
        '{"t": 3, "channels_us": [1100, null, 1200]}\n{"t": 3.1, "name": "pack_status"}\n'
        '{"t": 3.5, "channels_us": [1200]}\n{"t": 4, "channels_us": [null, null, 1300]}\n',
    ],
)
def test_sticks_from_a_file(tmp_path: Path, text: str) -> None:
    path = tmp_path / "sticks"
    path.write_text(text)
    made = StickUplink(StickFile(path), RACE250, Faults(), 4, twelve_bit=True)
    assert made.length_s == 1.5
    # The last line lasts as long as the one before it.
    assert [(row[0], row[2]) for row in sticks(made)] == (
        [(1100, 1200)] * 2 + [(1200, 1200)] * 2 + [(1200, 1300)] * 2
    )
    again = StickUplink(StickFile(path, loop=True), RACE250, Faults(), 4, duration_s=2.5)
    assert [row[0] for row in sticks(again)][5:8] == [1200, 1100, 1100]
    assert StickUplink(StickFile(path, loop=True), RACE250, Faults()).length_s is None


def test_what_decode_prints_is_a_file_of_sticks(tmp_path: Path) -> None:
    path = tmp_path / "flight.log"
    path.write_text(log_text(8))
    decoded = CliRunner().invoke(command, ["decode", "--json", str(path)]).stdout
    (tmp_path / "sticks.jsonl").write_text(decoded)
    made = StickUplink(StickFile(tmp_path / "sticks.jsonl"), RACE250, Faults())
    receiver = ghst.Receiver()
    receiver.feed(b"".join(uplink(8)))
    assert json.loads(decoded.splitlines()[-2])["channels_us"][:4] == sticks(made)[-1][:4]
    assert sticks(made)[-1][:4] == [pulse / 4 for pulse in receiver.pulses[:4]]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "no line with a time and channels"),
        ("t,ch1\n", "no line with a time and channels"),
        ("a,b\n1,2\n", ":1: name the columns t, ch1, ch2"),
        ("0,1500\n1,3000\n", ":2: channel 1 is '3000', must be 880 to 2160 us"),
        ("0,1500\nsoon,1500\n", ":2: the time is 'soon', must be a number of seconds"),
        ("0,1500\n1,1500\n0.5,1500\n", "entry 3: the time goes back from 1.0 to 0.5 s"),
        ('{"t": 0, "channels_us": [1500]}\nx\n', ":2: not an object of JSON in one line"),
        ('{"t": null, "channels_us": [1500]}\n', ":1: the time is None"),
        ('{"t": 0, "channels_us": [true]}\n', ":1: channel 1 is True"),
        ('{"t": 0, "channels_us": 5}\n', ":1: channels_us is no list of at most 16"),
    ],
)
def test_a_file_that_cannot_be(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "sticks"
    path.write_text(text)
    with pytest.raises(GhstError) as caught:
        StickFile(path)
    assert str(path) in str(caught.value) and told in str(caught.value)


def test_the_frames_of_a_recording_with_their_distances(tmp_path: Path) -> None:
    path = tmp_path / "flight.log"
    path.write_text(log_text(8))
    planned = plan(load(Source(path)), 1.0, None, 420_000)
    made = CaptureUplink(planned, Faults((Loss(0.009, 0.004),)))
    assert octets(made) == [*uplink(8)[:3], b"", *uplink(8)[4:]]
    assert [made.due_s(number) for number in range(9)] == [
        *(pytest.approx(0.004 * number, abs=2e-6) for number in range(8)),
        None,
    ]
    looped = CaptureUplink(planned, Faults(), loop=True, duration_s=0.039)
    assert octets(looped) == (uplink(8) * 2)[:10]
    assert CaptureUplink(planned, Faults(), loop=True).length_s is None
    assert looped.length_s == 0.039 and made.length_s == pytest.approx(0.032, abs=1e-5)
    assert CaptureUplink(planned, Faults(), duration_s=0.01).length_s == 0.01
