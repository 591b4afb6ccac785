"""The demo: its judge, a short run on the emulated board, and what it does without a board."""

import dataclasses
import json
import re
import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from click.testing import CliRunner

import ghst_tools.micropython_image
from ghst_tools import boards, captures, filesystem
from ghst_tools.demo import findings, flight
from ghst_tools.demo import run as demo
from ghst_tools.demo.emulated import EmulatedFlight
from ghst_tools.demo.judge import Demand, Judge, width_ns
from ghst_tools.demo.report import Snapshot
from ghst_tools.emulator import Pulse
from ghst_tools.errors import GhstError

PERIOD_NS = 20_000_000

# Frames of the protocol's description with their pulse widths in quarter microseconds.
SAMPLES = [
    (
        "820c105881e2c007ae167ce2aef7",
        {1: 3950, 2: 8050, 3: 6000, 4: 7000, 5: 3960, 6: 6000, 7: 8040, 8: 7000},
    ),
    (
        "820c128001e0c0077c18e07c7c5c",
        {1: 4000, 2: 8000, 3: 6000, 4: 6000, 13: 4000, 14: 8000, 15: 6000, 16: 6000},
    ),
    (
        "820c3000f0ff0008400080ff4069",
        {1: 3952, 2: 8047, 3: 6000, 4: 4976, 5: 3952, 6: 6000, 7: 8032, 8: 4976},
    ),
    ("820c13c0077c58017c643c061437", {1: 6000, 2: 6000, 3: 3950, 4: 6000}),
]


class Seen:
    """A view that keeps what it was shown."""

    def __init__(self) -> None:
        self.snapshots: list[Snapshot] = []

    def show(self, snapshot: Snapshot) -> None:
        self.snapshots.append(snapshot)


@pytest.mark.parametrize(("frame", "pulses"), SAMPLES)
def test_expected_pulses_are_those_of_the_description(frame: str, pulses: dict[int, int]) -> None:
    assert flight.pulses_in(bytes.fromhex(frame)) == pulses


def test_the_flight_has_both_scalings_in_the_rotation_of_a_receiver() -> None:
    plan = flight.plan(4.0)
    kinds = [[frame[2] for frame in leg.frames] for leg in plan.legs]
    assert kinds[0][:4] == [0x31, 0x33, 0x30, 0x32]
    # Without the capture the first leg is longer, and no multiple of four.
    turn = -len(kinds[0]) % 4
    assert kinds[1][turn : turn + 4] == [0x11, 0x13, 0x10, 0x12]
    assert set(kinds[0]) == {0x30, 0x31, 0x32, 0x33} == set(kinds[-1])
    assert set(kinds[1]) == {0x10, 0x11, 0x12, 0x13}
    assert sum(map(len, kinds)) == 1000
    reached = [
        flight.pulses_in(frame)[channel] for frame in plan.legs[1].frames for channel in (1, 2)
    ]
    assert (min(reached), max(reached)) == (3520, 8638)  # raw 0 and 4095 of the legacy scaling


@pytest.mark.skipif(not captures.px4_path().is_file(), reason="the real capture is not there")
def test_the_part_of_the_capture_is_what_its_name_says() -> None:
    leg = flight.plan(4.0).legs[2]
    stream = b"".join(data for data, _ in captures.read_px4(captures.px4_path()))
    named = re.fullmatch(r"real receiver, frames (\d+) to (\d+) of 1546", leg.name)
    assert named is not None
    first, last = int(named[1]), int(named[2])
    assert last - first + 1 == len(leg.frames) == 250
    assert b"".join(leg.frames) == stream[14 * (first - 1) : 14 * last]


