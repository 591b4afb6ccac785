"""A small set of shapes for circuit drawings, written as SVG."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence

Point = tuple[int, int]

_HOP = 6
_FONT = "DejaVu Sans, Verdana, sans-serif"


class Drawing:
    """A drawing on white; coordinates in pixels from the top left."""

    def __init__(self, width: int, title: str, description: str) -> None:
        self._root = ElementTree.Element(
            "svg", {"xmlns": "http://www.w3.org/2000/svg", "font-family": _FONT}
        )
        self.width = width
        self._add("title").text = title
        self._add("desc").text = description
        self._paper = self._add("rect", width=width, fill="#ffffff")

    def _add(self, tag: str, **attributes: str | int) -> ElementTree.Element:
        named = {key.replace("_", "-"): str(value) for key, value in attributes.items()}
        return ElementTree.SubElement(self._root, tag, named)

    def box(
        self, corner: Point, size: tuple[int, int], fill: str, line: str, radius: int = 8
    ) -> None:
        self._add(
            "rect",
            x=corner[0],
            y=corner[1],
            width=size[0],
            height=size[1],
            rx=radius,
            fill=fill,
            stroke=line,
            stroke_width=2,
        )

    def text(
        self,
        at: Point,
        text: str,
        *,
        anchor: str = "start",
        size: int = 14,
        colour: str = "#212529",
        bold: bool = False,
    ) -> None:
        """`at`: the base line's start, middle or end, as `anchor` says."""
        weight = {"font_weight": "bold"} if bold else {}
        element = self._add(
            "text",
            x=at[0],
            y=at[1],
            font_size=size,
            text_anchor=anchor,
            fill=colour,
            **weight,
        )
        element.text = text

    def wire(self, points: Sequence[Point], colour: str, *, dashed: bool = False) -> None:
        """A line of horizontal and vertical pieces."""
        self._path(_line(points), colour, dashed)

    def hopping_wire(self, start: Point, end_x: int, over_x: int, colour: str) -> None:
        """A horizontal line with a small arc where it crosses a vertical one."""
        x, y = start
        way = 1 if end_x > x else -1
        before = over_x - way * _HOP
        arc = f"a{_HOP} {_HOP} 0 0 {1 if way > 0 else 0} {2 * way * _HOP} 0"
        self._path(f"M{x} {y} H{before} {arc} H{end_x}", colour)

    def _path(self, path: str, colour: str, dashed: bool = False) -> None:
        dashes = {"stroke_dasharray": "6 4"} if dashed else {}
        self._add("path", d=path, fill="none", stroke=colour, stroke_width=3, **dashes)

    def dot(self, at: Point, colour: str) -> None:
        """A joint."""
        self._add("circle", cx=at[0], cy=at[1], r=5, fill=colour)

    def resistor(self, centre: Point, *, vertical: bool = False) -> None:
        width, height = (14, 28) if vertical else (34, 14)
        corner = (centre[0] - width // 2, centre[1] - height // 2)
        self.box(corner, (width, height), "#ffffff", "#212529", radius=0)

    def diode(self, centre: Point, *, upwards: bool = False) -> None:
        """A diode whose cathode is on the right, or above."""
        x, y = centre
        if upwards:
            triangle = f"M{x - 10} {y + 9} h20 l-10 -18 z"
            bar = f"M{x - 10} {y - 9} h20"
        else:
            triangle = f"M{x - 9} {y - 10} v20 l18 -10 z"
            bar = f"M{x + 9} {y - 10} v20"
        self._add("path", d=triangle, fill="#212529")
        self._add("path", d=bar, stroke="#212529", stroke_width=3)

    def ground(self, at: Point, colour: str) -> None:
        """The sign for ground, below a point."""
        for drop, half in ((0, 11), (5, 7), (10, 3)):
            self._add(
                "path",
                d=f"M{at[0] - half} {at[1] + drop} h{2 * half}",
                stroke=colour,
                stroke_width=2,
            )

    def finish(self, height: int) -> bytes:
        """The file, for a drawing of this height."""
        self._root.set("viewBox", f"0 0 {self.width} {height}")
        self._paper.set("height", str(height))
        ElementTree.indent(self._root)
        return ElementTree.tostring(self._root, encoding="utf-8") + b"\n"


def _line(points: Sequence[Point]) -> str:
    (x, y), *rest = points
    path = f"M{x} {y}"
    for to_x, to_y in rest:
        assert to_x == x or to_y == y, "not horizontal and not vertical"
        path += f" H{to_x}" if to_y == y else f" V{to_y}"
        x, y = to_x, to_y
    return path
