"""The hardware watchdog, the main loop that stands still, the LED, and leaving the application."""

from itertools import pairwise

import pytest
from rig import SERVOS, Pico

import ghst

CENTRE = ghst.encode.channels(0x30, (2048,) * 4, (128,) * 4)
PIO0_CTRL, PIO0_INTE, PIO1_CTRL = 0x50200000, 0x5020012C, 0x50300000
DMA_ABORT = 0x50000444
WATCHDOG_CTRL = 0x40058000
ENABLED = 1 << 30
FAILING_STEPS = b"""
def setup(application):
    def fail(now_ms):
        raise RuntimeError("of the user")
    application.steps.insert(0, fail)
    def leave(now_ms):
        raise SystemExit("of the user")
    application.steps.insert(0, leave)
    application.steps.append(None)
"""


def wait_for_reset(pico: Pico, limit_ns: float) -> float:
    """Run until the watchdog has reset the chip; returns when."""
    pico.board.run_until(lambda: bool(pico.board.resets), limit_ns)
    return pico.board.resets[0][0]


@pytest.mark.boot()
@pytest.mark.parametrize(
    ("address", "value"),
    [(PIO0_CTRL, 0), (PIO1_CTRL, 0), (PIO0_INTE, 0), (DMA_ABORT, 0xFFF)],
    ids=["receiver stopped", "tick stopped", "interrupt off", "DMA stopped"],
)
def test_a_dead_control_path_is_reset_and_comes_back(pico: Pico, address: int, value: int) -> None:
    receiver = pico.fly(lambda index, t: CENTRE, 250)
    pico.board.run_for(100e6)
    broken = pico.board.now_ns
    pico.board.write32(address, value)
    reset = wait_for_reset(pico, 1.5e9)
    assert 0.9e9 < reset - broken < 1.1e9
    # The receiver went on sending: the first pulses come when the firmware runs again.
    pico.board.run_for(600e6)
    first = min(pico.meter.since(reset, pin)[0].rise_ns for pin in SERVOS)
    assert 100e6 < first - reset < 600e6
    receiver.stop()


@pytest.mark.run(options="failsafe_ms=110, failsafe={6: -1, 7: 4000}", watchdog=True)
def test_a_frame_interrupt_that_dies_with_the_link_leaves_no_pulses(pico: Pico) -> None:
    # No byte comes, so nothing is unread; failsafe must not depend on that interrupt.
    receiver = pico.fly(lambda index, t: CENTRE, 250)
    pico.board.run_for(101.5e6)
    receiver.stop()
    pico.board.write32(PIO0_INTE, 0)
    last = receiver.sent[-1].end_ns
    reset = wait_for_reset(pico, 1.5e9)
    assert 0.9e9 < reset - last < 1.2e9
    quiet = last + 110e6 + 30e6
    assert all(pulse.rise_ns < quiet for pin in SERVOS for pulse in pico.meter.since(last, pin))


@pytest.mark.run(
    "adapter.poll()\n"
    "    keep = adapter\n"
    "    del adapter, keep\n"
    "    while True: import gc; gc.collect(); junk = [bytearray(200) for n in range(99)]"
)
def test_an_adapter_without_a_name_is_not_collected(pico: Pico) -> None:
    receiver = pico.fly(lambda index, t: CENTRE, 500)
    pico.board.run_for(200e6)
    assert len(pico.compares) >= 4 * (len(receiver.sent) - 1) > 300


@pytest.mark.boot()
def test_after_a_reset_the_pins_are_quiet_until_the_link_is_back(pico: Pico) -> None:
    receiver = pico.fly(lambda index, t: CENTRE, 250)
    pico.board.run_for(50e6)
    receiver.stop()
    pico.board.write32(PIO0_CTRL, 0)
    reset = wait_for_reset(pico, 1.5e9)
    pico.board.run_for(700e6)
    assert pico.no_pulses_since(reset)
    text = pico.reply_to_enter()
    assert "\nrestarted by the watchdog\n" in text and "\nlink: searching; frames 0," in text
    pico.fly(lambda index, t: CENTRE, 250)
    pico.board.run_for(50e6)
    assert not pico.no_pulses_since(reset)


@pytest.mark.run(
    "adapter.poll(); print(adapter.link, adapter.control.stuck, 'stood still')\n"
    "    time.sleep(9 if adapter.receiver.frames else 0)",
    watchdog=True,
)
def test_a_stuck_main_loop_is_counted_and_flies_on(pico: Pico) -> None:
    # Stands still for nine seconds with the link up, then shows it.
    receiver = pico.fly(lambda index, t: CENTRE, 19)
    pico.board.run_for(9.5e9)
    assert pico.board.resets == []
    assert b"linked 1 stood still" in pico.board.console.output
    assert len(pico.compares) == 4 * len(receiver.sent)


@pytest.mark.run("time.sleep(60)", watchdog=True)
def test_a_stuck_main_loop_without_a_link_costs_a_reset(pico: Pico) -> None:
    begun = pico.board.now_ns
    assert 5.9e9 < wait_for_reset(pico, 8e9) - begun < 6.3e9


@pytest.mark.boot()
def test_ctrl_c_reaches_the_repl_and_nothing_resets_there(pico: Pico) -> None:
    receiver = pico.fly(lambda index, t: CENTRE, 250)
    pico.board.run_for(100e6)
    assert pico.board.read32(WATCHDOG_CTRL) & ENABLED
    pressed = pico.board.now_ns
    pico.board.console.write(b"\x03")
    pico.board.run_for(100e6)
    assert b"pins quiet, watchdog paused" in pico.board.console.output
    assert pico.board.exec("print(6 * 7)") == "42\n"
    assert not pico.board.read32(WATCHDOG_CTRL) & ENABLED
    # The pulses that ran were finished, none was cut short; then the pins are quiet.
    for pin in SERVOS:
        assert {round(pulse.width_ns) for pulse in pico.meter.pulses[pin]} == {1_500_000}
        assert pico.meter.pulses[pin][-1].rise_ns < pressed + 25e6
    pico.board.run_for(2e9)
    assert pico.no_pulses_since(pressed + 30e6)
    assert pico.board.resets == []
    receiver.stop()


