"""Failsafe, arming, the watchdog and what can go wrong."""

import sys
from array import array

import micropython

import ghst
from esp32_run.bench import Bench

PINS = (32, 33, 25, 26, 27)  # esp32_devkit: channels 1 to 5
HIGH = [7000] * 16
MIDDLE = [6000] * 16
QUICK = {"time_ms": 110}


def _bench(tree, machine, chip, configuration=None, user=None):
    values = {"failsafe": QUICK}
    values.update(configuration or {})
    return Bench(tree, machine, chip, values, user)


def _width_us(what):
    return round(what[1]) if isinstance(what, tuple) else what


def _look(bench, *times_ms):
    """Returns a list that gets, at these times, what PINS show: widths in us, or levels."""
    shown = []
    for ms in times_ms:
        bench.at(ms, lambda: shown.append([_width_us(bench.board.pad(pin).now) for pin in PINS]))
    return shown


def failsafe(tree, machine, chip):
    """Each output does in failsafe what it is told, and comes back with its own channel alone."""
    bench = _bench(
        tree,
        machine,
        chip,
        {
            "outputs": {
                "32": {"failsafe": "hold"},
                "33": {"failsafe": 1100},
                "25": {"failsafe": "none"},
                "27": {"failsafe": "hold"},
            }
        },
    )
    bench.fly(400, 500, HIGH)
    # Channels 1 to 4, and none of 5 to 8.
    bench.fly(800, 900, MIDDLE, kinds=(0x31,))
    bench.fly(950, 1000, MIDDLE)
    shown = _look(bench, 399, 499, 590, 680, 880, 995)
    bench.run(1000)
    assert shown == [
        [0, 0, 0, 0, 0],
        [1750, 1750, 1750, 1750, 1752],
        [1750, 1750, 1750, 1750, 1752],
        [1750, 1100, 0, 0, 1752],
        [1500, 1500, 1500, 1500, 1752],
        [1500, 1500, 1500, 1500, 1500],
    ], shown
    # 110 ms behind the last frame, a tick of 10 ms, and what a period of 20 ms takes.
    lost_us = [t for t, what in bench.board.pad(25).history if what == 0][1]
    assert 110_000 <= lost_us - bench.ends[24] <= 143_000
    assert "link: failsafe" in bench.said and "failsafes 1" in bench.said
    assert bench.board.resets == 0


def a_weak_link(tree, machine, chip):
    """Weak frames move nothing, plain or not, hold off no failsafe, and bring nothing back."""
    bench = _bench(
        tree,
        machine,
        chip,
        {
            "outputs": {
                "32": {"failsafe": "hold"},
                "33": {"failsafe": 1100},
                "25": {"failsafe": "none"},
                "26": {"reverse": True, "failsafe": 1200},
                "27": {"failsafe": 1300},
            },
            "failsafe": {"time_ms": 110, "minimum_lq_percent": 40},
        },
    )
    bench.fly(400, 500, MIDDLE, kinds=(0x33, 0x30))
    bench.fly(500, 800, HIGH, kinds=(0x33, 0x30), lq=39)
    bench.fly(800, 860, MIDDLE, kinds=(0x33,), lq=40)
    bench.fly(860, 900, MIDDLE, kinds=(0x33, 0x30), lq=40)
    shown = _look(bench, 499, 590, 680, 799, 855, 899)
    bench.run(900)
    assert shown == [
        [1500, 1500, 1500, 1500, 1500],
        [1500, 1500, 1500, 1500, 1500],
        [1500, 1100, 0, 1200, 1300],
        [1500, 1100, 0, 1200, 1300],
        [1500, 1500, 1500, 1500, 1300],
        [1500, 1500, 1500, 1500, 1500],
    ], shown
    assert "failsafes 1" in bench.said and bench.board.resets == 0


class _SilentPWM:
    # The model's keeps a record, which takes memory.
    def __init__(self, *arguments, **named):
        pass

    def duty_u16(self, duty):
        pass


