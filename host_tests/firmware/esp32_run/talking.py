"""Telemetry, MSP, the console and noise: what an ESP32 says, and when."""

import ghst
import ghst.downlink
import ghst.encode
from esp32_run.bench import Bench

MIDDLE = [6000] * 16
DIVIDER = 11


def _bench(tree, machine, chip, configuration=None, user=None):
    bench = Bench(tree, machine, chip, configuration, user)
    bench.board.voltages_uv[34] = 1_500_000  # 16.5 V behind the divider
    bench.board.voltages_uv[35] = 400_000  # 10 A
    return bench


def _frames(bench):
    """The telemetry frames that were on the wire: (when, bytes)."""
    frames = []
    for start in bench.board.starts():
        found = [byte for byte in bench.board.sent if byte[3] == "board" and byte[0] >= start]
        frames.append((start, bytes([byte[2] for byte in found[:14]])))
    return frames


def _check_slots(bench):
    for slot in bench.slots_us():
        assert 1000 <= slot <= 1300, slot
    assert bench.board.collisions == []


def telemetry(tree, machine, chip):
    """Frames of the battery in the slot, right to the digit, and no control frame is lost."""
    bench = _bench(tree, machine, chip)
    bench.fly(400, 2400, MIDDLE, rate_hz=160)
    bench.run(2440)
    frames = _frames(bench)
    # Ten a second would be all that there are: each is sent in the slot that it finds.
    assert 10 <= len(frames) <= 22, len(frames)
    _check_slots(bench)
    _, last = frames[-1]
    values = ghst.downlink.decode(last)
    assert values.voltage_mv in range(16_480, 16_521, 10), values
    assert values.current_ma in range(9_950, 10_051, 10), values
    assert bench.frames_decoded() == 320, bench.said
    assert "0 collisions" in bench.said


def no_battery_at_0_v(tree, machine, chip):
    """The lowest voltage that the ADC knows is 142 mV, 1.6 V of a battery: it is none."""
    bench = _bench(tree, machine, chip, {"gps": {"enabled": False}})
    bench.board.voltages_uv.clear()
    bench.run(1500)
    assert bench.lines("battery: ")[-1] == "battery: not plugged in", bench.said


def no_current_at_0_v(tree, machine, chip):
    """142 mV would be 3.6 A, and mAh on the bench."""
    bench = _bench(tree, machine, chip, {"gps": {"enabled": False}})
    bench.board.voltages_uv[35] = 0
    bench.run(3000)
    assert "16.50 V, 0.0 A, 0 mAh, 4S, 0 faults" in bench.lines("battery: ")[-1], bench.said


def the_end_of_the_range_is_a_fault(tree, machine, chip):
    """Above 2.45 V it reads the same as there: truth is more."""
    bench = _bench(tree, machine, chip, {"gps": {"enabled": False}})
    bench.board.voltages_uv[35] = 2_500_000
    bench.run(2000)
    line = bench.lines("battery: ")[-1]
    assert int(line.split(" faults")[0].split()[-1]) > 20, line


def near_the_end_of_the_range_is_none(tree, machine, chip):
    """2.44 V are measured, though the range is asked for its end."""
    bench = _bench(tree, machine, chip, {"gps": {"enabled": False}})
    bench.board.voltages_uv[35] = 2_440_000
    bench.run(2000)
    line = bench.lines("battery: ")[-1]
    assert "16.50 V, 61.0 A" in line and "0 faults" in line, line


def no_telemetry_without_a_downlink(tree, machine, chip):
    """A mode without a downlink: silence."""
    bench = _bench(tree, machine, chip)
    bench.fly(400, 900, MIDDLE, mode=11, rate_hz=500)
    bench.run(940)
    assert bench.board.starts() == []
    assert bench.frames_decoded() == 250


def armed_flag(tree, machine, chip):
    """The flag of a disarmed model goes out while the motors stand still."""
    bench = _bench(
        tree, machine, chip, {"outputs": {"25": {"motor": True}}, "arming": {"channel": 5}}
    )
    low, armed = list(MIDDLE), list(MIDDLE)
    low[2] = armed[2] = low[4] = 3952
    armed[4] = 8032
    bench.fly(400, 1000, low, rate_hz=160)
    bench.fly(1000, 1700, armed, rate_hz=160)
    bench.run(1700)
    flags = [(start, frame[10] & 1) for start, frame in _frames(bench)]
    before = [flag for start, flag in flags if start < 1_000_000]
    after = [flag for start, flag in flags if start > 1_200_000]
    assert len(before) >= 2 and set(before) == {1}, flags
    assert len(after) >= 2 and set(after) == {0}, flags


