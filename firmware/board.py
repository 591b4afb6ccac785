"""Reads `board.json`: which pin does what on the board that the firmware runs on."""

import json

from firmware.interrupts import HOLD, NONE


class BoardError(Exception):
    """The board's description cannot be used; the text says where and why."""


class Board:
    """What `board.json` says.

    `name`; `chip` ("rp2040", "rp2350"); `wire`: GPIO of the Ghost wire; `servos`: {GPIO: channel
    1..16}; `led`: GPIO or None; `failsafe_ms`; `failsafe`: {GPIO: HOLD, NONE or quarter
    microseconds}.
    """

    def __init__(self, values):
        """Takes the parsed file; raises `BoardError`."""
        pins = _get(values, "pins", dict)
        self.name = _get(values, "name", str)
        self.chip = _get(values, "chip", str)
        self.wire = _pin("pins.ghst_wire", _get(pins, "ghst_wire", int, "pins."))
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


def _get(values, key, kind, where="", default=None):
    value = values.get(key)
    if value is None:
        value = default
    if value is None:
        raise BoardError(f"{where}{key} is missing")
    if type(value) is not kind:
        raise BoardError(f"{where}{key} is {value!r}, must be of type {kind.__name__}")
    return value


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


def load(path):
    """Returns the `Board` in the file `path`; raises `BoardError` with one clear line."""
    try:
        with open(path) as file:
            values = json.load(file)
    except OSError:
        raise BoardError(f"{path} is missing: flash the board again") from None
    except ValueError:
        raise BoardError(f"{path} is not valid JSON: flash the board again") from None
    try:
        if not isinstance(values, dict):
            raise BoardError("must be a JSON object")
        return Board(values)
    except BoardError as error:
        raise BoardError(f"{path}: {error}") from None
