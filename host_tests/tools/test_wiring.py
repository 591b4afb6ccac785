"""The wiring pictures and docs/boards.md: up to date, and nothing on top of anything else."""

import re
import xml.etree.ElementTree as ElementTree
from itertools import combinations, pairwise
from pathlib import Path
from typing import NamedTuple

import pytest
import small_checkout
from click.testing import CliRunner
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath

from ghst_tools import boards, wiring
from ghst_tools.chips import CHIPS
from ghst_tools.errors import GhstError
from ghst_tools.selftest_picture import SelftestPicture
from ghst_tools.wiring_picture import WiringPicture

ALL = boards.names()
RP2 = [name for name in ALL if CHIPS[boards.load(name).chip].is_rp2]
MADE = wiring.documents()
NAMESPACE = "{http://www.w3.org/2000/svg}"


class Box(NamedTuple):
    """A rectangle; `what` for messages."""

    left: float
    top: float
    right: float
    bottom: float
    what: str

    def overlaps(self, other: "Box") -> bool:
        return (
            self.left < other.right
            and other.left < self.right
            and self.top < other.bottom
            and other.top < self.bottom
        )


def text_box(element: ElementTree.Element) -> Box:
    """Where the glyphs are, in the font that the drawing names first."""
    text = element.text or ""
    size = float(element.get("font-size", "0"))
    font = FontProperties(family="DejaVu Sans", weight=element.get("font-weight", "normal"))
    extent = TextPath((0, 0), text, size=size, prop=font).get_extents()
    x, y = float(element.get("x", "0")), float(element.get("y", "0"))
    shift = {"start": 0.0, "middle": extent.width / 2, "end": extent.width}
    left = x - shift[element.get("text-anchor", "start")]
    return Box(left, y - extent.y1, left + extent.width, y - extent.y0, text)


def pieces(path: str) -> list[Box]:
    """The straight pieces of a path of M, H, V and a (hops), as boxes without a width."""
    x = y = 0.0
    found = []
    for letter, arguments in re.findall(r"([MHVa])([^MHVa]*)", path):
        numbers = [float(number) for number in arguments.split()]
        before = (x, y)
        if letter == "M":
            x, y = numbers
            continue
        if letter == "H":
            (x,) = numbers
        elif letter == "V":
            (y,) = numbers
        else:
            x, y = x + numbers[-2], y + numbers[-1]
        found.append(Box(min(before[0], x), min(before[1], y), max(before[0], x),
                         max(before[1], y), path))  # fmt: skip
    return found


@pytest.mark.parametrize("path", MADE)
def test_what_is_committed_is_what_is_made(path: str) -> None:
    assert (boards.checkout() / path).read_bytes() == MADE[path], "run: ghst wiring"


def test_no_picture_is_left_of_a_board_that_is_gone() -> None:
    pictures = (boards.checkout() / "docs/img").glob("wiring_*.svg")
    assert sorted(path.name for path in pictures) == [f"wiring_{name}.svg" for name in ALL]
    pictures = (boards.checkout() / "docs/img").glob("selftest_*.svg")
    assert sorted(path.name for path in pictures) == [f"selftest_{name}.svg" for name in RP2]


@pytest.mark.parametrize("path", [path for path in MADE if path.endswith(".svg")])
def test_nothing_lies_on_a_text(path: str) -> None:
    root = ElementTree.fromstring(MADE[path])
    width, height = map(int, root.get("viewBox", "").split()[2:])
    texts = [text_box(element) for element in root.iter(f"{NAMESPACE}text")]
    assert len(texts) > 25
    for one, other in combinations(texts, 2):
        assert not one.overlaps(other), (one, other)
    for text in texts:
        assert text.left > 0 and text.top > 0 and text.right < width and text.bottom < height
    lines = [
        piece
        for element in root.iter(f"{NAMESPACE}path")
        if element.get("fill") == "none"
        for piece in pieces(element.get("d", ""))
    ]
    for line in lines:
        wide = Box(line.left - 1.5, line.top - 1.5, line.right + 1.5, line.bottom + 1.5, line.what)
        for text in texts:
            assert not wide.overlaps(text), (line, text)
    for rectangle in list(root.iter(f"{NAMESPACE}rect"))[1:]:
        x, y, w, h = (float(rectangle.get(key, "0")) for key in ("x", "y", "width", "height"))
        edges = [(x, y), (x + w, y), (x + w, y + h), (x, y + h), (x, y)]
        for (x1, y1), (x2, y2) in pairwise(edges):
            edge = Box(min(x1, x2) - 1, min(y1, y2) - 1, max(x1, x2) + 1, max(y1, y2) + 1, "edge")
            for text in texts:
                assert not edge.overlaps(text), (edge, text)