def no_memory_is_left(tree, machine, chip):
    """Outputs are written, lost and switched off without a byte of the heap."""
    bench = _bench(tree, machine, chip)
    sys.modules["machine"].PWM = _SilentPWM
    from firmware.ledc import LedcOutputs, advance

    receiver = ghst.Receiver()
    # -1: hold. The build leaves no name for it.
    outputs = LedcOutputs({32: 1, 33: 2}, receiver, most_bits=20, failsafe={32: -1, 33: 4400})
    clock = array("I", [0xFFFFFF00])
    receiver.pulses[0] = receiver.pulses[1] = 7000
    micropython.heap_lock()
    try:
        outputs.write()
        written = outputs.shown[0]
        outputs.lose()
        outputs.write()
        advance(clock, 0x200)
        outputs.off()
    finally:
        micropython.heap_unlock()
    assert (written, list(outputs.shown), clock[0]) == (7000, [7000, 4400], 0x100)
    bench.close()


def arming(tree, machine, chip):
    """A motor stays at its minimum until armed with the throttle low, and again in failsafe."""
    bench = _bench(
        tree,
        machine,
        chip,
        {
            "outputs": {"25": {"motor": True, "minimum_us": 1000, "maximum_us": 2000}},
            "arming": {"channel": 5},
        },
    )

    def sticks(throttle, arm):
        pulses = [6000] * 16
        pulses[2], pulses[4] = throttle, arm
        return pulses

    bench.fly(400, 500, sticks(7000, 8032))  # armed too early: the throttle was never low
    bench.fly(500, 600, sticks(3952, 3952))
    bench.fly(600, 700, sticks(3952, 8032))
    bench.fly(700, 800, sticks(7000, 8032))
    bench.fly(1100, 1200, sticks(7000, 8032))
    shown = _look(bench, 395, 495, 595, 695, 795, 1050, 1195)
    bench.run(1200)
    flying = round(1500 + 1000 / 4 * 500 / 512)
    assert [pulses[2] for pulses in shown] == [0, 1000, 1000, 1000, flying, 1000, 1000], shown


STUCK = """
import time

def setup(application):
    began = time.ticks_ms()
    def stuck(now_ms):
        if {from_ms} < now_ms < {from_ms} + 100:
            while time.ticks_diff(time.ticks_ms(), began) < {to_ms}:
                time.sleep_us(200)
    application.steps.append(stuck)
"""


def main_loop_stuck(tree, machine, chip):
    """A main loop that computes for ever costs no pulse, and no failsafe either."""
    bench = _bench(tree, machine, chip, user=STUCK.format(from_ms=500, to_ms=3300))
    bench.fly(400, 900, HIGH, rate_hz=100)
    bench.fly(900, 2900, MIDDLE, rate_hz=50)
    bench.fly(3200, 3500, HIGH, rate_hz=50)
    shown = _look(bench, 895, 1000, 2895, 3100, 3300)
    bench.run(3500)
    assert [pulses[0] for pulses in shown] == [1750, 1500, 1500, 0, 1750], shown
    assert bench.board.resets == 0
    assert "main loop: stood still 1 times" in bench.said, bench.said


def main_loop_stuck_without_a_link(tree, machine, chip):
    """With no link at stake, five seconds of it cost a reset."""
    bench = _bench(tree, machine, chip, user=STUCK.format(from_ms=500, to_ms=60_000))
    board = bench.board
    bench.at(6800, lambda: bench.write_later("/user.py", b"def setup(application): pass\n"))
    bench.run(6900)
    assert board.resets == 1
    assert "restarted by the watchdog" in bench.said, bench.said
    # A second behind the last feeding, which was five behind the last round.
    assert 6450 <= board.reset_us / 1000 <= 6650, board.reset_us


COLLECT = """
import time

def setup(application):
    if {resets} == time.resets:
        def stuck(now_ms):
            if now_ms > {from_ms}:
                time.spend({us}, collecting=True)
        application.steps.append(stuck)
"""


