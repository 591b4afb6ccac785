"""docs/boards.md: tables of all boards, made of `boards/*/board.json`."""

from collections import defaultdict
from collections.abc import Iterator, Sequence

from ghst_tools.boards import Board
from ghst_tools.chips import CHIPS

_HEAD = """# Boards

Made by `ghst wiring` from `boards/*/board.json`: change those, not this file.

{overview}

**Where it ran.** Nothing here was ever run on a real chip. The firmware runs on an emulated RP2040
with the pins of `rpi_pico`; the other RP2040 boards differ from it in their pins only, which come
from the makers' drawings. For the RP2350 it is compiled, and written by the datasheet: there is
no emulator. For the ESP32 family, which has none either, it is compiled, and runs on MicroPython's
unix port against a strict model of that port's `machine`. Of MicroPython's board definitions
(`boards/*/micropython`) those of the RP2 boards were built, with 1.25.0; those of the ESP32 family
never: that needs ESP-IDF.

**Not yet.** The Raspberry Pi Pico W and Pico 2 W have no board definition of their own, and
`ghst flash` refuses them: their radio chip has GPIO 23 to 25 and 29, and with them the LED.

**Names.** A pin is called what the maker's drawing calls it, which most boards have printed beside
it. `ghst.json` takes the number of the GPIO.

**Servo outputs of the RP2040 and RP2350.** GPIO 2n and 2n+1 are the outputs A and B of one PWM
slice and have one frequency. There are eight slices: GPIO n and n+16 are the same output, and only
one of them can be used.

**Servo outputs of the ESP32 family.** Any pin takes any channel of the LEDC. Outputs of the same
frequency share a timer. A pulse has steps of 0.31 us at 50 Hz and 0.04 us at 400 Hz on the ESP32,
of 1.22 us and 0.15 us on the S3 and the C3. A switch is a plain pin and takes no channel. Pins are
left out that the chip looks at while it boots (strapping pins), and those of the flash, of USB and
of the console.

**The Ghost wire of the ESP32 family** needs two pins, RX and TX, tied together: RX straight, TX
through a Schottky diode with its cathode at TX, and a resistor of 2.2 kOhm that pulls the wire up.
TX of the UART is high while nothing is sent: straight at the wire it would fight the receiver.
1 kOhm in place of the diode does as well, without the pull-up; the receiver then has to sink 3 mA.

**Battery.** 3.3 V are the limit of every pin, so the divider decides what a battery may have:
10 kOhm and 1 kOhm make an eleventh of it. How much of the 3.3 V the ADC reads depends on the chip.
"""


def document(boards: Sequence[Board]) -> str:
    """The text of docs/boards.md; pictures are where `wiring.picture_path` says."""
    rows = [
        (
            f"[{board.title}](#{_anchor(board)})",
            f"`{board.name}`",
            CHIPS[board.chip].title,
            str(len(board.defaults["outputs"])),
            ", ".join(_sensors(board)) or "-",
            board.micropython_board,
        )
        for board in boards
    ]
    overview = _table(
        ("board", "`BOARD=`", "chip", "servos", "sensors by default", "MicroPython image"), rows
    )
    return "\n".join([_HEAD.format(overview=overview), *map(_section, boards)])


def _anchor(board: Board) -> str:
    kept = (c for c in board.title.lower() if c.isalnum() or c in " -")
    return "".join(kept).replace(" ", "-")


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _sensors(board: Board) -> Iterator[str]:
    battery = board.defaults.get("battery", {})
    if battery:
        yield "battery and current" if "current_pin" in battery else "battery"
    names = {"gps": "GPS", "barometer": "barometer", "magnetometer": "magnetometer"}
    yield from (name for key, name in names.items() if key in board.defaults)