def test_without_the_capture_the_flight_is_as_long(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(captures, "px4_path", lambda: tmp_path / "none.txt")
    legs = flight.plan(4.0).legs
    assert [len(leg.frames) for leg in legs] == [425, 425, 150]


def judge_one(frames: list[tuple[float, str]], pulse: Pulse) -> Judge:
    demand = Demand({6: 1}, {})
    for end_ns, frame in frames:
        demand.frame(end_ns, bytes.fromhex(frame))
    judge = Judge(demand)
    judge.pulse(6, pulse)
    return judge


LOW, HIGH = SAMPLES[0][0], SAMPLES[1][0]  # channel 1 at 987.5 us and at 1000 us
LOW_NS, HIGH_NS = 987_500.0, 1_000_000.0


def test_width_is_rounded_to_the_nearest_pwm_step() -> None:
    assert [width_ns(pulse) for pulse in (0, 3950, 6000, 6001, 6002)] == [
        0,
        987_500,
        1_500_000,
        1_500_312.5,
        1_500_625,
    ]


@pytest.mark.parametrize(
    ("width", "right"),
    [
        (LOW_NS, True),
        (LOW_NS + 16, True),
        (LOW_NS - 16, True),
        (LOW_NS + 17, False),
        (LOW_NS - 17, False),
        (LOW_NS + 312.5, False),
        (HIGH_NS, False),
    ],
)
def test_a_pulse_is_judged_to_16_ns(width: float, right: bool) -> None:
    judge = judge_one([(1e6, LOW)], Pulse(5e6, width))
    assert (judge.right, len(judge.wrong)) == (int(right), int(not right))


@pytest.mark.parametrize(
    ("rise_ns", "low_is_right", "high_is_right"),
    [
        (4_999_999, True, False),
        (5_000_000, True, True),
        (5_049_999, True, True),
        (5_050_000, False, True),
    ],
)
def test_near_a_wrap_both_neighbours_are_right(
    rise_ns: float, low_is_right: bool, high_is_right: bool
) -> None:
    frames = [(1e6, LOW), (5e6, HIGH)]
    assert judge_one(frames, Pulse(rise_ns, LOW_NS)).right == low_is_right
    assert judge_one(frames, Pulse(rise_ns, HIGH_NS)).right == high_is_right


def test_a_pulse_before_the_first_frame_is_wrong() -> None:
    judge = judge_one([(1e6, LOW)], Pulse(999_999, LOW_NS))
    assert judge.wrong == ["GP6: pulse of 987.5000 us at 1.000 ms, demanded was none"]


def test_failsafe_by_rule() -> None:
    demand = Demand({6: 1, 7: 1, 8: 1}, {7: "hold", 8: 1200.5})
    demand.frame(1e6, bytes.fromhex(HIGH))
    demand.failsafe(501e6, 521e6)
    assert [demand.at(pin, 500e6) for pin in (6, 7, 8)] == [{4000}, {4000}, {4000}]
    assert [demand.at(pin, 510e6) for pin in (6, 7, 8)] == [{0, 4000}, {4000}, {4000, 4802}]
    assert [demand.at(pin, 521e6) for pin in (6, 7, 8)] == [{0}, {4000}, {4802}]
    assert [demand.ends_in_failsafe(pin) for pin in (6, 7, 8)] == [True, False, False]


def test_missing_and_stray_pulses_are_found() -> None:
    demand = Demand({6: 1}, {})
    demand.frame(1e6, bytes.fromhex(LOW))
    rises = [10e6 + number * PERIOD_NS for number in range(10)]
    for absent, expected in (([], 0), ([4], 1), ([2, 3], 2), ([9], 1)):
        judge = Judge(demand)
        pulses = [Pulse(t, LOW_NS) for number, t in enumerate(rises) if number not in absent]
        judge.periods(6, pulses, 0, 195e6)
        assert (judge.missing, judge.wrong) == (expected, [])
    judge = Judge(demand)
    judge.periods(6, [*(Pulse(t, LOW_NS) for t in rises), Pulse(205e6, LOW_NS)], 0, 195e6)
    assert judge.wrong == ["GP6: pulse at 205.000 ms is out of step"]
    judge = Judge(demand)
    judge.periods(6, [], 0, 195e6)
    assert judge.missing == 1


def run_demo(*args: str, image: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "ghst_tools.cli", "demo", "--image", str(image), *args],
        capture_output=True,
        text=True,
    )


def test_a_quick_run_is_right_and_leaves_two_files(
    micropython_image: Path, tmp_path: Path
) -> None:
    done = run_demo("--quick", "--out", str(tmp_path), image=micropython_image)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.endswith("\neverything right\n")
    assert "\x1b" not in done.stdout
    assert sorted(path.name for path in tmp_path.iterdir()) == ["demo.png", "demo.vcd"]
    assert (tmp_path / "demo.png").read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
    summary = dict(re.findall(r"^([a-z][\w ]+): (.*)$", done.stdout, re.MULTILINE))
    frames = sum(len(leg.frames) for leg in flight.plan(0.6).legs)
    assert summary["frames sent"] == f"{frames}, and one cut off in its middle"
    assert summary["frames decoded by the board"] == f"{frames}, CRC errors 0"
    assert summary["pulses wrong"] == "0, missing 0"
    # On the ground for most of the time, but all of it is on the radio.
    kinds = re.findall(r"(\w+) (\d+)", summary["telemetry frames"])
    assert [kind for kind, _ in kinds] == ["GpsPrimary", "GpsSecondary", "MagBaro", "PackStatus"]
    assert all(int(count) >= 4 for _, count in kinds)
    assert summary["collisions on the wire"] == "0, frames in one slot: at most 1"
    slot = re.match(
        r"min ([\d.]+), mean [\d.]+, max ([\d.]+) us", summary["stop bit to telemetry slot"]
    )
    assert slot is not None
    assert 990 <= float(slot[1]) <= float(slot[2]) <= 1010
    assert summary["latitude on the radio"].startswith("47.300000 deg, device 47.300000 deg")
    assert "heading on the radio" in summary and "altitude on the radio" in summary
    assert "  radio: 16." in done.stdout
    # The VCD shows the same pulses as the meter has counted.
    header, _, changes = (tmp_path / "demo.vcd").read_text().partition("$enddefinitions $end\n")
    assert "$timescale 100 ns $end" in header
    names = dict(re.findall(r"\$var wire 1 (\S+) (\S+) \$end", header))
    assert set(names.values()) == {
        *(f"GP{5 + channel}_ch{channel}" for channel in range(1, 9)),
        "wire",
        "wire_device",
    }
    lines = changes.partition("$end\n")[2].splitlines()  # behind the levels of the beginning
    # A pulse is complete when it falls; the end of the run may cut some.
    falls = Counter(names[line[1:]] for line in lines if line[0] == "0")
    pulses = sum(count for name, count in falls.items() if "_ch" in name)
    assert summary["pulses measured"] == f"{pulses} at 8 pins"
    assert falls["wire_device"] == sum(int(count) for _, count in kinds)


