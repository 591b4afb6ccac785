"""What a valid `ghst.json` says, read a second time: its values put over the board's defaults."""

from __future__ import annotations

import copy
import json
import math
from typing import Any

from ghst_tools.campaign.verdict import equal, expect

Values = dict[str, Any]

_UNUSED = "unused"
# Single precision, in which the chip has its decimals.
_PRECISION = 1e-6


def strict(text: bytes) -> Any:
    """What `text` says as JSON to the letter. Raises ValueError, RecursionError if it is none."""

    def refuse(name: str) -> None:
        raise ValueError(f"{name} is no JSON")

    return json.loads(text.decode("utf-8"), parse_constant=refuse)


def is_strict(text: bytes) -> bool:
    """Whether `text` is JSON to the letter."""
    try:
        strict(text)
    except (ValueError, RecursionError):
        return False
    return True


def merged(tree: Values, defaults: Values) -> Values:
    """All values of a valid file; `defaults`: those of an empty one."""
    values = copy.deepcopy(defaults)
    for section, given in tree.items():
        if section == "outputs":
            continue
        if section not in values:
            values[""][section] = given
            continue
        values[section].update(given)
        # What the user writes about is there.
        if "enabled" in values[section] and "enabled" not in given:
            values[section]["enabled"] = True
    values["outputs"] = _outputs(tree.get("outputs", {}), defaults["outputs"])
    if values[""]["role"] == "goggles":
        values["outputs"] = {}
    return values


def _outputs(given: Values, defaults: dict[int, Values]) -> dict[int, Values]:
    outputs = copy.deepcopy(defaults)
    # An output that the board has no default for is as any other, but for its channel.
    any_output = next(iter(defaults.values())) | {"channel": None}
    for pin, points in given.items():
        outputs[int(pin)] = outputs.get(int(pin), any_output) | points
    return {pin: points for pin, points in outputs.items() if points["kind"] != _UNUSED}


def compare(found: Values, text: bytes, defaults: Values) -> None:
    """Raise Wrong unless each value that was found in a valid file is the one that it says."""
    wanted = merged(strict(text), defaults)
    equal(sorted(found), sorted(wanted), "sections")
    for section in found:
        equal(sorted(found[section]), sorted(wanted[section]), f"names in {section or 'the file'}")
        for name, value in found[section].items():
            said = wanted[section][name]
            right = _same(value, said)
            expect(right, f"{section}.{name} is {value!r}, the file says {said!r}")


def _same(found: Any, said: Any) -> bool:
    if isinstance(found, dict) and isinstance(said, dict):
        return found.keys() == said.keys() and all(_same(found[key], said[key]) for key in found)
    if isinstance(found, list) and isinstance(said, list):
        return len(found) == len(said) and all(map(_same, found, said))
    if type(found) is float and type(said) is float:
        return math.isclose(found, said, rel_tol=_PRECISION)
    return type(found) is type(said) and bool(found == said)
