"""A control path that is broken in flight: what the outputs do until the reset, and after it.

The receiver sends all the time. A little after the fault its frames have other channels for half a
second, which tells whether they still reach the outputs; then those of before again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

from ghst_tools.campaign.model import Model
from ghst_tools.campaign.outputs import COUNT_NS, moving
from ghst_tools.campaign.pico import FAILSAFE_NS, PERIOD_NS, SERVOS, Pico, steps
from ghst_tools.campaign.picos import check_outputs
from ghst_tools.campaign.verdict import equal, expect
from ghst_tools.emulator.meters import Pulse

_RATE_HZ = 250
_BEFORE_NS = 100e6
_OTHERS_NS = (30e6, 0.55e9)  # by then a console command has been obeyed
_TICK_NS = 10e6
_RESET_NS = (0.9e9, 1.15e9)
_AGAIN_NS = 650e6
_LOOK_NS = 100e6
# No two channels are alike, in one of them or between the two.
_FRAME, _OTHER = moving(0), moving(5)

# What the outputs do from the fault to the reset.
FAILSAFE = "failsafe"
"""They hold the last channels until failsafe, then there are no pulses."""
SWITCHED_OFF = "switched off"
"""The same, but the tick has to switch them off, which it does one tick later."""
FOLLOWING = "following"
"""They follow the frames as if nothing were."""
HOLDING = "holding"
"""They hold the last channels."""

_PIO0_CTRL, _PIO0_INTE, _PIO1_CTRL, _DMA_ABORT = 0x50200000, 0x5020012C, 0x50300000, 0x50000444
_WIRE_MACHINE, _TICK_MACHINE = 1 << 0, 1 << 3


def _write(address: int, value: int) -> Callable[[Pico], None]:
    return lambda pico: pico.board.write32(address, value)


def _clear(address: int, bit: int) -> Callable[[Pico], None]:
    def act(pico: Pico) -> None:
        value = pico.board.read32(address)
        expect(bool(value & bit), f"bit {bit:#x} of {address:#x} is not set: {value:#x}")
        pico.board.write32(address, value & ~bit)

    return act


@dataclass(frozen=True)
class Reset:
    """A fault that the watchdog ends, how it is brought about, and what the outputs do then."""

    what: str
    done: str
    outputs: str
    break_it: Callable[[Pico], None]


RESETS = (
    Reset(
        "hard tick starved",
        "its state machine stopped",
        FOLLOWING,
        _clear(_PIO1_CTRL, _TICK_MACHINE),
    ),
    Reset(
        "hard tick and telemetry stopped",
        "the state machines of their PIO block stopped",
        FOLLOWING,
        _write(_PIO1_CTRL, 0),
    ),
    Reset(
        "receiver stopped",
        "its state machine stopped",
        FAILSAFE,
        _clear(_PIO0_CTRL, _WIRE_MACHINE),
    ),
    Reset("frame interrupt off", "masked in the PIO block", SWITCHED_OFF, _write(_PIO0_INTE, 0)),
    Reset("DMA stopped", "all channels aborted", FAILSAFE, _write(_DMA_ABORT, 0xFFF)),
    Reset(
        "interrupts off for ever",
        "by a user's code",
        HOLDING,
        lambda pico: pico.board.console.write(b"fault deaf_for_ever\r"),
    ),
)


def _due(frame: bytes, pin: int) -> int:
    """The pulse on a pin that a frame asks for, in counts of the PWM."""
    model = Model()
    model.feed(frame)
    return steps(model.pulses[SERVOS[pin] - 1])


def _counts(pulse: Pulse) -> int:
    return round(pulse.width_ns / COUNT_NS)


def _widths(pulses: list[Pulse]) -> set[int]:
    return {_counts(pulse) for pulse in pulses}


def _steady(pulses: list[Pulse], begin_ns: float, pin: int) -> None:
    """None is missing from `begin_ns` to the last of them."""
    times = [begin_ns, *(pulse.rise_ns for pulse in pulses)]
    longest = max(later - sooner for sooner, later in pairwise(times))
    expect(longest < PERIOD_NS + 1e3, f"{longest / 1e6} ms without a pulse on GP{pin}")


def _until_reset(pico: Pico, broken: float, at: float, outputs: str) -> str:
    """What all pins did from the fault to the reset, which cuts a pulse that is under way."""
    late = PERIOD_NS + (2 if outputs == SWITCHED_OFF else 1) * _TICK_NS
    lasted, others, cut = [], [], 0
    for pin in SERVOS:
        found = [pulse for pulse in pico.meter.since(broken, pin) if pulse.rise_ns < at]
        whole = [pulse for pulse in found if pulse.rise_ns + pulse.width_ns < at - 1e3]
        cut += len(found) - len(whole)
        _steady(whole, broken, pin)
        widths = _widths(whole)
        last = whole[-1].rise_ns - broken
        lasted.append(last)
        if outputs == FOLLOWING:
            both = {_due(_FRAME, pin), _due(_OTHER, pin)}
            equal(widths, both, f"pulses on GP{pin} after the fault")
            others += [p for p in whole if _counts(p) == _due(_OTHER, pin)]
            equal(_counts(whole[-1]), _due(_FRAME, pin), f"the last pulse on GP{pin}")
        else:
            equal(widths, {_due(_FRAME, pin)}, f"pulses on GP{pin} after the fault")
        if outputs in (FOLLOWING, HOLDING):
            expect(at - broken - last < PERIOD_NS + 2.2e6, f"GP{pin}: no pulse before the reset")
        else:
            limit = FAILSAFE_NS + late
            expect(FAILSAFE_NS - PERIOD_NS < last < limit, f"last on GP{pin}: {last / 1e6} ms")
            expect(found == whole, f"GP{pin} was high at the reset")
    if outputs == FOLLOWING:
        times = [pulse.rise_ns - broken for pulse in others]
        limit = _OTHERS_NS[1] + PERIOD_NS + 2 * 1e9 / _RATE_HZ
        expect(max(times) < limit, f"the other channels until {max(times) / 1e6} ms")
        return (
            "until the reset all eight pins follow the frames, which have other channels for half "
            f"a second, and no pulse is missing{_cut(cut)}"
        )
    last_ms = f"{max(lasted) / 1e6:.0f} ms"
    if outputs == HOLDING:
        return (
            "until the reset all eight pins hold the last channels before the fault, without "
            f"failsafe (the last pulse {last_ms} after the fault){_cut(cut)}"
        )
    return (
        "all eight pins hold the last channels before the fault until failsafe, the last pulse "
        f"{last_ms} after the fault, then none until the reset"
    )


def _cut(count: int) -> str:
    return f", but that {count} were under way at the reset, which cuts them" if count else ""


def reset(pico: Pico, fault: Reset) -> str:
    """Break the control path in flight; the watchdog resets, and the pulses come again."""
    broken = pico.at(_BEFORE_NS)

    def frame(index: int, t_ns: float) -> bytes:
        return _OTHER if _OTHERS_NS[0] < t_ns - broken < _OTHERS_NS[1] else _FRAME

    receiver = pico.fly(frame, _RATE_HZ)
    pico.board.run_for(_BEFORE_NS)
    fault.break_it(pico)
    pico.board.run_until(lambda: bool(pico.board.resets), 1.5e9)
    at = pico.board.resets[0][0]
    expect(_RESET_NS[0] < at - broken < _RESET_NS[1], f"reset after {(at - broken) / 1e6} ms")
    meanwhile = _until_reset(pico, broken, at, fault.outputs)
    for pin in SERVOS:
        pulses = pico.meter.pulses[pin]
        pulses[:] = [pulse for pulse in pulses if pulse.rise_ns + pulse.width_ns < at - 1e3]
    pico.board.run_for(_AGAIN_NS + _LOOK_NS)
    again = []
    for pin in SERVOS:
        found = pico.meter.since(at, pin)
        expect(bool(found), f"no pulse on GP{pin} after the reset")
        equal(_widths(found), {_due(_FRAME, pin)}, f"pulses on GP{pin} after the reset")
        _steady(found, found[0].rise_ns, pin)
        expect(len(found) >= _LOOK_NS / PERIOD_NS - 1, f"{len(found)} pulses on GP{pin}")
        again.append(found[0].rise_ns - at)
    expect(max(again) < _AGAIN_NS, f"pulses {max(again) / 1e6} ms after the reset")
    equal(len(pico.board.resets), 1, "resets")
    expect(receiver.running, "the receiver has stopped")
    check_outputs(pico)
    return (
        f"the watchdog reset the chip {(at - broken) / 1e6:.0f} ms later; {meanwhile}; pulses "
        f"again on all eight pins {max(again) / 1e6:.0f} ms after it, each of its own width"
    )
