"""Reads JSON text, and nothing that only looks like it."""

import json

LARGEST = 16384
"""Bytes that a file of the user may have."""


def parse(text):
    """Returns what `text` says; raises `ValueError`, or whatever a parser does with nonsense.

    MicroPython 1.25 takes an object that lacks its last brackets. In a list, what follows the
    object is seen only if that is whole.
    """
    tree, _ = json.loads("[" + text + ", 1]")
    return tree
