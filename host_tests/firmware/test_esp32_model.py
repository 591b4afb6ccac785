"""The model of the ESP32's `machine` refuses what the port refuses, and does what it does."""

from collections.abc import Callable
from typing import Any

import pytest
from esp32_model import Board, ChipReset, Machine


class Chip:
    def __init__(self, chip: str = "esp32") -> None:
        self.board = Board(chip=chip)
        self.machine = Machine(self.board)


@pytest.fixture
def chip() -> Chip:
    return Chip()


REFUSED: list[tuple[type[BaseException], Callable[[Any], Any]]] = [
    # arguments that the port has not
    (TypeError, lambda m: m.UART(1, 415_000, tx=17, rx=16, pull=1)),
    (TypeError, lambda m: m.PWM(4, freq=50, duty_u16=0, invert=True)),
    (TypeError, lambda m: m.Pin(4, m.Pin.OUT, alt=1)),
    (TypeError, lambda m: m.Pin(4).irq(print, m.Pin.IRQ_FALLING, hard=True)),
    (TypeError, lambda m: m.Timer(0).init(period=10, callback=print, hard=True)),
    (TypeError, lambda m: m.ADC(34, sample_ns=10)),
    (TypeError, lambda m: m.WDT(0, 1000, 1)),
    (TypeError, lambda m: m.SoftI2C(22, 21, 400_000)),
    (AttributeError, lambda m: m.mem32),
    (AttributeError, lambda m: m.UART.IRQ_TXIDLE),
    (AttributeError, lambda m: m.PWM(4, freq=50).duty_cycle),
    # values out of range
    (ValueError, lambda m: m.UART(3, tx=17, rx=16)),
    (ValueError, lambda m: m.UART(1, tx=34, rx=16)),
    (OSError, lambda m: m.UART(1, tx=17, rx=16, rxbuf=64)),
    (ValueError, lambda m: m.UART(1, tx=17, rx=16).irq(print, m.UART.IRQ_RX, True)),
    (ValueError, lambda m: m.Timer(4)),
    (ValueError, lambda m: m.Timer(-1)),
    (ValueError, lambda m: m.WDT(timeout=0)),
    (ValueError, lambda m: m.WDT(1)),
    (ValueError, lambda m: m.PWM(34, freq=50)),
    (ValueError, lambda m: m.PWM(24, freq=50)),
    (ValueError, lambda m: m.PWM(4, freq=0)),
    (ValueError, lambda m: m.PWM(4, freq=50, duty_u16=1, duty_ns=1)),
    (ValueError, lambda m: m.PWM(4, freq=50, duty_u16=65_536)),
    (ValueError, lambda m: m.PWM(4, freq=50).duty_u16(-1)),
    (ValueError, lambda m: m.PWM(4, freq=50).duty_u16(1.5)),
    (ValueError, lambda m: m.Pin(35, m.Pin.OUT)),
    (ValueError, lambda m: m.ADC(4)),
    (ValueError, lambda m: m.RTC().memory(bytes(2049))),
]


@pytest.mark.parametrize(("error", "use"), REFUSED)
def test_it_refuses(chip: Chip, error: type[BaseException], use: Callable[[Any], Any]) -> None:
    with pytest.raises(error):
        use(chip.machine)


def test_a_duty_comes_with_the_next_period_and_the_first_is_half(chip: Chip) -> None:
    pwm = chip.machine.PWM(4, freq=50, duty_u16=0)
    pad = chip.board.pads[4]
    assert pad.now[0] == "pulses" and pad.now[1] == pad.now[2] / 2
    chip.board.sleep_ms(21)
    assert pad.now == 0
    pwm.duty_u16(4910)
    assert pad.now == 0
    chip.board.sleep_ms(21)
    assert pad.now == ("pulses", pytest.approx(1499.85, abs=0.01), pytest.approx(20_019.2))
    pwm.deinit()
    assert pad.now == "input"
    with pytest.raises(RuntimeError, match="inactive"):
        pwm.duty_u16(0)


def test_what_is_held_shows_later(chip: Chip) -> None:
    pin = chip.machine.Pin(4, chip.machine.Pin.OUT, value=0, hold=True)
    chip.machine.PWM(pin, freq=50, duty_u16=32_768)
    chip.board.sleep_ms(50)
    assert chip.board.pads[4].now == 0
    pin.init(hold=False)
    assert chip.board.pads[4].now[0] == "pulses"


@pytest.mark.parametrize(
    ("name", "channels", "frequencies"), [("esp32", 15, 8), ("esp32s3", 8, 4), ("esp32c3", 6, 4)]
)
def test_channels_and_timers_run_out(name: str, channels: int, frequencies: int) -> None:
    pins = [4, 5, 6, 7, 1, 3, 0, 10] if name == "esp32c3" else [*range(4, 20), 21]
    machine = Chip(name).machine
    for number, pin in enumerate(pins[: frequencies + 1]):
        if number < frequencies:
            machine.PWM(pin, freq=50 + number)
        else:
            with pytest.raises(ValueError, match="timers"):
                machine.PWM(pin, freq=50 + number)
    machine = Chip(name).machine
    for pin in pins[:channels]:
        machine.PWM(pin, freq=50)
    if name != "esp32":
        with pytest.raises(ValueError, match="channels"):
            machine.PWM(pins[channels], freq=50)


def test_the_watchdog_bites_unless_fed_and_ledc_goes_on(chip: Chip) -> None:
    watchdog = chip.machine.WDT(timeout=1000)
    chip.machine.PWM(4, freq=50, duty_u16=4910)
    for _ in range(5):
        chip.board.sleep_ms(900)
        watchdog.feed()
    with pytest.raises(ChipReset):
        chip.board.sleep_ms(1100)
    with pytest.raises(ChipReset):  # nothing runs any more
        chip.board.sleep_ms(1)
    chip.board.reset()
    assert chip.machine.reset_cause() == chip.machine.WDT_RESET
    assert chip.board.pads[4].now[0] == "pulses"


def test_the_scheduler_has_room_for_eight(chip: Chip) -> None:
    ticks: list[float] = []
    timer = chip.machine.Timer(0)
    timer.init(period=10, callback=lambda _: ticks.append(chip.board.now_us))
    chip.board.spend(200_000, collecting=True)
    assert ticks == [] and chip.board.lost_callbacks == 12
    chip.board.sleep_ms(1)
    assert len(ticks) == 8
