"""Constants that are folded across the modules of a board."""

import pytest

from ghst_tools.errors import GhstError
from ghst_tools.fold import fold

WORDS = """\
from micropython import const

LINK = const(0)
STAMP = const(LINK + 1)  # microseconds
NONE, HOLD = 0, -1
RULE = const(-1)
_OWN = const(7)
LARGE = const(0x40000000)
BAUDRATES = (9600, 115200)
"""


def folded(text: str, words: str = WORDS) -> str:
    return fold({"package": "", "package.words": words, "package.user": text})["package.user"]


def test_what_is_folded_away_at_its_definition() -> None:
    lines = fold({"words": WORDS})["words"].splitlines()
    assert lines == [
        "pass",
        "",
        "",
        "  # microseconds",
        "NONE, HOLD = 0, -1",
        "",
        "_OWN = const(7)",
        "LARGE = const(0x40000000)",  # no small integer of a 32-bit port
        "BAUDRATES = (9600, 115200)",
    ]


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("from package.words import LINK, STAMP; x = STAMP + 1", "pass; x = 1 + 1"),
        (
            "from package.words import STAMP as T, HOLD; x[T] = HOLD",
            "from package.words import HOLD; x[1] = HOLD",
        ),
        ("from package import words; x[words.STAMP] = words.LINK", "pass; x[1] = 0"),
        (
            "from package import words as w; x = w.RULE, w.HOLD",
            "from package import words as w; x = (-1), w.HOLD",
        ),
        (
            "from package.words import LARGE; x = LARGE",
            "from package.words import LARGE; x = LARGE",
        ),
        ("from package.words import RULE; x = 3 -RULE", "pass; x = 3 -(-1)"),
    ],
)
def test_uses(before: str, after: str) -> None:
    assert folded(before) == after + "\n"


def test_lines_keep_their_numbers() -> None:
    text = (
        "from package.words import (\n    BAUDRATES,\n    LINK,\n    STAMP,\n)\n\n\n"
        "def f(c):\n    from package.words import RULE\n\n"
        "    return (c[LINK],\n            c[STAMP], RULE)\n"
    )
    assert folded(text) == (
        "from package.words import BAUDRATES\n\n\n\n\n\n\n"
        "def f(c):\n    pass\n\n    return (c[0],\n            c[1], (-1))\n"
    )


def test_constants_pass_through_modules() -> None:
    results = fold(
        {
            "a": "from b import B\nX = const(B << 4 | 1)\n",
            "b": "from c import C as B\n",
            "c": "C = const(~0 + 3)\n",
            "d": "import a\nfrom a import X\nprint(X, a.X)\n",
        }
    )
    assert results["a"] == "pass\n\n"
    assert results["b"] == "pass\n"
    # `import a` is not followed: nobody writes it, and an attribute of it would be missed.
    assert results["d"] == "import a\npass\nprint(33, a.X)\n"


def test_what_only_cpython_and_the_compiler_need_goes() -> None:
    text = (
        "try:\n    import micropython\n    from micropython import const\n"
        "except ImportError:\n    from ghst._host import const, micropython, ptr8\n"
        "{import_it}\n"
        "_A = const(5)\n"
        "@micropython.viper\ndef f(x: ptr8) -> int:\n    return x[_A]\n"
    )
    assert fold({"m": text.format(import_it="")})["m"] == (
        "pass\n\n\n\n\n\n_A = const(5)\n"
        "@micropython.viper\ndef f(x: ptr8) -> int:\n    return x[5]\n"
    )
    needed = fold({"m": text.format(import_it="print(micropython.mem_info())")})["m"]
    assert needed.startswith("import micropython\n\n\n\n\nprint(micropython.mem_info())\n")


def test_a_constant_in_an_f_string_stays_where_it_is_read() -> None:
    text = "from package.words import LINK, STAMP\nprint(f'{LINK}', STAMP, LINK)\n"
    assert folded(text) == "LINK = const(0)\nprint(f'{LINK}', 1, 0)\n"
    words = fold({"words": "LINK = const(0)\nprint(f'{LINK}')\n"})["words"]
    assert words == "LINK = const(0)\nprint(f'{LINK}')\n"


def test_public_modules_keep_theirs() -> None:
    results = fold(
        {
            "firmware.vtx": "SETUP = const(0x20)\n",
            "firmware.x": "from firmware import vtx\nprint(vtx.SETUP)\n",
        }
    )
    assert results["firmware.vtx"] == "SETUP = const(0x20)\n"
    assert results["firmware.x"] == "pass\nprint(32)\n"


@pytest.mark.parametrize(
    "text",
    [
        "from package.words import LINK\n\n\ndef f(LINK):\n    pass\n",
        "from package.words import LINK\n\n\ndef f():\n    LINK = 5\n",
        "from package import words\nx = words.LINK\n\ndef f(x,\n      words): pass\n",
    ],
)
def test_a_constant_that_is_something_else_as_well_is_refused(text: str) -> None:
    with pytest.raises(GhstError, match=r"^package\.user:[45]: (LINK|words) is a constant, or"):
        folded(text)


def test_what_is_no_python_is_left_to_the_compiler() -> None:
    assert fold({"m": "a = = 1\n"}) == {"m": "a = = 1\n"}
