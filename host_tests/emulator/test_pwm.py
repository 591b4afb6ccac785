"""PWM at the pin, to the nanosecond (RP2040 datasheet, section 4.5)."""

from itertools import pairwise

import pytest

from ghst_tools.emulator import Board, Pulse, PulseMeter

PIN_A, PIN_B = 6, 7  # slice 3
FUNCTION_PWM = 4
SLICE = 0x40050000 + 3 * 0x14
CSR, DIV, CTR, CC, TOP = SLICE, SLICE + 0x4, SLICE + 0x8, SLICE + 0xC, SLICE + 0x10
EN = 0x400500A0
CYCLE_NS = 8


@pytest.fixture
def meter(board: Board) -> PulseMeter:
    for pin in (PIN_A, PIN_B):
        board.write32(0x40014004 + 8 * pin, FUNCTION_PWM)
    board.write32(DIV, 1 << 4)
    board.write32(TOP, 9999)  # 80 us
    return PulseMeter(board, (PIN_A, PIN_B))


def test_pulses_have_exactly_the_compare_value_and_the_period(board: Board, meter: PulseMeter):
    board.write32(CC, 2500 << 16 | 1000)
    start = board.now_ns
    board.write32(CSR, 1)
    board.run_for(400_000)
    period = 10_000 * CYCLE_NS
    assert meter.pulses[PIN_A] == [Pulse(start + n * period, 8_000) for n in range(5)]
    assert meter.pulses[PIN_B] == [Pulse(start + n * period, 20_000) for n in range(5)]


def test_fractional_divider_spreads_its_fraction_over_the_steps(board: Board, meter: PulseMeter):
    board.write32(DIV, 38 << 4 | 3)  # 38.1875, what MicroPython takes for 50 Hz
    board.write32(TOP, 65464)
    board.write32(CC, 4910)
    board.write32(CSR, 1)
    board.run_for(50e6)
    # ceil(4910 * 38.1875) and ceil(65465 * 38.1875) system clocks
    assert [pulse.width_ns for pulse in meter.pulses[PIN_A]] == [187_501 * 8] * 3
    rises = [pulse.rise_ns for pulse in meter.pulses[PIN_A]]
    assert [rises[1] - rises[0], rises[2] - rises[1]] == [2_499_945 * 8] * 2


def test_compare_zero_gives_no_pulse_and_beyond_top_a_constant_high(
    board: Board, meter: PulseMeter
):
    board.write32(CC, 10_000 << 16)
    board.write32(CSR, 1)
    edges: list[float] = []
    for pin in (PIN_A, PIN_B):
        board.pin(pin).watch(lambda t_ns, level: edges.append(t_ns))
    board.run_for(1e6)
    assert edges == []
    assert (board.pin(PIN_A).level, board.pin(PIN_B).level) == (False, True)


@pytest.mark.parametrize("at_ns", [4_000, 8_800, 40_000])
@pytest.mark.parametrize("new", [500, 1_000, 4_000])
def test_a_new_compare_value_takes_effect_at_the_wrap(
    board: Board, meter: PulseMeter, at_ns: int, new: int
):
    board.write32(CC, 1_000)
    board.write32(CSR, 1)
    board.run_for(at_ns)
    board.write32(CC, new)
    assert board.read32(CC) == new
    board.run_for(230_000 - at_ns)
    widths = [pulse.width_ns for pulse in meter.pulses[PIN_A]]
    assert widths == [8_000, new * CYCLE_NS, new * CYCLE_NS]


def test_a_new_top_takes_effect_at_the_wrap(board: Board, meter: PulseMeter):
    board.write32(CC, 1_000)
    board.write32(CSR, 1)
    board.run_for(16_000)
    board.write32(TOP, 1_999)
    board.run_for(120_000)
    rises = [pulse.rise_ns for pulse in meter.pulses[PIN_A]]
    assert [later - rise for rise, later in pairwise(rises)][:2] == [
        80_000,
        16_000,
    ]


def test_a_disabled_slice_takes_values_at_once_and_keeps_its_outputs(
    board: Board, meter: PulseMeter
):
    board.write32(CC, 1_000)
    board.write32(CSR, 1)
    board.run_for(4_000)
    stopped = board.read32(CTR)
    board.write32(CSR, 0)
    board.run_for(1e6)
    assert board.pin(PIN_A).level is True  # frozen high: the trap of PWM.deinit()
    assert board.read32(CTR) == stopped
    board.write32(CC, 2_000)
    board.write32(CSR, 1)
    board.run_for(80_000)
    assert meter.pulses[PIN_A][0].width_ns == 4_000 + 1e6 + (2_000 - stopped) * CYCLE_NS


def test_rewriting_the_same_control_value_does_not_move_the_pulse(board: Board, meter: PulseMeter):
    board.write32(DIV, 100 << 4)
    board.write32(CC, 1_000)
    board.write32(CSR, 1)
    for _ in range(100):
        board.run_for(4_567)
        board.write32(CSR, 1)
    board.run_for(1e6)
    assert meter.pulses[PIN_A][0].width_ns == 1_000 * 100 * CYCLE_NS


def test_enable_register_reads_back_and_starts_slices_together(board: Board, meter: PulseMeter):
    other = PulseMeter(board, (8,))
    board.write32(0x40014004 + 8 * 8, FUNCTION_PWM)
    for offset, value in ((0x4, 1 << 4), (0x10, 9999), (0xC, 1_000)):
        board.write32(SLICE + offset, value)
        board.write32(SLICE + 0x14 + offset, value)
    board.write32(EN, 0x18)
    assert board.read32(EN) == 0x18
    board.run_for(50_000)
    assert other.pulses[8] == meter.pulses[PIN_A] != []


def test_phase_correct_pulses_are_centred_on_zero(board: Board, meter: PulseMeter):
    board.write32(CC, 1_000)
    board.write32(CSR, 1 | 1 << 1)
    start = board.now_ns
    board.run_for(400_000)
    period = 2 * 9_999 * CYCLE_NS
    first, second = meter.pulses[PIN_A][:2]
    assert first == Pulse(start, 8_000)  # begins in the middle
    assert second == Pulse(start + period - 999 * CYCLE_NS, (999 + 1_000) * CYCLE_NS)


def test_wrap_interrupt_is_raised_and_cleared(board: Board, meter: PulseMeter):
    board.write32(CSR, 1)
    board.run_for(79_000)
    assert board.read32(0x400500A4) == 0
    board.run_for(2_000)
    assert board.read32(0x400500A4) == 1 << 3
    board.write32(0x400500A4, 1 << 3)
    assert board.read32(0x400500A4) == 0


def test_micropython_servo_pulse(board: Board):
    meter = PulseMeter(board, (PIN_A,))
    board.exec("from machine import Pin, PWM\np = PWM(Pin(6), freq=50, duty_ns=1500000)")
    board.run_for(60e6)
    meter.pulses[PIN_A].clear()
    board.run_for(100e6)
    # One step of MicroPython's 50 Hz is 38.1875 system clocks, 0.3055 us.
    assert [pulse.width_ns for pulse in meter.pulses[PIN_A]] == [1_500_008] * 5
