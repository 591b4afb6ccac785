"""The declared points of the configuration in the form in which a board has them.

A board needs no help texts, and of names and units that stand in code every short one would stay
in its memory for good. So it gets the declarations as JSON, which it reads when it starts.
"""

import ast
import json
from typing import Any

from ghst_tools.errors import GhstError

MODULE = "firmware/configuration/points.py"

_FORM = '''"""The declared points: firmware/configuration/points.py without its help texts."""

from firmware.configuration.kinds import read

SECTIONS = read({table!r})
OUTPUT = SECTIONS.pop("outputs")
'''


def compact(text: str) -> str:
    """The module for a board, of the text of `firmware/configuration/points.py`.

    Each point there is a call of a class of `firmware.configuration.kinds` with literals as
    arguments, the last of which is the help; `GhstError` names what is not.
    """
    literals: dict[str, Any] = {}
    tables: dict[str, Any] = {}
    for statement in ast.parse(text).body:
        match statement:
            case ast.Assign(targets=[ast.Name(id="SECTIONS")], value=ast.Dict() as sections):
                for key, points in zip(sections.keys, sections.values, strict=True):
                    tables[_value(key, literals)] = _points(points, literals)
            case ast.Assign(targets=[ast.Name(id="OUTPUT")], value=points):
                tables["outputs"] = _points(points, literals)
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                literals[name] = _value(value, literals)
    table = json.dumps(tables, separators=(",", ":"), allow_nan=False)
    return _FORM.format(table=table.encode("ascii"))


def _points(node: ast.expr, literals: dict[str, Any]) -> list[list[Any]]:
    if not isinstance(node, ast.Tuple):
        raise _error(node, "points must stand in a tuple")
    return [_point(call, literals) for call in node.elts]


def _point(node: ast.expr, literals: dict[str, Any]) -> list[Any]:
    match node:
        case ast.Call(func=ast.Name(id=kind), args=[*arguments, _], keywords=[]):
            return [kind, *(_value(argument, literals) for argument in arguments)]
    raise _error(node, "a point must be a call of its kind, without keywords")


def _value(node: ast.expr | None, literals: dict[str, Any]) -> Any:
    if isinstance(node, ast.Name) and node.id in literals:
        return literals[node.id]
    try:
        return ast.literal_eval(node)  # type: ignore[arg-type]
    except ValueError:
        raise _error(node, "only literals can be declared") from None


def _error(node: ast.expr | None, text: str) -> GhstError:
    return GhstError(f"{MODULE}:{node.lineno if node else 1}: {text}")
