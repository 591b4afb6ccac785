"""Checks `boards/<name>/board.json` against its form and against what the chip can do."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from ghst_tools.chips import CHIPS, KINDS, Chip
from ghst_tools.errors import GhstError

ARCHITECTURES = ("armv6m", "armv7emsp", "xtensawin", "rv32imc")
"""Those of mpy-cross that boards here have."""

SOURCES = ("receiver Tx", "BEC 5 V", "ground", "sensors 3.3 V")
"""What a row of `wiring` may connect."""

# Key -> type, or the keys below it; those that begin with ? may be absent.
_FORM: dict[str, Any] = {
    "chip": str,
    "mpy_arch": str,
    "name": str,
    "title": str,
    "micropython": {"board": str, "machine": str},
    "flash": {"filesystem_offset": int, "filesystem_size": int},
    "pins": dict,
    "defaults": dict,
    "wiring": list,
    "outputs_hardware": {"kind": str, "channels": int, "timers": int},
    "?selftest": {"receiver_pin": int},
}
_PIN: dict[str, Any] = {"label": str, "functions": list, "?note": str}
_ROW: dict[str, Any] = {"from": str, "to": str, "?part": str, "?optional": bool, "?note": str}
_TYPES = {str: "a string", int: "an integer", bool: "true or false", list: "a list"}


def check(values: Any, name: str) -> None:
    """Raise `GhstError` with the key that is wrong; `name` is that of the folder."""
    _form("", values, _FORM)
    _is("name", values["name"], name)
    chip = CHIPS.get(values["chip"])
    if chip is None:
        raise GhstError(f"chip is {values['chip']!r}, must be one of {', '.join(CHIPS)}")
    if values["mpy_arch"] not in ARCHITECTURES:
        known = ", ".join(ARCHITECTURES)
        raise GhstError(f"mpy_arch is {values['mpy_arch']!r}, must be one of {known}")
    for key, value in asdict(chip.outputs).items():
        _is(f"outputs_hardware.{key}", values["outputs_hardware"][key], value)
    _pins(values["pins"], chip)
    _selftest(values, _defaults(values["defaults"], values["pins"]), chip)
    labels = {pin["label"] for pin in values["pins"].values()}
    sources: list[str] = []
    for number, row in enumerate(values["wiring"]):
        where = f"wiring.{number}"
        _form(where, row, _ROW)
        if row["from"] not in SOURCES:
            known = ", ".join(SOURCES)
            raise GhstError(f"{where}.from is {row['from']!r}, must be one of {known}")
        sources.append(row["from"])
        if row["from"] == "receiver Tx" and "part" not in row and row["to"] not in labels:
            raise GhstError(f"{where}.to is {row['to']!r}, which is no pin's label")
    needed = ["BEC 5 V", "ground"] + ["sensors 3.3 V"] * ("i2c" in values["defaults"])
    for source in needed:
        if sources.count(source) != 1:
            raise GhstError(f"wiring: must have one row from {source!r}")


def _form(where: str, value: Any, form: Any) -> None:
    if isinstance(form, Mapping):
        if not isinstance(value, dict):
            raise GhstError(f"{where or 'the file'} is {value!r}, must be an object")
        prefix = f"{where}." if where else ""
        for key, below in form.items():
            name = key.removeprefix("?")
            if name in value:
                _form(prefix + name, value[name], below)
            elif name == key:
                raise GhstError(f"the key {prefix + name!r} is missing")
        for key in value:
            if key not in form and f"?{key}" not in form:
                raise GhstError(f"the key {prefix + key!r} is unknown")
    elif form is dict:
        if not isinstance(value, dict):
            raise GhstError(f"{where} is {value!r}, must be an object")
    elif type(value) is not form:
        raise GhstError(f"{where} is {value!r}, must be {_TYPES[form]}")


def _is(where: str, value: Any, expected: Any) -> None:
    if value != expected:
        raise GhstError(f"{where} is {value!r}, must be {expected!r}")


def _pins(pins: Mapping[str, Any], chip: Chip) -> None:
    labels: dict[str, str] = {}
    for key, pin in pins.items():
        where = f"pins.{key}"
        _form(where, pin, _PIN)
        if not (key.isdecimal() and str(int(key)) == key):
            raise GhstError(f"{where}: {key!r} is no GPIO number")
        if pin["label"] in labels:
            raise GhstError(f"{where}.label: {labels[pin['label']]} is {pin['label']!r} already")
        labels[pin["label"]] = where
        _functions(f"{where}.functions", int(key), pin["functions"], chip)


def _functions(where: str, gpio: int, listed: list[str], chip: Chip) -> None:
    kinds = [kind for kind in KINDS if kind in listed]
    if not kinds or len(set(kinds) - {"led"}) > 1:
        raise GhstError(f"{where}: must have one of {', '.join(KINDS)}, or one and led")
    reached = set(kinds) - {"led"}
    if reached and gpio not in chip.gpio and (gpio not in chip.input_only or kinds != ["input"]):
        raise GhstError(f"{where}: GPIO {gpio} of the {chip.name} cannot be {kinds[0]}")
    # All that the chip can do here: a function that is forgotten would be refused to the user.
    able = chip.functions(gpio) if reached else frozenset()
    if reached == {"output"}:
        able = frozenset(name for name in able if name.startswith(("pwm", "ledc")))
    elif reached == {"input"}:
        able = frozenset(name for name in able if name.startswith("adc") or name.endswith("rx"))
    given = [name for name in listed if name not in KINDS]
    if set(given) != able or len(set(listed)) != len(listed):
        raise GhstError(f"{where}: must have {', '.join([*kinds, *sorted(able)])}")


def _defaults(defaults: Mapping[str, Any], pins: Mapping[str, Any]) -> dict[str, str]:
    """Two levels of sections; each pin exists and is used once. The rest is the validator's.

    Returns for each GPIO that is used by what.
    """
    used: dict[str, str] = {}

    def claim(where: str, pin: Any) -> None:
        if str(pin) not in pins:
            raise GhstError(f"{where}: GPIO {pin} is not among pins")
        if str(pin) in used:
            raise GhstError(f"{where}: GPIO {pin} is used by {used[str(pin)]} already")
        used[str(pin)] = where

    for section, options in defaults.items():
        where = f"defaults.{section}"
        _form(where, options, dict)
        for key, value in options.items():
            if section == "outputs":
                _form(f"{where}.{key}", value, dict)
                claim(f"{where}.{key}", key)
            elif key == "pin" or key.endswith("_pin"):
                _form(f"{where}.{key}", value, int)
                claim(f"{where}.{key}", value)
    for key in ("wire", "outputs"):
        if key not in defaults:
            raise GhstError(f"the key 'defaults.{key}' is missing")
    return used


def _selftest(values: Mapping[str, Any], used: Mapping[str, str], chip: Chip) -> None:
    """The pin that plays the receiver is free, or that of a GPS, which can be taken off."""
    if "selftest" not in values:
        if chip.is_rp2:
            raise GhstError("the key 'selftest' is missing")
        return
    if not chip.is_rp2:
        raise GhstError(f"selftest: the {chip.name} has no PIO")
    for key in ("battery", "i2c"):
        if key not in values["defaults"]:
            raise GhstError(f"selftest: the key 'defaults.{key}' is missing")
    where = "selftest.receiver_pin"
    pin = str(values["selftest"]["receiver_pin"])
    if "gpio" not in values["pins"].get(pin, {"functions": []})["functions"]:
        raise GhstError(f"{where}: GPIO {pin} cannot be driven and read")
    by = used.get(pin, "")
    if by and not by.startswith("defaults.gps."):
        raise GhstError(f"{where}: GPIO {pin} is used by {by} already")
