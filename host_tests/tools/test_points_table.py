"""The configuration's points as boards have them: the same but for the help texts."""

from typing import Any

import pytest
from firmware.configuration import points  # type: ignore[import-not-found]

from ghst_tools import boards, points_table
from ghst_tools.errors import GhstError


def attributes(section: Any) -> list[tuple[type, dict[str, Any]]]:
    """Class and attributes of each point, lists for tuples as JSON has them, without help."""
    found = []
    for point in section:
        values = {key: value for key, value in vars(point).items() if key != "help"}
        found.append(
            (type(point), {k: list(v) if isinstance(v, tuple) else v for k, v in values.items()})
        )
    return found


def test_a_board_has_the_same_points() -> None:
    text = (boards.checkout() / points_table.MODULE).read_text()
    module: dict[str, Any] = {}
    exec(points_table.compact(text), module)
    assert list(module["SECTIONS"]) == list(points.SECTIONS)
    for name, section in points.SECTIONS.items():
        assert attributes(module["SECTIONS"][name]) == attributes(section)
    assert attributes(module["OUTPUT"]) == attributes(points.OUTPUT)
    assert {point.help for point in module["OUTPUT"]} == {""}


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ('OUTPUT = (Flag("a", False, "help", unit=""),)', "1: a point must be a call"),
        ('OUTPUT = (\n    Flag("a", not False, "help"),\n)', "2: only literals can be declared"),
        ('OUTPUT = [Flag("a", False, "help")]', "1: points must stand in a tuple"),
        ("SECTIONS = {len: ()}", "1: only literals can be declared"),
    ],
)
def test_what_cannot_be_a_table_is_named(text: str, error: str) -> None:
    with pytest.raises(GhstError) as caught:
        points_table.compact(text)
    assert str(caught.value).startswith(f"firmware/configuration/points.py:{error}")