def msp(tree, machine, chip):
    """A request of the pilot's radio is answered."""
    bench = _bench(tree, machine, chip)
    bench.fly(400, 1400, MIDDLE, rate_hz=50)
    request = ghst.encode.msp(0x21, b"\x30\x00\x01" + bytes(7))  # version 1, API_VERSION
    bench.board.send(bytes(request), 805_000.0)
    bench.run(1400)
    answers = [frame for _, frame in _frames(bench) if frame[2] == 0x28]
    assert answers and answers[0][3] & 0x10 and answers[0][5] == 1, answers
    _check_slots(bench)


def console(tree, machine, chip):
    """Enter shows the state, help the commands, and a word that is none is told."""
    bench = _bench(tree, machine, chip)
    bench.fly(400, 700, MIDDLE)
    bench.type(500, "help\r")
    bench.type(550, "what\r")
    bench.type(600, "\r")
    bench.run(700)
    for line in (
        "help: this list",
        "(Enter): the state of everything",
        "no command 'what': type help",
        "sensors: barometer, battery, gps, magnetometer",
        "link: linked, Race, LQ 90 %, RSSI -70 dBm; frames 51, CRC errors 0",
        "battery: 16.50 V",
    ):
        assert line in bench.said, (line, bench.said)


def noise(tree, machine, chip):
    """Noise and broken frames cost no whole frame, move nothing and are counted."""
    bench = _bench(tree, machine, chip)
    random = bench.board.random
    at_us = 400_000.0
    for number in range(60):
        junk = bytes([int(random.uniform(0, 256)) for _ in range(1 + number % 20)])
        at_us = bench.board.send(junk, at_us) + (0.0, 30.0, 400.0)[number % 3]
        frame = ghst.encode.channels_from_pulses(0x30, MIDDLE)
        at_us = bench.board.send(bytes(frame), at_us) + 3_000.0
        bad = bytearray(ghst.encode.channels_from_pulses(0x30, [8000] * 16))
        bad[5] ^= 0x40
        at_us = bench.board.send(bytes(bad), at_us) + 3_000.0
    bench.run(at_us / 1000 + 40)
    assert bench.frames_decoded() == 60, bench.said
    widths = [width for width in bench.pulses_us(32, 400) if width]
    assert len(widths) == 1 and abs(widths[0] - 1500) < 0.16, widths
    assert bench.board.resets == 0


def an_echo_that_is_missing(tree, machine, chip):
    """Without the diode nothing comes back: counted, and no frame is lost."""
    bench = _bench(tree, machine, chip)
    bench.board.tied = False
    bench.fly(400, 1400, MIDDLE, rate_hz=160)
    bench.run(1440)
    sent = len(bench.board.starts())
    assert sent >= 5
    assert bench.frames_decoded() == 160, bench.said
    assert f"telemetry: {sent} frames sent, {sent} collisions" in bench.said, bench.said


def battery_through_a_reset(tree, machine, chip):
    """What was consumed outlives a reset by the watchdog."""
    user = """
import time

def setup(application):
    if time.resets == 0:
        def stuck(now_ms):
            if now_ms > 3000:
                time.spend(3e6, collecting=True)
        application.steps.append(stuck)
"""
    bench = _bench(tree, machine, chip, {"gps": {"enabled": False}}, user)
    bench.board.voltages_uv[35] = 2_000_000  # 50 A: 13.9 mAh a second
    bench.run(4600)
    assert bench.board.resets == 1
    memory = bench.board.rtc_memory
    assert len(memory) == 8
    consumed = int.from_bytes(memory[:4], "little") & 0xFFFF
    assert 25 <= consumed <= 60, consumed
    shown = [int(line.split(" A, ")[1].split(" mAh")[0]) for line in bench.lines("battery: ")]
    assert shown and shown[-1] >= 25, shown