def _section(board: Board) -> str:
    parts = [f"## {board.title}", f"![Wiring](img/wiring_{board.name}.svg)"]
    parts.append(_table(("use", "pin", "GPIO", "hardware"), list(_uses(board))))
    wiring = [
        (row.source, row.to, _part(row.part, row.optional), row.note) for row in board.wiring
    ]
    parts.append(_table(("connect", "to", "through", "note"), wiring))
    parts.append(_outputs(board))
    if "battery" in board.defaults:
        limit = f"ADC: it reads up to {CHIPS[board.chip].adc_limit_mv / 1000:g} V"
        parts.append(f"{limit}, with the divider a battery of up to {board.battery_limit_v} V.")
    used = set(_used(board))
    free = [
        _free(board, gpio)
        for gpio, pin in board.pins.items()
        if gpio not in used and pin.functions != ("led",)
    ]
    parts.append(f"Free: {', '.join(free)}." if free else "No pin is free.")
    if board.selftest_pin is not None:
        parts.append(_selftest(board))
    notes: dict[str, list[str]] = defaultdict(list)
    for pin in board.pins.values():
        if pin.note:
            notes[pin.note].append(pin.label)
    if notes:
        parts.append("\n".join(f"- {', '.join(of)}: {note}." for note, of in notes.items()))
    return "\n\n".join(parts) + "\n"


def _selftest(board: Board) -> str:
    wire, pin = board.label(board.defaults["wire"]["pin"]), board.label(board.selftest_pin or 0)
    picture = f"[the picture](img/selftest_{board.name}.svg)"
    return f"Self-test (`make selftest`): a jumper from {wire} to {pin}, see {picture}."


def _part(part: str, optional: bool) -> str:
    return f"{part}, optional" if optional else part or "-"


def _free(board: Board, gpio: int) -> str:
    pin = board.pins[gpio]
    extra = [name for name in pin.functions if name in ("input", "output")]
    if any(name.startswith("adc") for name in pin.functions):
        extra.append("ADC")
    name = pin.label if pin.label in (f"GP{gpio}", str(gpio)) else f"{pin.label} (GPIO {gpio})"
    return f"{name} [{', '.join(extra)}]" if extra else name


def _used(board: Board) -> Iterator[int]:
    for section, options in board.defaults.items():
        if section == "outputs":
            yield from map(int, options)
        else:
            yield from (value for key, value in options.items() if key.endswith("pin"))


def _uses(board: Board) -> Iterator[tuple[str, str, str, str]]:
    defaults = board.defaults

    def row(use: str, gpio: int, hardware: str) -> tuple[str, str, str, str]:
        return use, board.label(gpio), str(gpio), hardware

    wire = defaults["wire"]
    if wire["driver"] == "pio":
        yield row("Ghost wire", wire["pin"], "PIO")
    else:
        yield row("Ghost wire, RX", wire["pin"], f"UART {wire['uart']}")
        yield row("Ghost wire, TX", wire["tx_pin"], f"UART {wire['uart']}")
    for key, output in defaults["outputs"].items():
        yield row(f"servo, channel {output['channel']}", int(key), _output(board, int(key)))
    battery = defaults.get("battery", {})
    for use, key in (("battery voltage", "voltage_pin"), ("current", "current_pin")):
        if key in battery:
            yield row(use, battery[key], "ADC")
    if "gps" in defaults:
        gps = defaults["gps"]
        yield row("GPS, to its RX", gps["tx_pin"], f"UART {gps['uart']}")
        yield row("GPS, from its TX", gps["rx_pin"], f"UART {gps['uart']}")
    if "i2c" in defaults:
        i2c = defaults["i2c"]
        yield row("I2C, SDA", i2c["sda_pin"], f"I2C {i2c['bus']}")
        yield row("I2C, SCL", i2c["scl_pin"], f"I2C {i2c['bus']}")
    if "led" in defaults:
        led = defaults["led"]
        yield row("LED", led["pin"], "lights when low" if led.get("active_low") else "-")


def _output(board: Board, gpio: int) -> str:
    for function in board.pins[gpio].functions:
        if function.startswith("pwm"):
            return f"PWM slice {function[3]}, output {function[4]}"
    return "LEDC"


def _outputs(board: Board) -> str:
    """Which outputs share what."""
    outputs = {int(gpio): output["channel"] for gpio, output in board.defaults["outputs"].items()}
    hardware = CHIPS[board.chip].outputs
    if hardware.kind == "ledc":
        return (
            f"LEDC: {len(outputs)} of {hardware.channels} channels are in use; up to "
            f"{hardware.timers} different frequencies."
        )
    slices: dict[int, list[int]] = defaultdict(list)
    for gpio, channel in outputs.items():
        slices[gpio >> 1 & 7].append(channel)
    pairs = [
        f"{' and '.join(map(str, channels))} (slice {number})"
        for number, channels in slices.items()
        if len(channels) == 2
    ]
    return f"Of the same frequency are the outputs of channels {', '.join(pairs)}."
