"""Asks for everything that a model needs, step by step, and makes a configuration of it.

An answer that the board would not take is told and asked for again, by the board's own validator.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import click

from ghst_tools.boards import Board
from ghst_tools.configuration.keys import OUTPUTS, parse_value, points, value_at, with_value
from ghst_tools.configuration.validator import check, firmware_module


@dataclass(frozen=True)
class Output:
    """An output that a kind of model has. `channel`: of a radio in the order AETR."""

    name: str
    channel: int
    motor: bool = False


MODELS = {
    "plane": (
        Output("aileron", 1),
        Output("elevator", 2),
        Output("motor", 3, motor=True),
        Output("rudder", 4),
    ),
    "wing": (Output("left elevon", 1), Output("right elevon", 2), Output("motor", 3, motor=True)),
    "car": (Output("steering", 1), Output("throttle", 3)),
    "boat": (Output("rudder", 4), Output("throttle", 3)),
    "other": (),
    "goggles": (),
}
"""What a wizard can be told to set up; the outputs of each."""

_SENSORS = {
    "battery": "a battery whose voltage is measured",
    "gps": "a GPS",
    "barometer": "a barometer",
    "magnetometer": "a magnetometer",
}
# What is asked for of a sensor that is there.
_DETAILS = {
    "battery": ("divider", "cells", "capacity_mah"),
    "gps": ("minimum_satellites",),
    "barometer": (),
    "magnetometer": ("rotation_deg", "upside_down", "declination_deg"),
}
_PINS = {
    "battery": ("voltage_pin",),
    "gps": ("uart", "tx_pin", "rx_pin"),
    "barometer": (),
    "magnetometer": (),
}
_CURRENT = ("current_pin", "current_mv_per_a")
_BUS = ("bus", "sda_pin", "scl_pin")
_MODULE = ("clock_pin", "data_pin", "select_pin")


class Wizard:
    """The questions for one board; `tree` is what the file will say."""

    def __init__(self, board: Board) -> None:
        self.tree: dict[str, Any] = {}
        self._board = board
        self._values, self._problems = check({}, board)

    def run(self) -> str:
        """Ask everything; returns the text of the file, which the board takes."""
        click.echo("Enter takes what stands in brackets; Ctrl-C ends this, and writes nothing.\n")
        self._ask("name")
        model = click.prompt("What is it?", type=click.Choice(list(MODELS)), default="plane")
        if model == "goggles":
            self._goggles()
        else:
            self._sensors()
            self._outputs(MODELS[model])
            self._heading("Failsafe")
            self._ask("failsafe.time_ms")
        return json.dumps(self.tree, indent=4) + "\n"

    # -- the steps ----------------------------------------------------------------------------

    def _goggles(self) -> None:
        self._set("role", "goggles")
        self._heading("The video receiver module, an RX5808")
        for name in _MODULE:
            self._ask(f"rx5808.{name}", needed=True)

    def _sensors(self) -> None:
        self._heading("Sensors")
        for sensor, what in _SENSORS.items():
            there = self._values[sensor]["enabled"]
            enabled = click.confirm(f"Is there {what}?", default=there)
            if not enabled:
                if there:
                    self._set(f"{sensor}.enabled", False)
                continue
            if not there:
                self._need_pins(sensor)
            for name in _DETAILS[sensor]:
                self._ask(f"{sensor}.{name}")
            if sensor == "battery" and click.confirm("Is there a current sensor?", default=False):
                for name in _CURRENT:
                    self._ask(f"battery.{name}", needed=name == _CURRENT[0])
            elif sensor == "battery" and self._values["battery"]["current_pin"] is not None:
                self._set("battery.current_pin", None)

    def _need_pins(self, sensor: str) -> None:
        """The pins of a sensor that the board has none for by default."""
        section: dict[str, Any] = {"enabled": True}
        while True:
            tree = with_value(self.tree, sensor, {**self.tree.get(sensor, {}), **section})
            for name in _PINS[sensor]:
                tree = with_value(tree, f"{sensor}.{name}", self._typed(f"{sensor}.{name}"))
            if sensor in ("barometer", "magnetometer") and self._values["i2c"]["sda_pin"] is None:
                for name in _BUS:
                    tree = with_value(tree, f"i2c.{name}", self._typed(f"i2c.{name}"))
            if self._take(tree):
                return

    def _outputs(self, wanted: tuple[Output, ...]) -> None:
        standard = sorted(self._values[OUTPUTS])
        # The board's own outputs are left out one by one, or taken.
        self._problems = []
        self.tree[OUTPUTS] = {str(pin): {"kind": "unused"} for pin in standard}
        _, self._problems = check(self.tree, self._board)
        armed = any(output.motor for output in wanted) and self._arming()
        for output in wanted:
            self._output(output, armed and output.motor)
        while not self._used() or click.confirm("One more output?", default=False):
            number = len(self._used()) + 1
            self._output(Output(f"output {number}", min(16, number)), False, ("name",))

    def _arming(self) -> bool:
        self._heading("Arming")
        if not click.confirm("Must the motor be armed with a switch?", default=True):
            return False
        self._ask("arming.channel", default="5")
        self._ask("arming.throttle_channel")
        return True

    def _output(self, output: Output, motor: bool, first: tuple[str, ...] = ()) -> None:
        self._heading(f"Output: {output.name}")
        standard: dict[str, Any] = {"channel": output.channel, "name": output.name}
        if motor:
            standard["motor"] = True
        while True:
            free = [pin for pin, found in self.tree[OUTPUTS].items() if found == _UNUSED]
            number = click.prompt("GPIO", type=int, default=int(free[0]) if free else None)
            if str(number) in self._used():
                click.echo(f"  GPIO {number} is taken by another output")
            elif self._take(with_value(self.tree, f"{OUTPUTS}.{number}", standard)):
                break
        names = ("channel",) if motor else ("channel", "kind", "reverse", "failsafe")
        for name in (*first, *names):
            if number in self._values[OUTPUTS]:
                self._ask(f"{OUTPUTS}.{number}.{name}")

    def _used(self) -> list[str]:
        return [pin for pin, found in self.tree[OUTPUTS].items() if found != _UNUSED]

    # -- single answers -----------------------------------------------------------------------

    def _heading(self, text: str) -> None:
        click.echo(f"\n{text}")

    def _ask(self, key: str, needed: bool = False, default: str | None = None) -> None:
        """Ask for the value at `key` until it can be; what is as it is already is not written.

        `needed`: null is no answer.
        """
        while True:
            value = self._typed(key, needed, default)
            if needed and value is None:
                continue
            if value == self._value(key) or self._take(with_value(self.tree, key, value)):
                return

    def _typed(self, key: str, needed: bool = False, default: str | None = None) -> Any:
        point = points(key)
        click.echo(f"  {point.help}")
        current = self._value(key)
        if default is None and not (needed and current is None):
            default = _text(current)
        if isinstance(point.default, bool):
            return click.confirm(f"{key}", default=bool(current))
        text = f"{key} ({point.range_text()})"
        answer = click.prompt(text, default=default, show_default=default != "")
        text_kind = firmware_module("configuration.kinds").Text
        return answer if isinstance(point, text_kind) else parse_value(answer)

    def _value(self, key: str) -> Any:
        return value_at(self._values, key)

    def _set(self, key: str, value: Any) -> None:
        self._take(with_value(self.tree, key, value))

    def _take(self, tree: dict[str, Any]) -> bool:
        """Make `tree` the file, unless that makes problems, which are told; returns whether."""
        values, problems = check(tree, self._board)
        new = [text for key, text in problems if (key, text) not in self._problems]
        for text in new:
            click.echo(f"  {text}")
        if new:
            return False
        self.tree, self._values, self._problems = tree, values, problems
        return True


_UNUSED = {"kind": "unused"}


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)
