"""Reads the board's description and the user's configuration at the start."""

from firmware.configuration.check import check
from firmware.json_text import LARGEST, parse

BOARD_FILE = "/board.json"
FILE = "/ghst.json"
_ENOENT = 2


class BoardError(Exception):
    """The board's description cannot be used; the text says where and why."""


class Configuration:
    """What the firmware goes by.

    `board`: the description, a dict; `values`: as `check` returns them; `problems`: lines about
    what is wrong with the user's file, none if all is well. With problems `values` are the
    board's defaults, without outputs: nothing moves.
    """

    # No methods: they would keep this module, and all that it has loaded, in memory.


def _configuration(board, tree, problems):
    """`tree`: what stands in the user's file; `problems`: lines from reading it."""
    made = Configuration()
    made.board = board
    made.problems = list(problems)
    if not problems:
        try:
            made.values, found = check(tree, board)
        except Exception as error:
            # The board's file may be broken, too.
            found = [("", f"{type(error).__name__}: {error}")]
        made.problems += [_line(f"{FILE}: {text}") for _, text in found]
    if made.problems:
        try:
            made.values, found = check({}, board)
        except Exception:
            found = [("", "a value is wrong: flash the board again")]
        if found:
            raise BoardError(_line(f"{BOARD_FILE}: {found[0][1]}"))
        made.values["outputs"] = {}
    return made


def _line(text):
    # Names in a broken file may have anything in them.
    return "".join([letter if 32 <= ord(letter) < 127 else "?" for letter in text])


def load():
    """Returns the `Configuration` of this board; raises `BoardError` with one clear line."""
    here = board()
    problems = []
    tree = {}
    try:
        tree = _tree(FILE)
    except (OSError, ValueError) as error:
        try:
            # The power failed between the end of a save and its last step, if this one is whole.
            tree = _tree(FILE + ".new")
        except (OSError, ValueError):
            # No file: all is as the board has it.
            if isinstance(error, ValueError):
                problems.append(f"{FILE} is broken: no valid JSON")
            elif error.errno != _ENOENT:
                problems.append(f"{FILE} cannot be read: OSError {error.errno}")
    return _configuration(here, tree, problems)


def _tree(path):
    with open(path, "rb") as file:
        try:
            return parse(file.read(LARGEST))
        except Exception:
            # Whatever it is that a broken file does to the parser.
            raise ValueError from None


def board():
    """Returns the board's description; raises `BoardError` with one clear line."""
    try:
        with open(BOARD_FILE, "rb") as file:
            text = file.read()
    except OSError:
        try:
            from ghst_board import DEFINITION
        except ImportError:
            raise BoardError(f"{BOARD_FILE} is missing: flash the board again") from None
        text = DEFINITION
    try:
        found = parse(text)
    except Exception:
        # Whatever it is that a broken file does to the parser.
        raise BoardError(f"{BOARD_FILE} is not valid JSON: flash the board again") from None
    for key, kind in (("name", str), ("chip", str), ("functions", dict), ("defaults", dict)):
        if not isinstance(found, dict) or not isinstance(found.get(key), kind):
            raise BoardError(f"{BOARD_FILE}: {key} is missing or wrong: flash the board again")
    return found
