"""Outputs that are not plain: against a model, at the compare registers and at the pins."""

from __future__ import annotations

import random
from fractions import Fraction
from functools import partial

import pytest
from rig import NO_SENSORS, Pico

import ghst
from ghst_tools.campaign.fork import in_child

OUTPUTS = {
    "6": {"channel": 1, "reverse": True},
    "7": {"channel": 2, "minimum_us": 1100, "centre_us": 1480, "maximum_us": 1950},
    "8": {"channel": 3, "subtrim_us": 30.5, "deadband_us": 12, "reverse": True},
    "9": {"channel": 4, "minimum_us": 900.25, "deadband_us": 100},
    "10": {"channel": 1, "kind": "servo_760", "frequency_hz": 333},
    "11": {"channel": 2, "kind": "oneshot125", "frequency_hz": 333, "minimum_us": 125},
    "12": {"channel": 3, "kind": "switch", "threshold_us": 1600, "hysteresis_us": 100},
    "13": {"channel": 4, "kind": "switch", "reverse": True},
}
SHORTENED = {"servo_760": 2, "oneshot125": 8}
CENTRES = {"servo_760": 760, "oneshot125": Fraction(375, 2)}
# Compare steps per microsecond at 50 and at 333 Hz.
STEPS = {50: Fraction(16, 5), 333: Fraction(8)}
TOPS = {50: 64000, 333: 24024}
# What shaped outputs may cost more than plain ones.
MORE_US = 10.0
LIMIT_VIPER_US = 43.0
THUMB = "/lib/firmware/shape_thumb.mpy"


def both_forms(configuration: dict[str, object]) -> pytest.MarkDecorator:
    """Runs a test with the assembler's form of the interrupt, and with the one without it."""
    board = NO_SENSORS | configuration
    return pytest.mark.parametrize(
        "form",
        [
            pytest.param("thumb", marks=pytest.mark.boot(board)),
            pytest.param("viper", marks=pytest.mark.boot(board, files={THUMB: None})),
        ],
    )


class Model:
    """What an output must give for a channel, in fractions."""

    def __init__(self, **point: object) -> None:
        self.point = {"kind": "servo", "reverse": False, "frequency_hz": 50, **point}
        self.on = False

    def compare(self, channel_q: int) -> set[int]:
        """The compare values that are right."""
        point = self.point
        hertz = int(str(point["frequency_hz"]))
        if point["kind"] == "switch":
            above = Fraction(str(point.get("threshold_us", 1500))) * 4
            below = above - 4 * Fraction(str(point.get("hysteresis_us", 50)))
            if channel_q > above:
                self.on = True
            elif channel_q < below:
                self.on = False
            return {TOPS[hertz] if self.on != point["reverse"] else 0}
        short = SHORTENED.get(str(point["kind"]), 1)
        low = Fraction(str(point.get("minimum_us", Fraction(988, short))))
        high = Fraction(str(point.get("maximum_us", Fraction(2012, short))))
        middle = Fraction(str(point.get("centre_us", CENTRES.get(str(point["kind"]), 1500))))
        middle += Fraction(str(point.get("subtrim_us", 0)))
        deadband = Fraction(str(point.get("deadband_us", 0)))
        stick = Fraction(channel_q - 6000, 4)
        travel = max(abs(stick) - deadband, Fraction(0)) / (512 - deadband)
        if (stick < 0) != point["reverse"]:
            pulse = middle - travel * (middle - low)
        else:
            pulse = middle + travel * (high - middle)
        shortest = low if "minimum_us" in point else Fraction(800, short)
        longest = high if "maximum_us" in point else Fraction(2200, short)
        pulse = min(max(pulse, shortest), longest)
        # The interrupt counts in quarter microseconds of a servo: half of one is allowed.
        exact = pulse * STEPS[hertz]
        error = Fraction(1, 8 * short) * STEPS[hertz] + Fraction(51, 100)
        first, last = exact - error, exact + error
        return {n for n in range(int(first), int(last) + 2) if first <= n <= last}


