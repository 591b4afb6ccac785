"""`ghst simulate` on the wire of the emulated board, in emulated time."""

from __future__ import annotations

from typing import Any

import pytest
from rig import NO_SENSORS, SERVOS, Pico, steps

import ghst
from ghst_tools.emulator.tcp_port import attend
from ghst_tools.emulator.wire_port import WirePort
from ghst_tools.emulator.wire_server import WireServer
from ghst_tools.serial_port import open_wire
from ghst_tools.simulate.faults import Faults, Loss
from ghst_tools.simulate.listening import Heard
from ghst_tools.simulate.msp_client import MspClient
from ghst_tools.simulate.send import Sender, Sent
from ghst_tools.simulate.session import Session
from ghst_tools.simulate.sticks import Pattern
from ghst_tools.simulate.uplink import Link, StickUplink, Uplink

BAUD = 420_000
BATTERY = NO_SENSORS | {"battery": {"divider": 11.0, "current_mv_per_a": 40}}
STEP_NS = 312.5


class Bench:
    """What `engine.run` does with threads and the host's clock, on the clock of the board."""

    def __init__(self, pico: Pico, uplink: Uplink, link: Link, msp: MspClient) -> None:
        self.pico = pico
        self.adapter = WirePort(pico.wire)
        self.sent: list[Sent] = []
        self.heard: list[Heard] = []
        start_s = self.now_s() + 1e-3
        self.session = Session(uplink, link, BAUD, msp, start_s=start_s)
        self.sender = Sender(self.adapter, uplink, self.now_s, self.sleep, start_s)

    def now_s(self) -> float:
        return self.pico.board.now_ns / 1e9

    def sleep(self, seconds: float) -> None:
        self.pico.board.run_for(seconds * 1e9)

    def run(self) -> None:
        while self.sender.send_next():
            self.step()
        self.sleep(3e-3)
        self.step()
        self.heard += self.session.finish()[0]

    def step(self) -> None:
        sent = self.sender.take()
        reads = [(t_ns / 1e9, octets) for t_ns, octets in self.adapter.take()]
        self.sent += sent
        self.heard += self.session.add(sent, reads, self.now_s())[0]
        self.session.speak()


def commanded(sent: list[Sent], channel: int) -> list[tuple[float, int]]:
    """When which pulse width of a channel was on the wire, decoded by the library."""
    receiver = ghst.Receiver()
    found = []
    for slot in sent:
        receiver.feed(slot.octets)
        if receiver.pulses[channel - 1]:
            found.append(
                (slot.time_s + len(slot.octets) * 10 / BAUD, receiver.pulses[channel - 1])
            )
    return found


@pytest.mark.boot(BATTERY)
def test_servos_follow_telemetry_comes_back_and_the_slot_is_measured(pico: Pico) -> None:
    pico.board.adc(0).set_volts(16.8 / 11)
    pico.board.adc(1).set_volts(10 * 0.040)
    link = Link(10)  # Race250
    # The link is lost for ten slots; one in ten frames has a wrong CRC, or noise before it.
    faults = Faults((Loss(0.2, 0.04),), bad_crc=10, noise=10, seed=1)
    uplink = StickUplink(Pattern("steps", 0.5), link, faults, twelve_bit=True, duration_s=0.6)
    bench = Bench(pico, uplink, link, MspClient((1,)))
    bench.run()
    session, listening = bench.session, bench.session.listening

    assert [slot.number for slot in bench.sent] == list(range(150))
    assert session.rhythm.late_us[2] < 1.0  # of emulated time: to the end of an instruction
    assert session.sent_bursts == 140 and faults.counts["lost"] == 10
    assert faults.counts["bad_crc"] == 14 and faults.counts["noise_bytes"] == 69
    # The echo of all of it is told from what the board says, wrong CRC and noise as well.
    assert listening.echo.present and listening.echo.intact == 140
    assert (listening.echo.broken, listening.damaged, listening.garbage_bytes) == (0, 0, 0)
    assert pico.wire.contention == []
    # To the microsecond, since nothing is between this adapter and the wire.
    assert len(listening.slots_us) == len(bench.heard) >= 6
    assert 999.0 < min(listening.slots_us) <= max(listening.slots_us) < 1001.0
    said = bytes(octet.value for octet in pico.wire.decode(since=bench.session.start_s * 1e9))
    assert b"".join(heard.frame for heard in bench.heard) == said
    packs = [ghst.downlink.decode(heard.frame) for heard in bench.heard if heard.frame[2] == 0x23]
    assert len(packs) == listening.frames["pack_status"] >= 4
    # The voltage is still being smoothed.
    assert 16600 <= packs[-1].voltage_mv <= 16810 and abs(packs[-1].current_ma - 10000) <= 50
    assert [answer.text() for answer in session.msp.answers] == [
        "MSP 1 api_version: protocol 0, API 1.44"
    ]
    for pin, channel in SERVOS.items():
        values = commanded(bench.sent, channel)
        judged = 0
        for rise_ns, width_ns in pico.meter.pulses[pin]:
            # A frame is in the compare register 35 us behind its end, the last time at least.
            before = [pulse for t_s, pulse in values if t_s * 1e9 < rise_ns - 100e3]
            if before:
                # Pins change every 8 ns, a clock of the chip.
                assert abs(width_ns - steps(before[-1]) * STEP_NS) <= 8, (pin, rise_ns)
                judged += 1
        assert judged >= 28
        assert len({pulse for _, pulse in values}) == 5


@pytest.mark.boot(BATTERY)
def test_the_wire_behind_a_tcp_port(pico: Pico) -> None:
    pico.board.adc(0).set_volts(16.8 / 11)
    # The battery is found, and what measures it loaded.
    pico.board.run_for(0.5e9)
    told: list[str] = []
    server = WireServer(pico.wire, pico.meter, 0, told.append)
    line: Any = open_wire(server.address)
    frame = ghst.encode.channels(0x30, (48, 4048, 1048, 3048))
    link = ghst.encode.link_data(0x33, (48, 4048, 1048, 3048), rf_mode=10)

    def exchanged(octets: bytes) -> bytes:
        """What comes back within 4 ms of emulated time."""
        line.write(octets)
        attend([server.port], 0.0)
        while not pico.wire.busy_until_ns > pico.board.now_ns:
            attend([server.port], 0.01)
        pico.board.run_for(4e6)
        server.step()
        return bytes(line.read(line.in_waiting)) if line.in_waiting else b""

    try:
        attend([server.port], 0.0)
        assert exchanged(frame) == frame
        heard = b"".join(exchanged(link) for _ in range(64))
        # What the board says comes behind the echo.
        packs = heard.split(link)
        told_packs = [ghst.downlink.decode(frame) for frame in packs if frame]
        assert len(told_packs) >= 2
        assert {type(pack).__name__ for pack in told_packs} == {"PackStatus"}
        assert len(told) == 1 and "GP6 1000.0  GP7 2000.0  GP8 1250.0  GP9 1750.0" in told[0]
    finally:
        line.close()
        server.port.close()
