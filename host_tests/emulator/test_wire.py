"""The half-duplex wire, the simulated receiver and the recorder."""

from itertools import pairwise
from pathlib import Path

import pytest

from ghst_tools.emulator import Board, GhostReceiver, VcdRecorder, Wire
from ghst_tools.uart_bits import decode, encode

FRAME = bytes.fromhex("820c105881e2c007ae167ce2aef7")
BIT_NS = 1e9 / 420_000

# A 420000 baud transmitter on GPIO 2 that releases the wire when it has nothing to send.
SENDER = """
import rp2
from machine import Pin
@rp2.asm_pio(out_init=rp2.PIO.OUT_HIGH, sideset_init=rp2.PIO.OUT_LOW, side_pindir=True,
             out_shiftdir=rp2.PIO.SHIFT_RIGHT)
def sender():
    pull() .side(0)
    set(x, 9) .side(1)
    label("bit")
    out(pins, 1) .side(1)
    jmp(x_dec, "bit") .side(1) [6]
sm = rp2.StateMachine(0, sender, freq=8 * 420000, out_base=Pin(2), sideset_base=Pin(2))
sm.active(1)
def send(data):
    for value in data:
        sm.put((value | 0x100) << 1)
"""


@pytest.fixture
def wire(board: Board) -> Wire:
    return Wire(board, 2)


@pytest.mark.parametrize("baud", [400_000, 420_000, 430_000])
@pytest.mark.parametrize("gap_ns", [0.0, 100_000.0])
def test_encode_and_decode_are_inverse(baud: float, gap_ns: float):
    data = bytes(range(256))
    changes, end = encode(data, 1_000.0, baud, gap_ns)
    assert bytes(byte.value for byte in decode(changes, baud)) == data
    assert all(byte.framing_ok for byte in decode(changes, baud))
    assert end == pytest.approx(1_000 + 2560 * 1e9 / baud + 255 * gap_ns)
    assert decode(changes, baud)[3].t_ns == pytest.approx(1_000 + 3 * (1e10 / baud + gap_ns))


def test_a_break_is_a_framing_error():
    edges = [(0.0, False), (60_000.0, True), (*encode(b"U", 100_000.0, 420_000)[0][0],)]
    (byte,) = decode(edges, 420_000, 90_000.0)
    assert (byte.t_ns, byte.value, byte.framing_ok) == (0.0, 0, False)


def test_the_host_sends_at_the_time_asked_for_and_lets_go(board: Board, wire: Wire):
    start = board.now_ns + 5_000
    end = wire.send(FRAME, start)
    assert end - start == pytest.approx(140 * BIT_NS)
    second = wire.send(b"\x55", gap_ns=50.0)
    assert second == pytest.approx(end + 10 * BIT_NS)
    with pytest.raises(ValueError, match="taken"):
        wire.send(b"x", end)
    board.run_for(1e6)
    sent = wire.decode(who="host")
    assert bytes(byte.value for byte in sent) == FRAME + b"\x55"
    assert sent[0].t_ns == pytest.approx(start)
    assert wire.pin.host is None
    assert wire.level is True
    assert wire.decode() == []


def test_hold_and_glitch_are_as_long_as_asked(board: Board, wire: Wire):
    start = board.now_ns
    wire.hold(False, start + 10_000, start + 300_000)
    wire.glitch(start + 400_000, 250)
    wire.send(FRAME, start + 450_000)
    wire.glitch(start + 450_000 + 1.5 * BIT_NS - 100, 300)
    board.run_for(1e6)
    times = [(round(edge.t_ns - start), edge.level) for edge in wire.edges[:4]]
    assert times == [(10_000, False), (300_000, True), (400_000, False), (400_250, True)]
    # The sampling point of the first data bit is hit: 0x82 becomes 0x83.
    assert [b.value for b in wire.decode(who="host", since=start + 440_000)][:2] == [0x83, 0x0C]


def test_the_device_drives_the_wire_and_its_bytes_are_told_apart(board: Board, wire: Wire):
    board.exec(SENDER)
    since = board.now_ns
    wire.send(FRAME)
    board.run_for(1e6)
    board.exec("send(b'GHST' * 3)")
    board.run_for(100_000)
    assert bytes(b.value for b in wire.decode(since=since)) == b"GHST" * 3
    assert bytes(b.value for b in wire.decode(who="host", since=since)) == FRAME
    assert wire.contention == []
    assert wire.pin.device is None