def scheduler_stuck(tree, machine, chip):
    """Where nothing is scheduled any more the watchdog resets; then no pulses before the link."""
    user = COLLECT.format(resets=0, from_ms=600, us=5e6)
    bench = _bench(tree, machine, chip, user=user)
    board = bench.board
    bench.fly(400, 1000, HIGH, rate_hz=100)
    bench.fly(1900, 2100, MIDDLE, rate_hz=100)
    shown = _look(bench, 590, 1500, 1800, 2050)
    bench.run(2100)
    assert board.resets == 1
    assert 1600 <= board.reset_us / 1000 <= 1625, board.reset_us
    # Until the reset the hardware goes on with what it was told last, and through it; then the
    # application comes up, and has the pins low until there are frames.
    assert [pulses[0] for pulses in shown] == [1750, 1750, 0, 1500], shown
    assert "restarted by the watchdog" in bench.said


def a_long_collection(tree, machine, chip):
    """A collection of memory of half a second delays frames, and costs no reset."""
    user = COLLECT.format(resets=0, from_ms=600, us=5e5).replace(
        "time.spend", "application.steps.remove(stuck); time.spend"
    )
    bench = _bench(tree, machine, chip, user=user)
    bench.fly(400, 1300, HIGH, rate_hz=250)
    shown = _look(bench, 595, 1150, 1290)
    bench.run(1300)
    assert bench.board.resets == 0
    assert [pulses[0] for pulses in shown] == [1750] * 3, shown
    assert bench.board.lost_callbacks > 0


FAULTY = """
def setup(application):
    def faulty(now_ms):
        raise OSError(5)
    application.steps.insert(0, faulty)
"""


def exception_in_a_sensor(tree, machine, chip):
    """An exception in every round of the main loop is counted and told, and costs no pulse."""
    bench = _bench(tree, machine, chip, user=FAULTY)
    bench.fly(400, 700, HIGH)
    shown = _look(bench, 690)
    bench.run(700)
    assert shown[0][0] == 1750 and bench.board.resets == 0
    assert "faults, the last: OSError: " in bench.said, bench.said


SWITCHED_OFF = """
import time

def setup(application):
    if time.resets == 0:
        def switch_off(now_ms):
            if now_ms > 600:
                application.adapter.outputs._pwm[3].deinit()
                application.steps.remove(switch_off)
        application.steps.append(switch_off)
"""


def an_output_that_fails(tree, machine, chip):
    """An output that takes no pulse any more: all go off, the chip is reset, and flies again."""
    bench = _bench(tree, machine, chip, user=SWITCHED_OFF)
    board = bench.board
    failures = []
    board.callback_failed = failures.append
    bench.fly(400, 640, HIGH, rate_hz=100)
    bench.fly(640, 2300, MIDDLE, rate_hz=50)
    shown = _look(bench, 595, 700, 2290)
    bench.run(2300)
    assert [str(error) for error in failures] == ["PWM inactive"]
    # Channel 3, the fourth of the pins by number, is driven by nobody then.
    assert shown == [[1750] * 4 + [1752], [0, 0, "input", 0, 0], [1500] * 5], shown
    assert board.resets == 1 and "restarted by the watchdog" in bench.said


def an_output_that_fails_in_failsafe(tree, machine, chip):
    """The same when the link is lost, and no frame shows it: nothing goes on with its pulse."""
    bench = _bench(tree, machine, chip, user=SWITCHED_OFF)
    board = bench.board
    failures = []
    board.callback_failed = failures.append
    bench.fly(400, 602, HIGH, rate_hz=100)
    shown = _look(bench, 605, 760)
    bench.run(1900)
    assert [str(error) for error in failures] == ["PWM inactive"]
    assert shown == [[1750, 1750, "input", 1750, 1752], [0, 0, "input", 0, 0]], shown
    assert board.resets == 1


def a_collection_with_a_frame_in_hand(tree, machine, chip):
    """Memory is collected in the middle of a frame: the ticks that have waited then mean nothing.

    Half a second of it, and failsafe after 110 ms: with frames waiting that is no lost link.
    """
    bench = _bench(tree, machine, chip)
    board = bench.board
    bench.fly(400, 1300, HIGH, rate_hz=250)
    collected = []

    def collect():
        # The next duty that is set takes half a second, as if it had been that which allocates.
        channel = board.pad(PINS[2]).channel
        set_duty = channel.set

        def slowly(duty):
            channel.set = set_duty
            collected.append(board.now_us)
            board.spend(5e5, collecting=True)
            set_duty(duty)

        channel.set = slowly

    bench.at(395, collect)
    shown = _look(bench, 1150, 1290)
    bench.run(1300)
    assert len(collected) == 1
    assert board.resets == 0 and "failsafes 0" in bench.lines("link: ")[-1], bench.said
    assert shown == [[1750] * 4 + [1752]] * 2, shown