@pytest.mark.parametrize("name", ALL)
def test_each_pin_of_the_defaults_is_in_the_picture(name: str) -> None:
    board = boards.load(name)
    root = ElementTree.fromstring(WiringPicture(board).draw())
    bold = [e.text for e in root.iter(f"{NAMESPACE}text") if e.get("font-weight")]
    pins = [int(gpio) for gpio in board.defaults["outputs"]]
    for section, options in board.defaults.items():
        if section not in ("outputs", "led"):
            pins += [value for key, value in options.items() if key.endswith("pin")]
    labels = [board.label(pin) for pin in pins]
    labels += [row.to for row in board.wiring if row.source != "receiver Tx" or row.part]
    # That of TX is in both.
    if "tx_pin" in board.defaults["wire"]:
        labels.remove(board.label(board.defaults["wire"]["tx_pin"]))
    titles = {"Ghost receiver", "Servos", "GPS", "Battery", "BEC", "Barometer, magnetometer"}
    shown = [text for text in bold if text not in titles and not (text or "").startswith("Wiring")]
    assert sorted(map(str, shown)) == sorted(labels)
    channels = [f"channel {output['channel']}" for output in board.defaults["outputs"].values()]
    all_texts = [element.text for element in root.iter(f"{NAMESPACE}text")]
    assert [text for text in all_texts if (text or "").startswith("channel")] == channels


@pytest.mark.parametrize("name", RP2)
def test_the_picture_of_the_self_test_has_each_of_its_pins(name: str) -> None:
    board = boards.load(name)
    root = ElementTree.fromstring(SelftestPicture(board).draw())
    assert board.selftest_pin is not None
    pins = [board.defaults["wire"]["pin"], board.selftest_pin]
    pins += [board.defaults["i2c"]["sda_pin"], board.defaults["i2c"]["scl_pin"]]
    pins += [int(gpio) for gpio in board.defaults["outputs"]]
    pins.append(board.defaults["battery"]["voltage_pin"])
    bold = [e.text for e in root.iter(f"{NAMESPACE}text") if e.get("font-weight")]
    shown = [text for text in bold if text not in ("jumper", "I2C sensors")]
    assert shown[0] == f"Self-test of the {board.title}"
    assert shown[1:] == [board.label(pin) for pin in pins]
    # One line has two ends at the board: the jumper, from the first pin to the second.
    jumper = [e.get("d") for e in root.iter(f"{NAMESPACE}path") if " V" in (e.get("d") or "")]
    assert jumper == ["M330 150 H260 V210 H330"]


def test_the_command_writes_one_or_all(tmp_path: Path) -> None:
    root = small_checkout.make(tmp_path)
    run = CliRunner().invoke
    result = run(wiring.command, ["--board", "rpi_pico2", "--tree", str(root)])
    assert result.exit_code == 0, result.output
    assert result.output.splitlines() == [
        f"{root}/docs/img/wiring_rpi_pico2.svg",
        f"{root}/docs/img/selftest_rpi_pico2.svg",
    ]
    result = run(wiring.command, ["--all", "--tree", str(root)])
    assert result.exit_code == 0, result.output
    made = [str(path.relative_to(root)) for path in (root / "docs").rglob("*.*")]
    assert sorted(made) == sorted(MADE)
    assert all((root / path).read_bytes() == content for path, content in MADE.items())
    result = run(wiring.command, ["--all", "--board", "rpi_pico"])
    assert result.exit_code == 2


def test_a_folder_without_boards_gets_no_document(tmp_path: Path) -> None:
    result = CliRunner().invoke(wiring.command, ["--tree", str(tmp_path)])
    assert isinstance(result.exception, GhstError)
    assert str(result.exception) == (
        f"{tmp_path}: has no boards/*/board.json: name a checkout with --tree"
    )
    assert not list(tmp_path.iterdir())