@pytest.mark.boot()
def test_a_second_ctrl_c_does_not_stop_it_half_way(pico: Pico) -> None:
    receiver = pico.fly(lambda index, t: CENTRE, 250)
    for offset_us in (0.0, 60.0, 72.5, 75.5, 78.5, 90.0, 150.0, 400.0, 3000.0):
        # Reading the configuration takes a third of a second.
        pico.board.run_until(lambda: bool(pico.meter.since(pico.at(-30e6), 6)), 1e9)
        pico.board.console.write(b"\x03")
        pico.board.run_for(offset_us * 1e3)
        pico.board.console.write(b"\x03")
        pico.board.run_for(100e6)
        assert pico.no_pulses_since(pico.at(-40e6)), offset_us
        assert not pico.board.read32(WATCHDOG_CTRL) & ENABLED
        # Ctrl-C works again, and so does the firmware.
        pico.board.console.write(b"while True: pass\r\r")
        pico.board.run_for(20e6)
        pico.board.console.write(b"\x03")
        pico.board.run_for(20e6)
        pico.board.console.write(b"main()\r")
    receiver.stop()


@pytest.mark.boot()
def test_no_byte_on_the_console_holds_the_main_loop_up(pico: Pico) -> None:
    pico.board.console.write(b"\xc3\xff\xe2\x82")
    pico.board.run_for(2.5e9)
    pico.board.console.write(b"\r")
    pico.board.run_for(50e6)
    assert b"no command '????'" in pico.board.console.output
    assert "stood still 0 times" in pico.reply_to_enter()


@pytest.mark.boot()
def test_a_soft_reset_starts_the_firmware_anew(pico: Pico) -> None:
    receiver = pico.fly(lambda index, t: CENTRE, 250)
    pico.board.run_for(50e6)
    pico.board.console.write(b"\x03")
    pico.board.run_for(100e6)
    pico.board.console.write(b"\x04")
    restarted = pico.board.now_ns
    pico.board.run_for(700e6)
    assert len(pico.meter.since(restarted, 6)) > 5
    assert "link: linked" in pico.reply_to_enter()
    pico.board.run_for(1.2e9)
    assert pico.board.resets == []
    receiver.stop()


@pytest.mark.boot(files={"/user.py": FAILING_STEPS})
def test_exceptions_in_the_main_loop_are_shown_and_cost_nothing(pico: Pico) -> None:
    receiver = pico.fly(lambda index, t: CENTRE, 250)
    pico.board.run_for(200e6)
    assert len(pico.compares) >= 4 * (len(receiver.sent) - 1) > 100
    pico.reply_to_enter()
    pico.board.run_for(10e6)
    assert b"faults, the last: TypeError: 'NoneType' object" in pico.board.console.output


@pytest.mark.boot(files={"/user.py": b"import nothing_of_this_name"})
def test_an_exception_in_the_users_setup_is_shown_and_costs_nothing(pico: Pico) -> None:
    receiver = pico.fly(lambda index, t: CENTRE, 250)
    pico.board.run_for(100e6)
    assert len(pico.compares) >= 4 * (len(receiver.sent) - 1) > 50
    pico.reply_to_enter()
    pico.board.run_for(10e6)
    assert b"main loop: 1 faults, the last: ImportError: no module" in pico.board.console.output


@pytest.mark.boot(files={"/user.py": b"raise SystemExit"})
def test_leaving_in_the_users_file_is_shown_and_costs_nothing(pico: Pico) -> None:
    receiver = pico.fly(lambda index, t: CENTRE, 250)
    pico.board.run_for(100e6)
    assert len(pico.compares) >= 4 * (len(receiver.sent) - 1) > 50
    pico.reply_to_enter()
    pico.board.run_for(10e6)
    assert b"main loop: 1 faults, the last: SystemExit" in pico.board.console.output


@pytest.mark.boot(files={"/lib/firmware/report.mpy": b"no code"}, until=b"no sensors, no tele")
def test_it_flies_without_what_cannot_be_loaded(pico: Pico) -> None:
    receiver = pico.fly(lambda index, t: CENTRE, 250)
    pico.board.run_for(200e6)
    assert len(pico.compares) >= 4 * (len(receiver.sent) - 1) > 100
    pico.board.run_for(2.5e9)
    assert pico.board.resets == [] and pico.meter.since(pico.at(-30e6), 6)


@pytest.mark.boot()
def test_the_led_shows_the_link(pico: Pico) -> None:
    edges: list[tuple[float, bool | None]] = []
    pico.board.pin(25).watch(lambda t, level: edges.append((t, level)))
    pico.board.run_for(2.6e9)
    widths = [round((b[0] - a[0]) / 1e6) for a, b in pairwise(edges[1:])]
    assert set(widths) == {640}
    edges.clear()
    receiver = pico.fly(lambda index, t: CENTRE, 55)
    pico.board.run_for(1.0e9)
    assert [level for _, level in edges] in ([], [True])
    receiver.stop()
    pico.board.run_for(550e6)
    edges.clear()
    pico.board.run_for(400e6)
    widths = [round((b[0] - a[0]) / 1e6) for a, b in pairwise(edges)]
    assert set(widths) == {80}
