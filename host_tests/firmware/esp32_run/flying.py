"""Frames in, pulses out: what the outputs of an ESP32 do."""

import json

from esp32_run.bench import Bench

# What a frame can carry exactly: primaries in quarters, auxiliaries in fours of a microsecond.
CHANNELS = [3952, 4463, 6001, 8047, 4224, 4992, 6016, 8032] + [6000] * 8


def _defaults(tree):
    """Returns the outputs of this board, by channel."""
    with open(tree + "/board.json") as file:
        outputs = json.load(file)["defaults"]["outputs"]
    return sorted([int(pin) for pin in outputs], key=lambda pin: outputs[str(pin)]["channel"])


def _step_us(chip, hertz=50):
    """The steps of a duty: MicroPython has 16 bits of it, the S3 and the C3 have 14."""
    return 1e6 / hertz / (1 << 16 if chip == "esp32" else 1 << 14)


def _check(what, us, step_us):
    """Asserts pulses of the width in `us`, to half a step of the timer."""
    assert what[0] == "pulses", (what, us)
    assert abs(what[1] - us) <= step_us * 0.501, (what, us, step_us)


def each_channel(tree, machine, chip):
    """Every output has the pulses of its channel from the first frame on, and no others."""
    pins = _defaults(tree)
    bench = Bench(tree, machine, chip)
    bench.fly(400, 700, CHANNELS)
    bench.run(700)
    assert f"MicroPython 1.25.0\nwire GP{bench.board.wire_pad}, servos " in bench.said, bench.said
    assert bench.said.endswith("watchdog paused. Start again: main()\n")
    for pin, pulse in zip(pins, CHANNELS):
        seen = bench.board.pad(pin).since(0)
        # Low as soon as the application has it, before the first frame and at the end.
        assert seen[:2] + seen[3:] == ["input", 0, 0], (pin, seen)
        _check(seen[2], pulse / 4, _step_us(chip))
        # The divider of LEDC is in 256ths.
        assert abs(seen[2][2] / 20_000 - 1) < 0.001
    assert bench.board.lost_callbacks == bench.board.resets == 0
    assert bench.board.collisions == []


def every_pulse_width(tree, machine, chip):
    """The pulse follows the stick over its whole range, at 50 Hz and at 400 Hz."""
    pins = _defaults(tree)[:4]
    outputs = {str(pin): {"channel": number + 1} for number, pin in enumerate(pins)}
    for pin in pins[1:]:
        outputs[str(pin)]["frequency_hz"] = 400
    outputs[str(pins[2])]["kind"] = "oneshot125"
    outputs[str(pins[3])]["kind"] = "servo_760"
    bench = Bench(tree, machine, chip, {"outputs": outputs})
    sticks = list(range(3952, 8048, 256))
    sticks += (8047, 4001, 4002, 4003, 7999)
    shown = []
    for number, pulse in enumerate(sticks):
        bench.fly(400 + 50 * number, 402 + 50 * number, [pulse] * 16)
        bench.at(
            449 + 50 * number, lambda: shown.append([bench.board.pad(pin).now for pin in pins])
        )
    bench.run(400 + 50 * len(sticks))
    assert len(shown) == len(sticks)
    for pulse, (servo, fast, oneshot, narrow) in zip(sticks, shown):
        _check(servo, pulse / 4, _step_us(chip))
        _check(fast, pulse / 4, _step_us(chip, 400))
        _check(oneshot, pulse / 32, _step_us(chip, 400))
        # 760 us in the middle, in eighths of a microsecond.
        gain = (246 if pulse > 6000 else 266) / 2048
        _check(narrow, 760 + (pulse - 6000) * gain, _step_us(chip, 400) + 0.125)
    assert abs(shown[0][1][2] / 2500 - 1) < 0.001


def every_frequency(tree, machine, chip):
    """Every width that there is, at every frequency, is counted to half a step of LEDC."""
    from esp32_model.ledc import LedcTimer

    bench = Bench(tree, machine, chip)
    from firmware.ledc import _unit

    for most_bits in (20, 14):
        for hertz in range(50, 401):
            timer = LedcTimer(bench.board, hertz, most_bits)
            unit, shift = _unit(hertz, most_bits)
            step_us = timer.step_us * (1 << max(0, timer.bits - 16))
            for pulse in range(3200, 8801, 175):
                duty = (pulse * 5120 + (unit >> 1)) // unit << shift
                assert 0 < duty < 65536
                bits = timer.bits
                counts = duty << bits - 16 if bits > 16 else duty >> 16 - bits
                assert abs(counts * timer.step_us - pulse / 4) <= step_us * 0.5001
            assert abs(timer.period_us * hertz / 1e6 - 1) < 0.002


def limits(tree, machine, chip):
    """What is beyond 800..2200 us is not given."""
    pin = _defaults(tree)[0]
    bench = Bench(tree, machine, chip)
    shown = []
    for number, kind in enumerate((0x10, 0x30)):
        for index, raw in enumerate((0, 4095)):
            at_ms = 400 + 100 * number + 50 * index
            frame = bench.frame(kind, raw)
            bench.board.send(frame, 1000.0 * at_ms)
            bench.at(at_ms + 48, lambda: shown.append(bench.board.pad(pin).now))
    bench.run(620)
    for what, us in zip(shown, (880.0, 2159.5, 988.0, 2011.75)):
        _check(what, us, _step_us(chip))


def shaped_outputs(tree, machine, chip):
    """End points, reverse, speed and switches: the same algorithm as on the other chips."""
    pins = _defaults(tree)
    bench = Bench(
        tree,
        machine,
        chip,
        {
            "outputs": {
                str(pins[0]): {"reverse": True},
                str(pins[1]): {"minimum_us": 1100, "maximum_us": 1900},
                str(pins[2]): {"slow_us_per_s": 1000},
                str(pins[3]): {"kind": "switch", "failsafe": "on"},
                str(pins[4]): {"kind": "switch", "reverse": True},
            },
            "failsafe": {"time_ms": 110},
        },
    )
    board = bench.board
    board.now_us = 2.0**30 - 650_000  # the clock wraps while the slow output moves
    start = board.now_us / 1000
    low, high = [3952] * 16, [8047] * 16
    shown = []
    for after_ms in (399, 499, 549, 649, 799, 1199):
        bench.at(start + after_ms, lambda: shown.append([board.pad(pin).now for pin in pins[:5]]))
    bench.fly(start + 400, start + 500, low)
    bench.fly(start + 500, start + 1000, high)
    bench.run(start + 1200)
    nothing, before, soon, later, last, lost = shown
    # A reversed switch is on while its channel is low, and off before it has come.
    assert nothing == [0, 0, 0, 0, 0], nothing
    step_us = _step_us(chip)
    _check(before[0], 2012, step_us)
    _check(before[1], 1100, step_us)
    _check(before[2], 988, step_us)
    assert before[3:] == [0, 1]
    _check(soon[0], 988.25, step_us)
    _check(soon[1], 1899.75, step_us)
    assert soon[3:] == [1, 0]
    # 1000 us a second, with a frame each 4 ms and a pulse each 20 ms.
    for what, us in ((soon, 988 + 36), (later, 988 + 136), (last, 988 + 286)):
        assert us - 14 <= what[2][1] <= us + 14, (what, us)
    assert lost == [0, 0, 0, 1, 0], lost