def test_a_board_that_does_something_else_is_not_right(
    micropython_image: Path, tmp_path: Path
) -> None:
    """The demo expects another channel and an earlier failsafe than the firmware was told."""
    definition = boards.load(boards.DEFAULT_BOARD)
    values = json.loads(definition.definition)
    values["defaults"]["outputs"] = {"6": {"channel": 1}, "9": {"channel": 3}}
    values["defaults"]["failsafe"] = {"time_ms": 400}
    other = dataclasses.replace(definition, definition=json.dumps(values).encode())
    files = filesystem.write(output=tmp_path / "filesystem.img")
    view = Seen()
    flown = EmulatedFlight(flight.plan(0.2), micropython_image, files, other, view)
    flown.run()
    report = findings.report(flown, "?", 1.0)
    assert not flown.judge.verdicts[9].right
    assert flown.judge.verdicts[6].right > 20
    # 400 ms and 20 ms of grace: the pulses after that are wrong, at the pin with its channel too.
    assert 3 <= len(flown.judge.verdicts[6].wrong) <= 5
    assert any(line.startswith("failsafe came at 50") for line in report.failures)
    assert view.snapshots[-1].frames_decoded == flown.frames_sent == 50
    assert {snapshot.link for snapshot in view.snapshots} >= {"linked", "failsafe", "?"}


def test_a_board_without_the_firmware_is_one_line(micropython_image: Path, tmp_path: Path) -> None:
    definition = boards.load(boards.DEFAULT_BOARD)
    files = tmp_path / "filesystem.img"
    files.write_bytes(filesystem.build({}, definition.filesystem_size))
    flown = EmulatedFlight(flight.plan(0.2), micropython_image, files, definition, Seen())
    with pytest.raises(GhstError, match=r"^the firmware did not start on the board, it said: "):
        flown.run()


def test_without_an_image_the_library_runs_on_the_unix_port(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def find(path: Path | None) -> Path:
        raise GhstError("no MicroPython image for rpi_pico")

    monkeypatch.delenv(ghst_tools.micropython_image.IMAGE_VARIABLE, raising=False)
    monkeypatch.setattr(ghst_tools.micropython_image, "find", find)
    result = CliRunner().invoke(demo.command, ["--quick", "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert "no MicroPython image for rpi_pico\n" in result.output
    assert "unix port. No pins are measured.\n" in result.output
    assert "frames decoded: 150, CRC errors 1\n" in result.output  # the one that was cut off
    assert "channel values compared: 2400\nchannel values wrong: 0\n" in result.output
    assert "NOT measured: no pins" in result.output
    assert [path.name for path in tmp_path.iterdir()] == ["demo.png"]


def test_a_wrong_value_of_the_library_is_found(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def expect(frame: bytes) -> dict[int, int]:
        return right(frame) | {1: 6000}

    right = flight.pulses_in
    monkeypatch.setattr("ghst_tools.demo.unix.pulses_in", expect)
    result = CliRunner().invoke(demo.command, ["--quick", "--unix", "--out", str(tmp_path)])
    assert result.exit_code == 1
    assert re.search(r"^NOT RIGHT: frame \d+: channel 1 is ", result.output, re.MULTILINE)


def test_a_named_file_that_is_no_image_is_an_error(tmp_path: Path) -> None:
    done = run_demo("--quick", "--out", str(tmp_path), image=tmp_path / "none.uf2")
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.startswith("ghst: ") and done.stderr.count("\n") == 1


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    out = tmp_path / "file" / "demo"
    done = subprocess.run(
        [sys.executable, "-m", "ghst_tools.cli", "demo", "--unix", "--out", out],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert done.stderr == f"ghst: {out}: Not a directory\n"


def test_ctrl_c_leaves_cleanly(micropython_image: Path, tmp_path: Path) -> None:
    options = (f"--out={tmp_path}", f"--image={micropython_image}")
    process = subprocess.Popen(
        [sys.executable, "-m", "ghst_tools.cli", "demo", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A background job of a shell has it ignored, and its children as well.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert process.stdout is not None
    for line in process.stdout:
        if "12-bit frames" in line:
            break
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate()
    assert process.returncode == 130
    assert errors == "stopped: nothing was written\n"
    assert list(tmp_path.iterdir()) == []