def broken_configuration(tree, machine, chip):
    """A configuration that cannot be moves nothing, and says why."""
    for text, reason in (
        (b"{broken", "/ghst.json is broken: no valid JSON"),
        ({"outputs": {"19": {"channel": 1}}}, "outputs.19: GPIO 19 is taken by wire.pin"),
        ({"wire": {"driver": "pio"}}, 'wire.driver is "pio", must be "uart" on an esp32'),
        ({"gps": {"uart": 1}}, "gps.uart is 1, which the Ghost wire has"),
        ({"outputs": {"34": {"channel": 1}}}, "outputs.34: GPIO 34 cannot be pwm, must be one of"),
    ):
        bench = Bench(tree, machine, chip, text)
        bench.fly(400, 500, HIGH)
        shown = _look(bench, 350, 490)
        bench.run(500)
        assert shown == [[0] * 5] * 2, shown
        assert reason in bench.said and "Nothing moves." in bench.said, bench.said
        assert "link: linked; frames" in bench.said, bench.said
        bench.close()


def the_led(tree, machine, chip):
    """On a board with a LED, that lights when low here, it tells the state."""
    bench = _bench(tree, machine, chip)
    bench.fly(2000, 3500, MIDDLE, rate_hz=50)
    bench.run(5300)
    changes = [(round(t / 1000), what) for t, what in bench.board.pad(8).history]
    assert changes[0] == (0, "input")
    assert changes[-1][1] == 1, changes  # out when the application is left
    lit = [t for t, what in changes if what == 0]
    dark = [t for t, what in changes if what == 1]
    # Slow blinking, to the tick of 10 ms.
    assert 630 <= dark[1] - lit[0] <= 650, changes
    # On, from the first tick behind the first frame until failsafe.
    assert [what for t, what in changes if t <= 2015][-1] == 0, changes
    assert [t for t in lit + dark if 2015 < t < 3580] == [], changes
    # Fast blinking.
    fast = [t for t in lit if t > 3700]
    assert len(fast) >= 8, changes
    assert all([150 <= after - before <= 170 for before, after in zip(fast, fast[1:])]), fast


def the_led_of_a_broken_configuration(tree, machine, chip):
    """Three short flashes, each 1.28 s."""
    bench = Bench(tree, machine, chip, b"[]")
    bench.fly(400, 2400, MIDDLE, rate_hz=50)
    bench.run(2500)
    lit = [t / 1000 for t, what in bench.board.pad(8).history if what == 0]
    dark = [t / 1000 for t, what in bench.board.pad(8).history if what == 1][1:]
    assert len(lit) == len(dark) == 6, (lit, dark)
    assert all([70 <= end - start <= 90 for start, end in zip(lit, dark)]), (lit, dark)
    gaps = [after - before for before, after in zip(lit, lit[1:])]
    for gap, wanted in zip(gaps, (160, 160, 960, 160, 160)):
        assert wanted - 11 <= gap <= wanted + 11, gaps


def stopped_and_started_again(tree, machine, chip):
    """Ctrl-C leaves the pins low and the watchdog a day of peace; `main()` flies again."""
    bench = _bench(tree, machine, chip)
    board = bench.board
    bench.fly(400, 600, HIGH)
    bench.run(600)
    assert [_width_us(board.pad(pin).now) for pin in PINS] == [0] * 5
    assert board.watchdog_us - board.now_us > 86_000e6
    board.sleep_ms(10_000)
    bench.fly(11_000, 11_200, MIDDLE)
    shown = _look(bench, 11_190)
    bench.run(11_200)
    assert shown == [[1500] * 5], shown
    assert board.resets == 0
