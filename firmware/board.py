"""Reads `board.json`: which pin does what on the board that the firmware runs on."""

import json

from firmware.interrupts import HOLD, NONE


class BoardError(Exception):
    """The board's description cannot be used; the text says where and why."""


# The sensors and the pins that each of them uses.
_SENSORS = {
    "battery": ("battery_adc", "current_adc"),
    "gps": ("gps_uart",),
    "barometer": ("i2c",),
    "magnetometer": ("i2c",),
}
# Signals of a bus or module; none where it is a single pin.
_PIN_GROUPS = {
    "battery_adc": (),
    "current_adc": (),
    "gps_uart": ("id", "tx", "rx"),
    "i2c": ("id", "sda", "scl"),
    "rx5808": ("clock", "data", "select"),
}


class Board:
    """What `board.json` says.

    `name`; `chip` ("rp2040", "rp2350"); `role`: "flight" or "goggles"; `wire`: GPIO of the Ghost
    wire; `wire_options`: of `Adapter`, which driver; `servos`: {GPIO: channel 1..16}; `led`: GPIO
    or None; `failsafe_ms`; `failsafe`: {GPIO: HOLD, NONE or quarter microseconds}; `sensors`:
    {name: {option: value}}; `pins`: those of buses and modules, a GPIO or {signal: GPIO}.
    """

    def __init__(self, values):
        """Takes the parsed file; raises `BoardError`."""
        pins = _get(values, "pins", dict)
        self.name = _get(values, "name", str)
        self.chip = _get(values, "chip", str)
        self.role = _choice(values, "role", ("flight", "goggles"))
        self.wire = _pin("pins.ghst_wire", _get(pins, "ghst_wire", int, "pins."))
        self.wire_options = {"wire": _choice(values, "wire_driver", ("pio", "uart"))}
        if pins.get("ghst_tx") is not None:
            self.wire_options["tx_pin"] = _pin("pins.ghst_tx", pins["ghst_tx"])
        self.servos = {}
        for key, channel in _get(pins, "servos", dict, "pins.").items():
            if type(channel) is not int or not 1 <= channel <= 16:
                raise BoardError(f"pins.servos.{key} is {channel!r}, must be a channel, 1..16")
            pin = _pin("pins.servos", key)
            if pin in self.servos:
                raise BoardError(f"pins.servos names GP{pin} twice")
            self.servos[pin] = channel
        led = pins.get("led")
        self.led = None if led is None else _pin("pins.led", led)
        self.failsafe_ms = _get(values, "failsafe_ms", int, default=500)
        self.failsafe = {}
        for key, rule in _get(values, "failsafe", dict, default={}).items():
            pin = _pin("failsafe", key)
            if pin not in self.servos:
                raise BoardError(f"failsafe.{key}: GP{pin} is not among pins.servos")
            self.failsafe[pin] = _rule(key, rule)
        self.sensors = _get(values, "sensors", dict, default={})
        for key, options in self.sensors.items():
            if key not in _SENSORS:
                raise BoardError(f"sensors.{key} is unknown, there are {', '.join(_SENSORS)}")
            if type(options) is not dict:
                raise BoardError(f"sensors.{key} is {options!r}, must be a JSON object")
        self.pins = {}
        for key in _PIN_GROUPS:
            value = pins.get(key)
            if value is not None:
                self.pins[key] = _group(f"pins.{key}", value, _PIN_GROUPS[key])
        if self.role == "goggles":
            self.servos = {}
            self.failsafe = {}
        elif not self.servos:
            raise BoardError("pins.servos is empty: no servo outputs given")
        self._check_conflicts()

    def _check_conflicts(self):
        used = {self.wire: "ghst_wire"}
        claims = [(pin, "servos") for pin in self.servos]
        claims.append((self.wire_options.get("tx_pin"), "ghst_tx"))
        claims.append((self.led, "led"))
        groups = {group for sensor in self.sensors for group in _SENSORS[sensor]}
        if self.role == "goggles":
            groups.add("rx5808")
        for group in groups:
            pins = self.pins.get(group)
            if type(pins) is dict:
                claims += [(pins[signal], group) for signal in pins if signal != "id"]
            else:
                claims.append((pins, group))
        for pin, user in claims:
            if pin in used:
                raise BoardError(f"pins.{user}: GP{pin} is taken by {used[pin]}")
            if pin is not None:
                used[pin] = user


def _get(values, key, kind, where="", default=None):
    value = values.get(key)
    if value is None:
        value = default
    if value is None:
        raise BoardError(f"{where}{key} is missing")
    if type(value) is not kind:
        raise BoardError(f"{where}{key} is {value!r}, must be of type {kind.__name__}")
    return value


def _choice(values, key, choices):
    value = _get(values, key, str, default=choices[0])
    if value not in choices:
        raise BoardError(f"{key} is {value!r}, must be one of {', '.join(choices)}")
    return value


def _group(where, value, signals):
    if not signals:
        return _pin(where, value)
    if type(value) is not dict:
        raise BoardError(f"{where} is {value!r}, must have {', '.join(signals)}")
    group = {}
    for signal in signals:
        if signal not in value:
            raise BoardError(f"{where}.{signal} is missing")
        group[signal] = _pin(f"{where}.{signal}", value[signal])
    return group


def _pin(where, value):
    # The keys of a JSON object are strings.
    if isinstance(value, str) and value.isdigit():
        value = int(value)
    if type(value) is not int or not 0 <= value <= 29:
        raise BoardError(f"{where}: {value!r} is no GPIO number, 0..29")
    return value


def _rule(key, rule):
    if rule == "hold":
        return HOLD
    if rule == "none":
        return NONE
    if type(rule) in (int, float) and 800 <= rule <= 2200:
        return round(4 * rule)
    raise BoardError(f'failsafe.{key} is {rule!r}, must be "hold", "none" or 800..2200 us')


def _frozen(path):
    try:
        from ghst_board import DEFINITION
    except ImportError:
        raise BoardError(f"{path} is missing: flash the board again") from None
    return json.loads(DEFINITION)


def load(path):
    """Returns the `Board` in the file `path`; raises `BoardError` with one clear line.

    Without that file it is the one that is frozen into the image, where there is one.
    """
    try:
        with open(path) as file:
            values = json.load(file)
    except OSError:
        values = _frozen(path)
    except ValueError:
        raise BoardError(f"{path} is not valid JSON: flash the board again") from None
    try:
        if not isinstance(values, dict):
            raise BoardError("must be a JSON object")
        return Board(values)
    except BoardError as error:
        raise BoardError(f"{path}: {error}") from None