@both_forms({"outputs": OUTPUTS})
def test_every_output_is_as_the_model_has_it(pico: Pico, form: str) -> None:
    numbers = random.Random(7)
    ends = (0, 4095, 2048, 2047, 2049, 0, 4095)
    sent: list[tuple[int, ...]] = []

    def next_frame(index: int, t_ns: float) -> bytes | None:
        if index >= 200:
            return None
        raw = tuple(numbers.randrange(4096) for _ in range(4))
        sent.append((ends[index],) * 4 if index < len(ends) else raw)
        return ghst.encode.channels(0x30, sent[-1], (128,) * 4)

    receiver = pico.fly(next_frame, 400)
    pico.board.run_for(520e6)
    models = {int(pin): Model(**point) for pin, point in OUTPUTS.items()}
    assert len(receiver.sent) == 200
    for (end_ns, _), raw in zip(receiver.sent, sent, strict=True):
        writes = [c for c in pico.compares if end_ns < c.t_ns < end_ns + 100e3]
        assert [c.slice for c in writes] == [3, 4, 5, 6]
        found = {}
        for c in writes:
            found[2 * c.slice], found[2 * c.slice + 1] = c.value & 0xFFFF, c.value >> 16
        for pin, model in models.items():
            channel = int(str(OUTPUTS[str(pin)]["channel"]))
            wanted = model.compare(6000 + raw[channel - 1] - 2048)
            assert found[pin] in wanted, (pin, raw, found[pin], wanted)


@pytest.mark.boot(NO_SENSORS | {"outputs": OUTPUTS})
def test_pulses_at_the_pins(pico: Pico) -> None:
    frame = ghst.encode.channels(0x30, (0, 2048, 4095, 0), (128,) * 4)
    pico.fly(lambda index, t: frame, 250)
    pico.board.run_for(150e6)
    assert pico.meter.last(6).width_ns == pytest.approx(2012_000, abs=200)
    assert pico.meter.last(7).width_ns == pytest.approx(1480_000, abs=200)
    # 333 Hz: a 760 us servo at its low end, 494 us and 5 % beyond; OneShot125 in the middle.
    assert pico.meter.last(10).width_ns == pytest.approx(494_000, abs=7_000)
    assert pico.meter.last(11).width_ns == pytest.approx(187_500, abs=150)
    gap = pico.meter.pulses[11][-1].rise_ns - pico.meter.pulses[11][-2].rise_ns
    assert gap == pytest.approx(1e9 / 333, rel=1e-4)
    # A switch that is on has no edges: high all the time. The other is reversed, and low is on.
    assert pico.meter.level(12) and pico.meter.level(13)
    pico.board.run_for(1)


SLOW = {"6": {"channel": 1, "slow_us_per_s": 1000, "failsafe": 1200}}


@both_forms({"outputs": SLOW, "failsafe": {"time_ms": 110}})
def test_a_slow_output_takes_its_time_but_not_in_failsafe(pico: Pico, form: str) -> None:
    frames = [ghst.encode.channels(0x30, (raw,) * 4, (128,) * 4) for raw in (48, 4048)]
    stick = 0
    receiver = pico.fly(lambda index, t: frames[stick], 250)
    pico.board.run_for(100e6)
    assert pico.meter.last(6).width_ns == pytest.approx(1_000_000, abs=200)
    stick = 1
    begun = pico.board.now_ns
    pico.board.run_for(500e6)
    for pulse in pico.meter.since(begun + 60e6, 6):
        # The width is what was written in the period before.
        wanted = 1_000_000 + (pulse.rise_ns - begun) / 1000
        assert wanted - 25_000 <= pulse.width_ns <= wanted + 5_000
    receiver.stop()
    pico.board.run_for(200e6)
    assert pico.meter.last(6).width_ns == pytest.approx(1_200_000, abs=200)
    pico.fly(lambda index, t: frames[1], 250)
    pico.board.run_for(60e6)
    assert 1_200_000 < pico.meter.last(6).width_ns < 1_265_000


MOTOR = {
    "6": {"channel": 3, "motor": True, "minimum_us": 1000, "maximum_us": 1900},
    "7": {"channel": 2},
}
ARMING = {"channel": 5, "throttle_channel": 3}


@both_forms({"outputs": MOTOR, "arming": ARMING, "failsafe": {"time_ms": 110}})
def test_a_motor_needs_the_throttle_low_and_then_the_arm_channel_high(
    pico: Pico, form: str
) -> None:
    throttle = arm = 0

    def frame(index: int, t_ns: float) -> bytes:
        return bytes(
            ghst.encode.channels(0x30, (2048, 2048, 4048 if throttle else 48, 2048), (arm,) * 4)
        )

    def width_us(low: int, high: int) -> float:
        nonlocal throttle, arm
        throttle, arm = low, high
        pico.board.run_for(60e6)
        return float(round(pico.meter.last(6).width_ns / 1000))

    receiver = pico.fly(frame, 250)
    assert width_us(1, 253) == 1000  # switched on with both high
    assert width_us(0, 253) == 1000
    assert width_us(1, 253) == 1000
    assert width_us(1, 3) == 1000
    assert width_us(1, 253) == 1000  # the throttle was high when it was armed
    assert width_us(1, 3) == 1000
    assert width_us(0, 253) == 1000  # it came down no sooner than the arm channel rose
    assert width_us(0, 3) == 1000
    assert width_us(0, 253) == 1012  # armed: this is 12 us above the low end
    assert width_us(1, 253) == 1891
    assert width_us(1, 3) == 1000
    assert width_us(0, 3) == 1000
    assert width_us(0, 253) == 1012
    assert width_us(1, 253) == 1891
    receiver.stop()
    pico.board.run_for(200e6)
    assert round(pico.meter.last(6).width_ns / 1000) == 1000
    assert not pico.meter.since(pico.at(-40e6), 7)
    pico.fly(frame, 250)
    assert width_us(1, 253) == 1000  # not again by itself


