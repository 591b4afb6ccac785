"""The UART driver for soft interrupts against a strict model of the ESP32's `machine`.

There is no emulator of that chip here: these tests say that the driver asks for nothing which the
port does not have, and that what it sends is in the slot, however late it is called.
"""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from esp32_model import BYTE_US, Board, Machine
from firmware.uart_link import UartLink

import ghst
from firmware import uart_link
from ghst_tools import boards, device_files

FRAME_US = 14 * BYTE_US
STICKS = bytes(ghst.encode.channels(0x30, (2048,) * 4, (128,) * 4))
ECHO_LOST = bytes.fromhex("890c239006900b7b000000000069")


def link_data(rf_mode: int, telemetry: bool = False) -> bytes:
    """A frame that names the RF mode."""
    return bytes(ghst.encode.link_data(0x13, (1984,) * 4, rf_mode=rf_mode, telemetry=telemetry))


RACE = link_data(6)


class Rig:
    """A link on a model of the board, with always something to send."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, seed: int = 1) -> None:
        self.board = Board(seed)
        monkeypatch.setattr(uart_link, "time", self.board)
        machine = Machine(self.board)
        self.uart = machine.UART(1, 415_000, tx=17, rx=16, rxbuf=256, timeout=0, timeout_char=1)
        self.controls = 0
        self.receiver = ghst.Receiver()
        self.link = UartLink(
            self.uart, machine.Pin(16), machine.Timer(1), self.receiver, self._control
        )
        self.link.start()
        self.number = 0
        self.frame = bytearray(14)
        self.ends: list[float] = []

    def _control(self, frames: int) -> None:
        self.controls += frames

    def refill(self) -> None:
        """Hand over a frame that differs from the last one."""
        if self.link.slot_free:
            ghst.telemetry.pack_status(self.frame, 10 * self.number, 0, 0, True)
            self.number = (self.number + 1) & 0xFFF
            self.link.send(self.frame)

    def fly(self, rate_hz: float, count: int, link: bytes = RACE) -> None:
        """Queue `count` frames of the receiver, each fourth of them `link`."""
        for index in range(count):
            start = self.board.now_us + 1000.0 + index * 1e6 / rate_hz
            self.ends.append(self.board.send(STICKS if index % 4 else link, start))

    def run(
        self,
        us: float,
        round_us: tuple[float, float],
        collect: float = 0.0,
        listen_us: int = 0,
    ) -> None:
        """Run a main loop of rounds that long; some of them collect for up to 8 ms."""
        end = self.board.now_us + us
        while self.board.now_us < end:
            self.link.poll(listen_us)
            self.refill()
            self.board.spend(self.board.random.uniform(*round_us))
            if self.board.random.random() < collect:
                self.board.spend(self.board.random.uniform(100.0, 8000.0), collecting=True)

    def slots_us(self) -> list[float]:
        """How far behind the end of a frame each of ours began."""
        return [
            start - max(end for end in self.ends if end <= start) for start in self.board.starts()
        ]


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Rig:
    return Rig(monkeypatch)


def check(rig: Rig, count: int) -> list[float]:
    """Each frame decoded, nothing of ours decoded, each telemetry frame in a slot of its own."""
    assert rig.receiver.frames == count
    assert rig.receiver.foreign_frames == rig.receiver.skipped_bytes == 0
    assert rig.board.collisions == []
    assert rig.link.collisions == 0
    slots = rig.slots_us()
    assert rig.link.telemetry_frames == len(slots)
    assert all(1000.0 <= slot <= 1300.0 for slot in slots), (min(slots), max(slots))
    return slots


@pytest.mark.parametrize("rate_hz", [500, 250, 55, 19])
@pytest.mark.parametrize("round_us", [(5, 20), (20, 60), (100, 300), (500, 1500), (5000, 9000)])
def test_in_the_slot_or_not_at_all(
    rig: Rig, rate_hz: float, round_us: tuple[float, float]
) -> None:
    count = 200 if rate_hz > 100 else 60
    rig.fly(rate_hz, count)
    rig.run(1e6 * count / rate_hz + 12_000, round_us)
    slots = check(rig, count)
    # A loop that looks often enough sends in nearly each slot, a slow one now and then.
    if round_us[1] <= 60:
        assert len(slots) >= 0.9 * count
    elif round_us[1] <= 300:
        assert 0.02 * count <= len(slots) <= 0.9 * count
    assert rig.controls == count
    assert rig.board.lost_callbacks == rig.uart.overruns == 0


@pytest.mark.parametrize("listen_us", [200, 500, 2000])
def test_listening_finds_the_slots_of_a_slow_main_loop(rig: Rig, listen_us: int) -> None:
    rig.fly(250, 200)
    rig.run(812_000, (300, 700), listen_us=listen_us)
    slots = check(rig, 200)
    # It listens for that much of the time.
    assert len(slots) >= 200 * listen_us / (listen_us + 500) * 0.8


@pytest.mark.parametrize("seed", range(12))
def test_in_the_slot_whatever_the_main_loop_does(
    monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    rig = Rig(monkeypatch, seed)
    rig.fly(500 if seed % 2 else 250, 300)
    longest_us = (50.0, 200.0, 2000.0)[seed % 3]
    rig.run(1.25e6, (5.0, longest_us), collect=0.02, listen_us=seed // 4 * 250)
    slots = check(rig, 300)
    assert slots


def test_interrupts_alone_receive_all_and_send_nothing(rig: Rig) -> None:
    # The main loop never looks: when a frame came is not known.
    rig.fly(250, 100)
    rig.refill()
    for _ in range(450):
        rig.board.spend(1000.0)
    assert check(rig, 100) == []
    assert rig.controls == 100
    assert not rig.link.slot_free


def test_ticks_wrap(rig: Rig) -> None:
    rig.board.now_us = 2**30 - 100_000.0
    rig.fly(250, 100)
    rig.run(420_000, (2, 20))
    assert len(check(rig, 100)) >= 90


@pytest.mark.parametrize("after_us", [1, 30, 100, 400, 700, 900])
@pytest.mark.parametrize("what", [b"\x55", b"\xff", STICKS, ECHO_LOST, RACE[:5]], ids=len)
def test_a_line_that_is_not_quiet(rig: Rig, after_us: float, what: bytes) -> None:
    rig.run(2000, (2, 20))
    end = rig.board.send(RACE, rig.board.now_us + 500.0)
    rig.board.send(what, end + after_us)
    rig.run(4000, (2, 20))
    starts = rig.board.starts()
    if what == STICKS:  # that is a control frame in its turn
        assert len(starts) == 1
        assert 1000.0 <= starts[0] - (end + after_us + FRAME_US) <= 1300.0
    else:
        assert starts == []


@pytest.mark.parametrize("rf_mode", range(16))
def test_only_modes_with_a_downlink(rig: Rig, rf_mode: int) -> None:
    rig.board.send(STICKS, rig.board.now_us + 500.0)
    rig.run(4000, (2, 20))
    assert rig.board.starts() == []
    rig.fly(250, 8, link_data(rf_mode))
    rig.run(36_000, (2, 20))
    assert (len(rig.board.starts()) > 6) is (rf_mode in (5, 6, 8, 10))
    assert bool(rig.board.starts()) is (rf_mode in (5, 6, 8, 10))
    before = len(rig.board.starts())
    rig.fly(250, 8, link_data(rf_mode, True))
    rig.run(36_000, (2, 20))
    assert len(rig.board.starts()) - before > 6


def test_a_second_talker_in_the_slot_is_a_collision(rig: Rig) -> None:
    rig.run(2000, (2, 20))
    end = rig.board.send(RACE, rig.board.now_us + 500.0)
    rig.board.send(STICKS, end + 1200.0)
    rig.run(4000, (2, 20))
    assert rig.board.collisions
    assert rig.link.telemetry_frames == rig.link.collisions == 1
    assert rig.receiver.frames == 1
    rig.fly(250, 20)
    rig.run(90_000, (2, 20))
    assert rig.receiver.frames == 21
    assert rig.link.collisions == 1


def test_our_echo_is_never_an_uplink_frame(rig: Rig) -> None:
    # What comes back in its place is a valid control frame: it is not obeyed.
    rig.run(2000, (2, 20))
    rig.board.send(RACE, rig.board.now_us + 500.0)
    forged = iter(STICKS)
    receive = rig.uart.receive
    rig.run(1000, (2, 20))
    rig.uart.receive = lambda value: receive(next(forged))  # type: ignore[method-assign]
    rig.run(3000, (2, 20))
    assert next(forged, None) is None
    assert rig.receiver.frames == 1
    assert rig.link.collisions == rig.link.telemetry_frames == 1


def test_an_echo_that_is_missing_costs_no_frame(rig: Rig) -> None:
    rig.board.tied = False
    rig.fly(500, 50)
    rig.run(110_000, (2, 20))
    assert rig.receiver.frames == 50
    assert rig.link.collisions == rig.link.telemetry_frames >= 20
    assert all(1000.0 <= slot <= 1300.0 for slot in rig.slots_us())


def test_an_echo_that_is_read_late_together_with_frames(rig: Rig) -> None:
    rig.run(2000, (2, 20))
    rig.fly(500, 5)
    while not rig.board.starts():
        rig.run(20, (2, 10))
    rig.board.spend(9000.0, collecting=True)
    rig.run(3000, (2, 20))
    assert rig.receiver.frames == 5
    assert rig.receiver.foreign_frames == rig.receiver.skipped_bytes == 0
    assert rig.link.collisions == 0


def test_garbage_costs_no_frame(rig: Rig) -> None:
    noise = random.Random(11)
    at = rig.board.now_us + 1000.0
    for _ in range(100):
        junk = bytes(noise.choice((0x82, 0x0C, 0x10, noise.randrange(256))) for _ in range(20))
        end = rig.board.send(junk[: noise.randrange(1, 21)], at)
        rig.ends.append(rig.board.send(RACE, end + noise.choice((0.0, 30.0, 90.0, 400.0))))
        at = rig.ends[-1] + 1700.0
    rig.run(at - rig.board.now_us, (2, 20))
    assert rig.receiver.frames == 100
    assert rig.link.collisions == 0
    assert rig.link.telemetry_frames >= 90
    assert all(1000.0 <= slot <= 1300.0 for slot in rig.slots_us())


def test_bytes_before_a_pause_never_join_a_later_frame(rig: Rig) -> None:
    for length in (1, 7, 13):
        end = rig.board.send(STICKS[:length], rig.board.now_us + 1000.0)
        rig.board.send(STICKS[length:], end + 700.0)
        rig.run(5000, (2, 20))
    assert rig.receiver.frames == 0
    assert rig.receiver.skipped_bytes == 42


def test_stopped_in_the_slot(rig: Rig) -> None:
    rig.run(2000, (2, 20))
    end = rig.board.send(RACE, rig.board.now_us + 500.0)
    rig.run(end + 500.0 - rig.board.now_us, (2, 20))
    rig.link.stop()
    rig.board.spend(5000.0)
    assert rig.board.starts() == []


def test_discarded_in_the_slot(rig: Rig) -> None:
    rig.refill()
    rig.link.discard()
    assert rig.link.slot_free
    with pytest.raises(ValueError, match="14 bytes, not 13"):
        rig.link.send(bytes(13))
    rig.board.send(RACE, rig.board.now_us + 500.0)
    for _ in range(300):
        rig.link.poll()
        rig.board.spend(10.0)
    assert rig.receiver.frames == 1
    assert rig.board.starts() == []


@pytest.mark.parametrize("arch", ["xtensawin", "rv32imc", "armv7emsp"])
def test_it_compiles_for_the_esp32(arch: str) -> None:
    root = boards.checkout()
    modules = [*device_files.library_modules(root), Path("firmware/uart_link.py")]
    for module in modules:
        assert device_files.compile_module(root / module, module.as_posix(), arch)[:1] == b"M"
