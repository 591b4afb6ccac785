"""Checks a configuration, and fills in what it leaves out.

    values, problems = check(tree, board)

The same code runs on the board at its start and in `ghst config`.
"""

from firmware.configuration.hardware import check_hardware
from firmware.configuration.outputs import check_outputs
from firmware.configuration.points import OUTPUT, SECTIONS

OUTPUTS = "outputs"
_EMPTY = '""'


class Problems:
    """What is wrong: `lines`, pairs of the key, such as "outputs.6.channel", and the text."""

    def __init__(self):
        self.lines = []

    def add(self, key, text):
        """Notes a problem with the value at `key`."""
        self.lines.append((key, text))


def check(tree, board):
    """Returns (values, [(key, text), ...]); without problems the list is empty.

    `tree`: what stands in `ghst.json`, parsed; `board`: the description of the board, a dict with
    `functions` and `defaults`. `values`: {section: {name: value}}, and in "outputs"
    {GPIO: {name: value}}; everything has a value, where there was a problem the default.
    """
    problems = Problems()
    defaults = board.get("defaults", {})
    if not isinstance(tree, dict):
        problems.add("", "the configuration must be a JSON object")
        tree = {}
    for key in tree:
        # "" is the section of what stands at the top, not one that a file may have.
        known = key and (key == OUTPUTS or key in SECTIONS or _point(SECTIONS[""], key))
        if not known:
            names = [name for name in SECTIONS if name] + [OUTPUTS]
            names += [point.name for point in SECTIONS[""]]
            text = f"{key if key != '' else _EMPTY} is unknown, there are "
            problems.add(key, text + ", ".join(sorted(names)))
    values = {}
    for section, points in SECTIONS.items():
        given = _section(tree, section, problems)
        standard = defaults.get(section, {}) if section else defaults
        values[section] = _fill(section, points, given, standard, problems)
        # What the board has a place for, or the user writes about, is there.
        if _point(points, "enabled") and "enabled" not in given and "enabled" not in standard:
            values[section]["enabled"] = section in tree or section in defaults
    values[OUTPUTS] = _outputs(tree, defaults, problems)
    check_outputs(values, problems)
    check_hardware(values, board, problems)
    return values, problems.lines


def _point(points, name):
    for point in points:
        if point.name == name:
            return point
    return None


def _section(tree, section, problems):
    if not section:
        return {key: value for key, value in tree.items() if key not in SECTIONS}
    given = tree.get(section, {})
    if not isinstance(given, dict):
        problems.add(section, f"{section} is {given!r}, must be a JSON object")
        return {}
    return given


def _fill(path, points, given, standard, problems):
    values = {}
    sources = [source for source in (standard, given) if source]
    for point in points:
        value = point.default
        for source in sources:
            if point.name not in source:
                continue
            try:
                value = point.check(source[point.name])
            except ValueError as error:
                key = f"{path}.{point.name}" if path else point.name
                problems.add(key, f"{key} is {_shown(source[point.name])}, must be {error}")
        values[point.name] = value
    if path:
        for name in given:
            if _point(points, name) is None:
                names = ", ".join([point.name for point in points])
                problems.add(f"{path}.{name}", f"{path}.{name} is unknown, there are {names}")
    return values


def _shown(value):
    """Returns a value as JSON has it."""
    if value is None or value is True or value is False:
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, str):
        return f'"{value}"'
    return "a list" if isinstance(value, list) else "{...}" if isinstance(value, dict) else value


def _is_number(text):
    digits = all([letter in "0123456789" for letter in text])
    return digits and (text == "0" or text[:1] not in ("", "0"))


def _outputs(tree, defaults, problems):
    given = tree.get(OUTPUTS, {})
    if not isinstance(given, dict):
        problems.add(OUTPUTS, f"{OUTPUTS} is {_shown(given)}, must be a JSON object")
        given = {}
    standard = defaults.get(OUTPUTS, {})
    values = {}
    for key in list(standard) + [key for key in given if key not in standard]:
        path = f"{OUTPUTS}.{key}"
        # MicroPython's parser takes names that are no strings.
        if type(key) is not str or not _is_number(key):
            problems.add(path, f"{path} is no GPIO number")
            continue
        points = given.get(key, {})
        if not isinstance(points, dict):
            problems.add(path, f"{path} is {_shown(points)}, must be a JSON object")
            points = {}
        output = _fill(path, OUTPUT, points, standard.get(key, {}), problems)
        if output["kind"] == "unused":
            continue
        if output["channel"] is None:
            problems.add(path, f"{path}.channel is missing, must be 1..16")
            continue
        values[int(key)] = output
    return values