WEAK = {"time_ms": 110, "minimum_lq_percent": 40}


@both_forms({"outputs": {"7": {"reverse": True}}, "failsafe": WEAK})
def test_a_weak_link_is_no_link(pico: Pico, form: str) -> None:
    lq = 80
    stick = 48

    def frame(index: int, t_ns: float) -> bytes:
        return bytes(ghst.encode.link_data(0x33, (stick,) * 4, lq=lq, rssi_dbm=-70))

    pico.fly(frame, 250)
    pico.board.run_for(60e6)
    assert round(pico.meter.last(6).width_ns / 1000) == 1000
    lq, stick = 39, 4048
    pico.board.run_for(60e6)
    assert round(pico.meter.last(6).width_ns / 1000) == 1000
    pico.board.run_for(150e6)
    assert pico.no_pulses_since(pico.at(-40e6))
    text = pico.reply_to_enter()
    assert "link: failsafe" in text
    # 210 ms at 250 Hz, and what the reply took.
    weak = int(text.partition("weak link, left out: ")[2].split()[0])
    assert 52 <= weak <= 65
    lq = 40
    pico.board.run_for(60e6)
    assert round(pico.meter.last(6).width_ns / 1000) == 2000


PLAIN = {
    "6": {"failsafe": "hold"},
    "7": {"failsafe": 1100},
    "8": {"failsafe": "none"},
    "10": {"failsafe": 1200},
}


@both_forms({"outputs": PLAIN, "failsafe": WEAK})
def test_a_weak_link_moves_no_plain_output_either(pico: Pico, form: str) -> None:
    low, high = (ghst.encode.channels(0x30, (raw,) * 4, (128,) * 4) for raw in (48, 4048))
    strong, weak = (ghst.encode.link_data(0x33, (48,) * 4, lq=lq) for lq in (80, 39))
    pair = (weak, weak)
    pico.fly(lambda index, t: pair[index % 2], 250)
    pico.board.run_for(10e6)
    pair = (weak, high)
    pico.board.run_for(60e6)

    def widths_us() -> list[int]:
        found = []
        for pin in (6, 7, 8, 10):
            pulses = pico.meter.since(pico.at(-45e6), pin)
            found.append(round(pulses[-1].width_ns / 1000) if pulses else 0)
        return found

    assert widths_us() == [0, 0, 0, 0]
    pair = (strong, strong)
    pico.board.run_for(60e6)
    assert widths_us() == [1000, 1000, 1000, 0]
    pair = (low, strong)
    pico.board.run_for(60e6)
    assert widths_us() == [1000, 1000, 1000, 1500]
    # What weak frames say is heard, and obeyed by nothing: neither now, nor in failsafe.
    pair = (weak, weak)
    pico.board.run_for(10e6)
    pair = (weak, high)
    pico.board.run_for(60e6)
    assert widths_us() == [1000, 1000, 1000, 1500]
    pico.board.run_for(150e6)
    assert widths_us() == [1000, 1100, 0, 1200]
    # Channel 5, which weak frames have brought, is not back with a frame that has 1 to 4 alone.
    pair = (strong, strong)
    pico.board.run_for(80e6)
    assert widths_us() == [1000, 1000, 1000, 1200]
    pair = (low, strong)
    pico.board.run_for(80e6)
    assert widths_us() == [1000, 1000, 1000, 1500]


