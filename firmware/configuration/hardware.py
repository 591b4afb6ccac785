"""What the chip and the board can do: functions of pins, slices, timers."""


def check_hardware(values, board, problems):
    """Adds what this board cannot do, or not at once, to `problems`.

    `board`: its description; `functions` in it are {function: [GPIO, ...]}.
    """
    pins = _Pins(board, problems)
    wire = values["wire"]
    uart = wire["driver"] == "uart"
    esp = board["chip"].startswith("esp")
    if esp and not uart:
        problems.add("wire.driver", f'wire.driver is "pio", must be "uart" on an {board["chip"]}')
    pins.claim("wire.pin", wire["pin"], "uart rx" if uart else "gpio")
    if uart:
        if wire["inverted"]:
            problems.add(
                "wire.inverted",
                'wire.inverted is true, must be false with wire.driver "uart": its TX is tied to '
                "the wire so that it can pull low only, and an inverted wire is low already",
            )
        if wire["tx_pin"] is None:
            problems.add("wire.tx_pin", "wire.tx_pin is missing, must be TX of the wire's UART")
        pins.claim("wire.tx_pin", wire["tx_pin"], "uart tx")
        pins.check_uart(wire["pin"], wire["tx_pin"])
    if values[""]["role"] == "goggles":
        values["outputs"].clear()
        for name in ("clock_pin", "data_pin", "select_pin"):
            pins.claim(f"rx5808.{name}", values["rx5808"][name], "gpio")
    for pin in sorted(values["outputs"]):
        pins.claim(f"outputs.{pin}", pin, "pwm")
    pins.claim("led.pin", values["led"]["pin"], "led")
    _claim_sensors(values, pins)
    taken = 1 if esp else pins.uart(wire["pin"]) if uart else None
    if values["gps"]["enabled"] and values["gps"]["uart"] == taken:
        problems.add("gps.uart", f"gps.uart is {taken}, which the Ghost wire has")
    check = _check_ledc if esp else _check_slices
    check(values["outputs"], board, problems)


def _claim_sensors(values, pins):
    battery = values["battery"]
    if battery["enabled"]:
        for name in ("voltage_pin", "current_pin"):
            pins.claim(f"battery.{name}", battery[name], "adc")
        if battery["voltage_pin"] is None and battery["current_pin"] is None:
            pins.missing("battery.voltage_pin", "adc")
    gps = values["gps"]
    if gps["enabled"]:
        for name, signal in (("tx_pin", "tx"), ("rx_pin", "rx")):
            pins.need(f"gps.{name}", gps[name], f"uart{gps['uart']} {signal}")
    if values["barometer"]["enabled"] or values["magnetometer"]["enabled"]:
        i2c = values["i2c"]
        for name, signal in (("sda_pin", "sda"), ("scl_pin", "scl")):
            pins.need(f"i2c.{name}", i2c[name], f"i2c{i2c['bus']} {signal}")


class _Pins:
    """Who has which pin, and which pins could do what is asked."""

    def __init__(self, board, problems):
        self._functions = board["functions"]
        self._labels = board.get("labels", {})
        self._problems = problems
        self._users = {}
        self._able = {}

    def able(self, function):
        """Returns the GPIOs that can do `function`, sorted."""
        if function not in self._able:
            found = set()
            for name, pins in self._functions.items():
                if name == function or _is_a(name, function):
                    found.update(pins)
            self._able[function] = sorted(found)
        return self._able[function]

    def label(self, pin):
        """Returns what is printed beside a pin."""
        return self._labels.get(str(pin), f"GP{pin}")

    def missing(self, key, function):
        """Notes that a pin is not given."""
        names = ", ".join([str(pin) for pin in self.able(function)]) or "none on this board"
        self._problems.add(key, f"{key} is missing, must be one of {names}")

    def need(self, key, pin, function):
        """Claims a pin that has to be given."""
        if pin is None:
            self.missing(key, function)
        else:
            self.claim(key, pin, function)

    def check_uart(self, rx_pin, tx_pin):
        """Notes that the two pins of the wire are not of one UART."""
        for name in self._functions:
            if name.endswith(" rx") and rx_pin in self._functions[name]:
                others = self._functions.get(name[:-2] + "tx", ())
                if tx_pin is not None and tx_pin not in others:
                    self._problems.add(
                        "wire.tx_pin",
                        f"wire.tx_pin: GPIO {tx_pin} is not TX of the UART whose RX GPIO {rx_pin} "
                        "is",
                    )

    def uart(self, rx_pin):
        """Returns the number of the UART whose RX a pin can be, None if there is none."""
        for name, pins in self._functions.items():
            if name.startswith("uart") and name.endswith(" rx") and rx_pin in pins:
                return int(name[4:-3])
        return None

    def claim(self, key, pin, function):
        """Notes who uses a pin, unless it is None."""
        if pin is None:
            return
        # `able` takes its time: most pins are named with the very function that is asked.
        named = self._functions.get(function, ())
        if pin not in named and pin not in self.able(function):
            names = ", ".join([str(number) for number in self.able(function)])
            names = names or "none on this board"
            self._problems.add(
                key, f"{key}: GPIO {pin} cannot be {function}, must be one of {names}"
            )
        elif pin in self._users:
            self._problems.add(key, f"{key}: GPIO {pin} is taken by {self._users[pin]}")
        else:
            self._users[pin] = key


def _is_a(name, function):
    # Every pin that can be an output gives pulses; one that can be anything drives a LED.
    # "uart1 tx" is uart tx; where any pin may be any signal of a bus, as on the ESP32, "uart" is
    # "uart0 tx".
    if function in ("pwm", "led"):
        return name in ("gpio", "output")
    bus, _, signal = function.partition(" ")
    if not signal:
        return False
    if name == bus.rstrip("0123456789"):
        return True
    return bus == "uart" and name.startswith("uart") and name.endswith(" " + signal)


def _check_slices(outputs, board, problems):
    """Outputs of a slice of the RP2040 or RP2350: GPIO n, n + 1, n + 16 and n + 17."""
    users = {}
    frequencies = {}
    for pin in sorted(outputs):
        channel = (pin >> 1 & 7, pin & 1)
        if channel in users:
            problems.add(
                f"outputs.{pin}",
                f"outputs.{pin} and outputs.{users[channel]} share one PWM channel: take another "
                "pin for one of them",
            )
        users[channel] = pin
        hertz = outputs[pin]["frequency_hz"]
        other = frequencies.setdefault(channel[0], pin)
        if outputs[other]["frequency_hz"] != hertz:
            problems.add(
                f"outputs.{pin}.frequency_hz",
                f"outputs.{pin}.frequency_hz is {hertz}, but GPIO {pin} shares PWM slice "
                f"{channel[0]} with GPIO {other}, which has {outputs[other]['frequency_hz']}: "
                "they must be the same",
            )


def _check_ledc(outputs, board, problems):
    """Channels and timers of the ESP32's LEDC; a timer has one frequency."""
    hardware = board["outputs_hardware"]
    # A switch is a plain pin.
    pulses = [output for output in outputs.values() if output["kind"] != "switch"]
    hertz = {output["frequency_hz"] for output in pulses}
    if len(pulses) > hardware["channels"]:
        problems.add(
            "outputs",
            f"outputs has {len(pulses)} pins, but an {board['chip']} has {hardware['channels']} "
            "PWM channels",
        )
    if len(hertz) > hardware["timers"]:
        problems.add(
            "outputs",
            f"outputs has {len(hertz)} values of frequency_hz, but an {board['chip']} has "
            f"{hardware['timers']} PWM timers",
        )
