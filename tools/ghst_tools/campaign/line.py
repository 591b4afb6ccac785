"""Faults of the wire: levels that stick, glitches, slow edges, wrong speeds, second talkers."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from functools import partial

import ghst  # type: ignore[import-not-found]
from ghst import decoder
from ghst_tools.campaign.outputs import Outputs, moving, moving_link
from ghst_tools.campaign.pico import TALKING, TALKING_SETUP, Pico
from ghst_tools.campaign.picos import Picos, forked, no_exception
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.talkers import echo_missing, second_talker
from ghst_tools.campaign.verdict import Row, Trial, equal, expect
from ghst_tools.emulator.wire import BAUD
from ghst_tools.uart_bits import encode

FAILSAFE_NS = 110e6
FAILSAFE_LIMIT_NS = 130e6  # two ticks more
_BIT_NS = 1e9 / BAUD
_SHIFT_NS = 41.3
# Bytes that are not counted as those of a frame are looked at when the line was quiet for 150 us.
_QUIET_NS = 200e3
FRAME_NS = 140 * _BIT_NS

CENTRE = bytes(ghst.encode.channels(0x30, (2048,) * 4, (128,) * 4))
ENDS = bytes(ghst.encode.channels(0x30, (48, 4048, 1048, 3048), (3, 253, 64, 192)))
LINK = bytes(ghst.encode.link_data(0x13, (1984,) * 4, rf_mode=6))


def still(picos: Picos) -> Pico:
    """A board whose main loop sleeps, failsafe after 110 ms, with its watchdog on."""
    return picos.run(options="failsafe_ms=110", watchdog=True)


def talking(picos: Picos) -> Pico:
    """A board that has always a telemetry frame to send."""
    return picos.run(TALKING, setup=TALKING_SETUP)


def held(pico: Pico, level: bool, hold_ns: float) -> str:
    """Fly, have the line stuck, let it go."""
    outputs = Outputs(pico)
    receiver = pico.fly(lambda index, t: moving(index), 250)
    begun = pico.at(50.1e6)
    pico.wire.hold(level, begun, begun + hold_ns)
    pico.board.run_for(50.1e6 + hold_ns - 1e6)
    heard = [sent for sent in receiver.sent if sent.end_ns < begun]
    outputs.frames(heard)
    last = heard[-1].end_ns
    delay = pico.compares[-1].t_ns - last
    outputs.failsafe(last + FAILSAFE_NS, last + FAILSAFE_LIMIT_NS)
    outputs.check()
    equal(pico.pulses(), [0] * 16, "channels in failsafe")
    before = pico.word(decoder.FRAMES)
    released = pico.at(1e6)
    pico.board.run_for(41e6)
    sent = sum(1 for end, _ in receiver.sent if released + FRAME_NS < end < pico.at(-100e3))
    frames = pico.word(decoder.FRAMES) - before
    expect(frames >= sent >= 9, f"{frames} frames of {sent} decoded after it")
    outputs.frames([sent for sent in receiver.sent if sent.end_ns > released + FRAME_NS])
    outputs.check()
    no_exception(pico)
    return (
        f"failsafe {delay / 1e6:.1f} ms after the last frame, no pulse in it, no reset; every "
        f"frame decoded that began after it and written to the outputs, {outputs.shown()}"
    )


def glitches(pico: Pico, width_ns: float, count: int, seed: int) -> str:
    """Frames with a glitch somewhere; each is decoded as it was sent, or not at all."""
    rng = random.Random(seed)
    outputs = Outputs(pico)
    lost = 0
    frames = 0
    longest = 0.0
    for index in range(count):
        frame, after = moving(2 * index), moving(2 * index + 1)
        start = pico.at(1e6)
        where = rng.uniform(-10e3, FRAME_NS)
        pico.wire.glitch(start + where, width_ns)
        end = pico.wire.send(frame, start)
        pico.board.run_for(1e6 + FRAME_NS + 300e3)
        decoded = pico.word(decoder.FRAMES) - frames
        place = f"a glitch of {width_ns} ns {where:.0f} ns after the start of a frame"
        if decoded:
            longest = max(longest, pico.compares[-1].t_ns - end)
            outputs.frame(end, frame, _QUIET_NS)
        outputs.check(place)
        lost += not decoded
        outputs.frame(pico.wire.send(after, pico.at(500e3)), after)
        pico.board.run_for(500e3 + FRAME_NS + 200e3)
        frames += decoded + 1
        equal(pico.word(decoder.FRAMES), frames, f"{place}: frames with the next")
        outputs.check(f"{place}, and the next")
    outputs.finish()
    return (
        f"{lost} of {count} frames lost, none decoded as another one, the next always decoded; "
        f"those decoded written to the outputs at most {longest / 1e3:.0f} us behind their end, "
        f"{outputs.shown()}"
    )


def slow_edges(pico: Pico, late_ns: float, rising: bool, count: int) -> str:
    """Frames whose rising or falling edges come late."""
    outputs = Outputs(pico)
    for index in range(count):
        start = pico.at(1e6 + 37.3 * index)
        frame = moving(index)
        levels, end = encode(frame, start, BAUD)
        late = [(t + late_ns if level is rising else t, level) for t, level in levels]
        pico.wire.play(late, end + late_ns)
        outputs.frame(end, frame)
        pico.board.run_for(2e6)
    equal(pico.word(decoder.FRAMES), count, "frames decoded")
    equal(pico.word(decoder.CRC_ERRORS), 0, "CRC errors")
    outputs.finish()
    return f"all {count} decoded and written to the outputs, {outputs.shown()}"


def off_rate(pico: Pico, baud: float, count: int) -> str:
    """Frames at another baud rate, each a little later against the clock of the chip."""
    outputs = Outputs(pico)
    for index in range(count):
        frame = moving(index)
        end = pico.wire.send(frame, pico.at(1.7e6 + _SHIFT_NS * index), baud=baud)
        outputs.frame(end, frame)
        pico.board.run_for(2.4e6)
    equal(pico.word(decoder.FRAMES), count, f"frames decoded at {baud} baud")
    equal(pico.word(decoder.SKIPPED_BYTES), 0, f"bytes skipped at {baud} baud")
    outputs.finish()
    return f"all {count} decoded and written to the outputs, {outputs.shown()}"


def doubled(pico: Pico, pause_us: float, count: int) -> str:
    """Each frame comes twice; telemetry follows the second."""
    outputs = Outputs(pico)
    ends = []
    for index in range(count):
        frame = moving_link(index)
        end = pico.wire.send(frame, pico.at(100e3))
        outputs.frame(end, frame)
        end = pico.wire.send(frame, end + pause_us * 1e3)
        outputs.frame(end, frame)
        ends.append(end)
        pico.board.run_for(end + 3e6 - pico.board.now_ns)
    equal(pico.word(decoder.FRAMES), 2 * count, "frames decoded")
    equal(pico.control("COLLISIONS"), 0, "collisions")
    starts = [byte.t_ns for byte in pico.wire.decode()][::14]
    equal(len(starts), count, "telemetry frames")
    late = [(start - end) / 1e3 for start, end in zip(starts, ends, strict=True)]
    expect(min(late) > 990 and max(late) < 1010, f"telemetry {late} us behind the second frame")
    outputs.finish()
    return (
        f"both decoded {count} times and written to the outputs, {outputs.shown()}; one telemetry "
        "frame each time, 1000 us behind the second"
    )


def trials(setting: Setting) -> Iterator[tuple[str, Trial]]:
    """The trials, by name."""
    effort, seed = setting.effort, setting.seed

    def trial(
        fault: str, done: str, start: Callable[[Picos], Pico], act: Callable[[Pico], str]
    ) -> tuple[str, Trial]:
        def run() -> list[Row]:
            pico = start(setting.picos)
            return [Row(fault, done, forked(lambda: act(pico)))]

        return f"{fault}, {done}", run

    for level, name in ((False, "low"), (True, "high")):
        for hold_ms in (200, 2000):
            act = partial(held, level=level, hold_ns=hold_ms * 1e6)
            yield trial(f"line stuck {name}", f"in flight, for {hold_ms} ms", still, act)
    for width_ns in (10, 50, 100, 200):
        act = partial(glitches, width_ns=width_ns, count=effort.glitches, seed=seed)
        yield trial("glitches", f"{width_ns} ns, one anywhere in each frame", still, act)
    for late_ns in (300, 600, 900):
        for rising, name in ((True, "rising"), (False, "falling")):
            act = partial(slow_edges, late_ns=late_ns, rising=rising, count=effort.line_frames)
            yield trial("slow edges", f"all {name} edges {late_ns} ns late", still, act)
    for share in (-2.5, -1.25, 1.25, 2.5):
        act = partial(off_rate, baud=BAUD * (1 + share / 100), count=effort.line_frames)
        done = f"by {share:+} % of {BAUD}, each frame {_SHIFT_NS} ns later in the chip's clock"
        yield trial("baud rate off", done, still, act)
    act = partial(second_talker, count=effort.talks, seed=seed)
    done = (
        f"{effort.talks} times 1 to 14 bytes that are no valid frame, from 0.9 to 1.4 ms behind a "
        "frame on"
    )
    yield trial("second talker in our slot", done, talking, act)
    for pause_us in (0, 20, 500, 900):
        act = partial(doubled, pause_us=pause_us, count=effort.line_frames)
        yield trial("receiver doubles its frames", f"{pause_us} us apart", talking, act)
    act = partial(echo_missing, count=effort.line_frames)
    done = (
        f"{effort.line_frames} times the pin's input cut off while a telemetry frame is sent, the "
        "next frame 1.7 to 2 ms behind the last"
    )
    yield trial("echo missing", done, talking, act)