@pytest.mark.run(options="failsafe_ms=110, link_limits=(40, None), failsafe={6: 4400}")
def test_a_weak_frame_that_meets_the_tick_does_not_undo_failsafe(pico: Pico) -> None:
    pico.wire.send(ghst.encode.link_data(0x33, (48,) * 4, lq=80), pico.at(1e6))
    pico.board.run_for(2e6)
    weak = ghst.encode.link_data(0x33, (4048,) * 4, lq=39)
    pico.wire.send(weak, pico.at(1e6))
    pico.board.run_for(106e6)
    compares = len(pico.compares)

    def failsafe_ns() -> float:
        pico.board.run_for(15e6)
        assert [write.value & 0xFFFF for write in pico.compares[compares:][:1]] == [3520]
        return pico.compares[compares].t_ns

    def meet(end_ns: float) -> int:
        pico.wire.send(weak, end_ns - 14e6 / 42)
        pico.board.run_for(20e6)
        assert pico.control("LINK") == 2
        return pico.board.read32(0x40050000 + 3 * 0x14 + 0x0C) & 0xFFFF

    written_ns = in_child(failsafe_ns)
    # 1100 us; from well before the tick to behind what it raises.
    found = [in_child(partial(meet, written_ns - 60e3 + 1e3 * n)) for n in range(70)]
    assert found == [3520] * 70


@pytest.mark.run(options="link_limits=(40, None)", servos={})
def test_a_weak_link_is_none_without_outputs_either(pico: Pico) -> None:
    links = []
    for lq in (39, 40):
        pico.wire.send(ghst.encode.link_data(0x33, (48,) * 4, lq=lq), pico.at(1e6))
        pico.board.run_for(2e6)
        links.append(pico.control("LINK"))
    assert links == [0, 1]


SLOWEST_LINK = {"6": {"kind": "oneshot125", "slow_us_per_s": 10_000}}


@both_forms({"outputs": SLOWEST_LINK})
def test_a_fast_limited_output_takes_a_long_step_the_right_way(pico: Pico, form: str) -> None:
    low, high = (ghst.encode.channels(0x30, (raw,) * 4, (128,) * 4) for raw in (48, 4048))
    pico.wire.send(low, pico.at(1e6))
    pico.wire.send(high, pico.at(105e6))
    pico.board.run_for(150e6)
    # 125 and 250 us at 0.3125 us; the difference and the step together have more than 31 bits.
    assert [write.value & 0xFFFF for write in pico.compares if write.slice == 3] == [400, 800]


# Everything that an output can have at once, on eight outputs, motors that run among them.
EVERYTHING = {
    "minimum_us": 1100,
    "centre_us": 1480,
    "maximum_us": 1950,
    "subtrim_us": 10,
    "deadband_us": 12,
    "slow_us_per_s": 2000,
}
WORST: dict[str, object] = {
    "outputs": {
        str(6 + n): EVERYTHING | {"channel": 1 + n, "motor": n > 3, "reverse": n < 4}
        for n in range(8)
    },
    "arming": {"channel": 9, "throttle_channel": 10},
    "failsafe": {"minimum_lq_percent": 1, "minimum_rssi_dbm": -120},
}


@pytest.mark.parametrize("form", ["thumb", "viper"])
def test_the_whole_set_costs_little_more_than_plain_outputs(pico: Pico, form: str) -> None:
    numbers = random.Random(11)
    values = [[numbers.randrange(48, 4049) for _ in range(4)] for _ in range(120)]
    aux = [[numbers.randrange(3, 254) for _ in range(4)] for _ in range(120)]

    def next_frame(index: int, t_ns: float) -> bytes | None:
        if index < 3:
            # Armed: the throttle is low, and the arm channel was.
            arm = 253 if index == 2 else 3
            return bytes(ghst.encode.channels(0x31, (2048,) * 4, (arm, 3, 128, 128)))
        if index >= 120:
            return None
        if index % 3 == 0:
            return bytes(ghst.encode.link_data(0x33, values[index], lq=99, rssi_dbm=-60))
        return bytes(ghst.encode.channels(0x30, values[index], aux[index]))

    def latest_us(configuration: dict[str, object], files: dict[str, bytes | None]) -> float:
        pico.boot(NO_SENSORS | configuration, files=files)
        receiver = pico.fly(next_frame, 400)
        pico.board.run_for(310e6)
        delays = pico.latencies_us(receiver)[3:]
        assert len(delays) == 117
        return max(delay or 1e9 for delay in delays)

    if form == "viper":
        # No core that runs this form has such a limit, but it is not to get slower unseen.
        assert latest_us(WORST, {THUMB: None}) <= LIMIT_VIPER_US
        return
    plain = latest_us({}, {})
    shaped = latest_us(WORST, {})
    # The motors run: none is at its minimum and stays there.
    widths = {round(pulse.width_ns / 1e3) for pulse in pico.meter.pulses[13]}
    assert max(widths) > 1200
    assert plain + 5 < shaped <= plain + MORE_US