def test_driving_against_each_other_is_noticed_once(board: Board, wire: Wire):
    board.exec(SENDER)
    since = board.now_ns
    board.start("send(b'\\x00')")
    board.run_until(lambda: wire.pin.device is not None, poll_ns=1_000)
    wire.hold(True, board.now_ns + 1_000, board.now_ns + 5_000)
    at = board.now_ns + 1_000
    board.run_for(100_000)
    assert wire.contention == [pytest.approx(at)]
    assert [b.value for b in wire.decode(since=since)] == [0]  # the device's level wins


def test_frames_come_at_the_exact_rate(board: Board, wire: Wire):
    receiver = GhostReceiver(wire, lambda index, t_ns: FRAME if index % 5 else None, 333.0)
    start = board.now_ns + 1_000
    receiver.start(start)
    board.run_for(0.3e9)
    receiver.stop()
    board.run_for(10e6)
    slots = [index for index in range(100) if index % 5]
    assert [sent.end_ns for sent in receiver.sent] == [
        pytest.approx(start + index * 1e9 / 333 + 140 * BIT_NS, abs=0.01) for index in slots
    ]
    assert bytes(b.value for b in wire.decode(who="host")) == FRAME * len(slots)


@pytest.mark.parametrize("after_ns", [1_000.0, 30_000.0, 100_000.0])
def test_a_link_can_be_cut_within_a_byte_and_come_back(board: Board, wire: Wire, after_ns: float):
    receiver = GhostReceiver(wire, lambda index, t_ns: FRAME, 500.0)
    start = board.now_ns
    receiver.start(start)
    receiver.stop_at(start + 4e6 + after_ns)
    board.run_for(20e6)
    assert len(receiver.sent) == 2
    assert not receiver.running
    assert wire.pin.host is None
    assert wire.edges[-1].t_ns <= start + 4e6 + after_ns + 0.01
    receiver.start()
    board.run_for(3e6)
    assert len(receiver.sent) == 4


def test_downlink_frames_are_collected_with_their_time(board: Board, wire: Wire):
    board.exec(SENDER)
    telemetry = bytes.fromhex("890c239006900b7b000000000069")
    receiver = GhostReceiver(wire, lambda index, t_ns: FRAME, 100.0)
    receiver.start()
    board.run_for(1e6)
    board.exec(f"send({telemetry!r})")
    board.exec("send(b'noise')")
    receiver.stop()
    board.run_for(10e6)
    (frame,) = receiver.downlink
    assert (frame.frame, frame.ok) == (telemetry, True)
    before = [sent.end_ns for sent in receiver.sent if sent.end_ns < frame.t_ns]
    assert frame.after_ns == pytest.approx(frame.t_ns - before[-1])
    assert bytes(value for _, value in receiver.noise) == b"noise"
    receiver.trim()
    assert receiver.sent == receiver.downlink == receiver.noise == []


def test_recording_has_every_change_with_its_time(board: Board, wire: Wire, tmp_path: Path):
    recorder = VcdRecorder(board, {"led": 25}, wire)
    board.exec("from machine import Pin; p = Pin(25, Pin.OUT, value=1)")
    wire.send(b"\x55")
    board.run_for(1e6)
    recorder.write(tmp_path / "run.vcd", resolution_ns=0.001)
    text = (tmp_path / "run.vcd").read_text()
    assert "$timescale 1 ps $end" in text
    assert all(f" {name} $end" in text for name in ("led", "wire", "wire_device"))
    stamps = [int(line[1:]) for line in text.splitlines() if line.startswith("#")]
    first = stamps.index(next(s for s in stamps if stamps.count(s) and s > 1e6))
    bits = stamps[first:]
    # 0x55 alternates: ten edges a bit apart, to the picosecond.
    steps = [b - a for a, b in pairwise(bits)]
    assert sum(abs(step - BIT_NS * 1000) <= 1 for step in steps) == 9


def test_a_recording_is_as_coarse_as_asked_for(board: Board, wire: Wire, tmp_path: Path) -> None:
    start_ns = board.now_ns
    recorder = VcdRecorder(board, {}, wire)
    times: list[float] = []
    wire.watch(lambda edge: times.append(edge.t_ns))
    board.run_for(50e3)
    wire.send(b"\x55")
    board.run_for(100e3)
    path = tmp_path / "run.vcd"
    recorder.write(path)
    header, _, changes = path.read_text().partition("$enddefinitions $end\n")
    assert "$timescale 100 ns $end" in header
    edges = [int(line[1:]) for line in changes.splitlines() if line.startswith("#")]
    assert len(times) == 10
    assert edges == [0, *(round((t - start_ns) / 100) for t in times), 1500]
    with pytest.raises(ValueError, match="no time scale of 25 ns"):
        recorder.write(path, resolution_ns=25)
