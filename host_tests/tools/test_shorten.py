"""Private names of a board's modules: which become short, and which stay."""

from ghst_tools import boards, device_files
from ghst_tools.shorten import shorten

BASE = """\
class Base:
    def __init__(self, bus):
        self._bus = bus
        self._bus.start()

    def _measure(self, length):
        return self._bus.read(length)
"""
HEIR = """\
from base import Base

_COUNT = const(3)
_LIMIT = 7


class Heir(Base):
    def public(self, length):
        return self._measure(length) + _COUNT + _LIMIT
"""


def test_heirs_share_the_names_of_their_base() -> None:
    short = shorten({"base": BASE, "heir": HEIR})
    # In the order of their use: _bus, _measure, _LIMIT.
    assert short["base"] == (
        BASE.replace("_bus", "_a")
        .replace("_measure(self, length)", "_b(self, _d)")
        .replace("read(length)", "read(_d)")
    )
    assert short["heir"] == HEIR.replace("_measure", "_b").replace("_LIMIT", "_c")


def test_modules_use_the_same_names_again() -> None:
    short = shorten({"one": "_first = 1\nprint(_first)\n", "two": "_second = 2\n_third = 3\n"})
    assert short["one"] == "_a = 1\nprint(_a)\n"
    assert short["two"] == "_a = 2\n_b = 3\n"


def test_what_may_be_looked_up_by_its_name_stays() -> None:
    text = (
        "import sys\n"
        "_told = 1\n_asked = 2\n_a = 3\n_gone = 4\n"
        'print(f"{_told}", getattr(sys, "_asked"), sys.implementation._build, _a, _gone)\n'
    )
    short = shorten({"one": text, "two": "def _build():\n    pass\n"})
    assert short["one"] == text.replace("_gone", "_c").replace("_a = 3", "_b = 3").replace(
        ", _a,", ", _b,"
    )
    assert short["two"] == "def _build():\n    pass\n"


def test_parameters_of_private_functions() -> None:
    text = (
        "def _one(value, key):\n    return other.value + value + f(key=key)\n\n\n"
        "def _two(value):\n    return lambda: value\n\n\n"
        "def three(value):\n    return value\n"
    )
    short = shorten({"one": text})
    assert short["one"] == (
        "def _a(_c, key):\n    return other.value + _c + f(key=key)\n\n\n"
        "def _b(value):\n    return lambda: value\n\n\n"
        "def three(value):\n    return value\n"
    )


def test_the_firmware_keeps_its_lines_and_its_public_names() -> None:
    texts = {
        device_files.dotted(name): text
        for name, text in device_files.folded(device_files.sources(boards.checkout())).items()
    }
    short = shorten(texts)
    assert short.keys() == texts.keys()
    for name, text in texts.items():
        assert len(short[name].splitlines()) == len(text.splitlines())
    application = short["firmware.application"]
    assert "def vtx_event(self, kind):" in application and "self._vtx_controls" not in application
    assert sum(map(len, short.values())) < sum(map(len, texts.values()))


def test_what_is_no_python_is_left_to_the_compiler() -> None:
    assert shorten({"one": "a = = 1\n"}) == {"one": "a = = 1\n"}
