"""The types of a configuration's values: what each takes, and how that is told to a user.

A point is declared as `Whole("time_ms", 500, 110, 10_000, "ms", "help")`: its name, its default
and what it may be. A default of None means that the value may be null, which is what the help
then explains.
"""

import json


class Point:
    """One value of the configuration.

    `name`; `default`; `unit`, "" where there is none; `help`, a sentence or two. `range_text()`
    is what a user is told who gave something else.
    """

    unit = ""

    def __init__(self, name, default, help):
        self.name = name
        self.default = default
        self.help = help

    def check(self, value):
        """Returns the value as the firmware takes it; raises `ValueError` for what cannot be."""
        if value is None and self.default is None:
            return None
        if not self._takes(value):
            raise ValueError(self.range_text())
        return value

    def range_text(self):
        """Returns what the value may be, such as "110..10000 ms"."""
        return self._range() + (" or null" if self.default is None else "")


class Flag(Point):
    """true or false."""

    def _takes(self, value):
        return type(value) is bool

    def _range(self):
        return "true or false"


class Whole(Point):
    """A whole number."""

    def __init__(self, name, default, minimum, maximum, unit, help):
        super().__init__(name, default, help)
        self.minimum = minimum
        self.maximum = maximum
        self.unit = unit

    def _takes(self, value):
        return type(value) is int and self.minimum <= value <= self.maximum

    def _range(self):
        return f"{self.minimum}..{self.maximum} {self.unit}".strip()


class Number(Whole):
    """A number, with decimals or without."""

    def _takes(self, value):
        return type(value) in (int, float) and self.minimum <= value <= self.maximum


class Text(Point):
    """Printable ASCII."""

    def __init__(self, name, default, longest, help):
        super().__init__(name, default, help)
        self.longest = longest

    def _takes(self, value):
        return (
            type(value) is str
            and len(value) <= self.longest
            and all(32 <= ord(letter) < 127 for letter in value)
        )

    def _range(self):
        return f"a text of at most {self.longest} ASCII characters"


class Choice(Point):
    """One of some words."""

    def __init__(self, name, default, choices, help):
        super().__init__(name, default, help)
        self.choices = choices

    def _takes(self, value):
        return type(value) is str and value in self.choices

    def _range(self):
        return "one of " + ", ".join(self.choices)


class Pin(Point):
    """A GPIO number. `function`: what the pin must be able to do, as `board.json` calls it.

    Braces in it stand for another value of the section: "uart{uart} tx".
    """

    def __init__(self, name, default, function, help):
        super().__init__(name, default, help)
        self.function = function

    def _takes(self, value):
        return type(value) is int and 0 <= value <= 63

    def _range(self):
        return "a GPIO number"


class Channel(Whole):
    """A channel of the radio, 1..16."""

    def __init__(self, name, default, help):
        super().__init__(name, default, 1, 16, "", help)


class Failsafe(Point):
    """ "hold", "none", or the pulse in microseconds; "on" and "off" for a switch."""

    WORDS = ("hold", "none", "on", "off")

    def _takes(self, value):
        if type(value) is str:
            return value in self.WORDS
        return type(value) in (int, float) and 100 <= value <= 2200

    def _range(self):
        return '"hold", "none", a pulse in us, or "on" or "off" for a switch'


class Axes(Whole):
    """Three whole numbers, one for each axis."""

    def _takes(self, value):
        if type(value) is not list or len(value) != 3:
            return False
        return all(type(part) is int and abs(part) <= self.maximum for part in value)

    def _range(self):
        return f"three numbers, each {super()._range()}"


def read(table):
    """Returns {section: (point, ...)} of their declarations in JSON: class, arguments, no help.

    A board has its points in this form; the build makes it of `points.py`.
    """
    kinds = globals()
    return {
        section: tuple([kinds[row[0]](*row[1:], "") for row in rows])
        for section, rows in json.loads(table).items()
    }
